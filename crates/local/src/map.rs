use super::frame::Frame;
use super::inflation::Inflation;
use super::parameters::LocalParameters;
use super::reader::{LocalReader, Shared};
use super::report::LocalReport;
use super::sweep::Sweep;
use super::tree::Tree;
use super::view::LocalView;
use super::voxels::{MAX_NUMBERED, Voxels};
use std::sync::Arc;
use std::time::{Duration, Instant};
use voxtile::scan::{Scan, ScanPoints};
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile::{Error, Result};

/// Map of the voxels that a planner needs: occupied voxels and those inflated by them.
///
/// One writer inserts scans. Readers see complete updates and never block.
#[derive(Debug)]
pub struct LocalMap {
    pub(super) grid: Grid,
    /// Parameters of the next update.
    parameters: LocalParameters,
    /// Parameters of the last update.
    pub(super) applied: LocalParameters,
    pub(super) tree: Tree,
    pub(super) voxels: Voxels,
    pub(super) inflation: Inflation,
    pub(super) sweep: Sweep,
    /// Reused by all updates to avoid allocations.
    pub(super) frame: Frame,
    pub(super) position: Option<Point>,
    update_number: u64,
    shared: Arc<Shared>,
    view: Arc<LocalView>,
}

/// Largest absolute voxel index in the map. Closer to the limits of `i32`, the voxels to inflate would have no index.
const MAX_INDEX: i32 = i32::MAX - (1 << 12);

impl LocalMap {
    /// Creates an empty map with voxels of `resolution_m` metres.
    ///
    /// # Errors
    ///
    /// If the resolution or a parameter is invalid.
    pub fn new(resolution_m: f64, parameters: LocalParameters) -> Result<Self> {
        let grid = Grid::new(resolution_m, resolution_m * 64.0)?;
        let parameters = parameters.validated(resolution_m)?;
        let LocalParameters { inflation_range_m, inflation_radius_m, .. } = parameters;
        let view = Arc::new(LocalView::empty(grid));
        Ok(Self {
            grid,
            parameters,
            applied: parameters,
            tree: Tree::default(),
            voxels: Voxels::default(),
            inflation: Inflation::new(inflation_range_m, inflation_radius_m, resolution_m),
            sweep: Sweep::default(),
            frame: Frame::default(),
            position: None,
            update_number: 0,
            shared: Arc::new(Shared::new(view.clone())),
            view,
        })
    }

    /// Returns the edge length of a voxel in metres.
    pub fn resolution_m(&self) -> f64 {
        self.grid.resolution_m()
    }

    /// Returns the parameters of the next update.
    pub fn parameters(&self) -> &LocalParameters {
        &self.parameters
    }

    /// Sets the parameters of later updates. Their effect on voxels that a scan does not touch is spread over several
    /// updates, nearest to the sensor first; see [`LocalParameters::work_per_update`] and [`LocalReport::is_settled`].
    ///
    /// # Errors
    ///
    /// If a parameter is invalid; the map then keeps its parameters.
    pub fn set_parameters(&mut self, parameters: LocalParameters) -> Result<()> {
        self.parameters = parameters.validated(self.resolution_m())?;
        Ok(())
    }

    /// Inserts a scan: hits at its points, misses on the rays to them. Intensities are not used.
    ///
    /// Points that are not stored as world coordinates are converted into a buffer first.
    ///
    /// # Errors
    ///
    /// If the origin is not finite or outside of the range of voxel indices, a point cannot be read, or voxels and
    /// points exceed 67 million. The map is then unchanged.
    pub fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<LocalReport> {
        self.insert_after(scan, || Ok(())).map(|(report, ())| report)
    }

    /// [`LocalMap::insert_points`] for a [`Scan`].
    ///
    /// # Errors
    ///
    /// As for [`LocalMap::insert_points`].
    pub fn insert_scan(&mut self, scan: &Scan) -> Result<LocalReport> {
        self.insert_points(scan)
    }

    /// Inserts a scan after all checks have passed and `first` has succeeded.
    pub(super) fn insert_after<T>(
        &mut self,
        scan: &dyn ScanPoints,
        first: impl FnOnce() -> Result<T>,
    ) -> Result<(LocalReport, T)> {
        self.check_scan(scan.origin(), scan.len())?;
        let mut buffer = std::mem::take(&mut self.frame.points);
        let inserted = points_in_world(scan, &mut buffer).and_then(|points| {
            let done = first()?;
            Ok((self.update(scan.origin(), points, true)?, done))
        });
        self.frame.points = buffer;
        inserted
    }

    /// Inserts points in metres, world frame, from another map: hits without rays. The robot is at `position`.
    ///
    /// # Errors
    ///
    /// Fails if the position is not finite or outside of the range of voxel indices, or if the sum of voxels and points
    /// exceeds 67 million. The map is then unchanged.
    pub fn insert_relayed(&mut self, position: Point, points: &[Point]) -> Result<LocalReport> {
        self.update(position, points, false)
    }

    fn update(&mut self, origin: Point, points: &[Point], has_rays: bool) -> Result<LocalReport> {
        let start = self.check_scan(origin, points.len())?;
        let mut report = LocalReport { points: points.len() as u64, ..LocalReport::default() };
        let mut clock = Clock::start();
        self.apply_parameters(&mut report);
        self.position = Some(origin);
        report.times.parameters = clock.lap();
        self.take_hits(origin, start, points, &mut report);
        report.times.input = clock.lap();
        if has_rays {
            self.take_misses(origin, start, points);
        }
        report.times.rays = clock.lap();
        self.check_occupancy();
        report.times.occupancy = clock.lap();
        self.manage_history(&mut report);
        report.times.removal = clock.lap();
        self.inflate(origin, &mut report);
        report.times.inflation = clock.lap();
        self.publish();
        report.times.publishing = clock.lap();
        Ok(report)
    }

    pub(super) fn inflate(&mut self, position: Point, report: &mut LocalReport) {
        self.inflation.update(&mut self.tree, self.grid, position, !self.sweep.is_done());
        report.inflation_changes = std::mem::take(&mut self.inflation.changes) as u64;
        report.is_settled = self.parameters == self.applied && self.sweep.is_done() && !self.is_over_limit();
    }

    /// Returns whether there are more voxels than the limit. This happens after the limit was lowered; the excess is
    /// removed over several updates.
    pub(super) fn is_over_limit(&self) -> bool {
        self.applied.max_voxels.is_some_and(|limit| self.voxels.len() > limit)
    }

    /// Returns the voxel of a sensor position.
    pub(super) fn check_position(&self, position: Point) -> Result<VoxelIndex> {
        self.voxel_of(position).ok_or_else(|| {
            let reason = format!("must be finite and in the range of voxel indices, but is {position:?} m");
            Error::argument("scan origin", reason)
        })
    }

    /// Returns the voxel of a scan's origin if the map accepts the scan; nothing can fail after this check.
    fn check_scan(&self, origin: Point, points: usize) -> Result<VoxelIndex> {
        check_room(self.voxels.len(), points)?;
        self.check_position(origin)
    }

    /// Returns the voxel of a point if it is in the range of the map.
    pub fn voxel_of(&self, point: Point) -> Option<VoxelIndex> {
        let voxel = self.grid.voxel_of(point)?;
        voxel.iter().all(|k| (-MAX_INDEX..=MAX_INDEX).contains(k)).then_some(voxel)
    }

    /// Applies parameters set since the last update, and does a part of the resulting work.
    pub(super) fn apply_parameters(&mut self, report: &mut LocalReport) {
        if self.parameters != self.applied {
            let before = std::mem::replace(&mut self.applied, self.parameters);
            if !self.inflation.rules.has_free_number() {
                // All rule numbers are in use by earlier ranges and radii that are not yet applied to the whole map.
                // The new range and radius are applied when a number is free.
                self.applied.inflation_range_m = before.inflation_range_m;
                self.applied.inflation_radius_m = before.inflation_radius_m;
            }
            self.begin_sweep(&before);
        }
        self.sweep_some(self.applied.work_per_update, report);
    }

    /// Publishes the map to readers.
    pub(super) fn publish(&mut self) {
        self.update_number += 1;
        let dirty = self.tree.take_dirty();
        let mut view = LocalView::clone(&self.view);
        view.occupied = self.occupied();
        view.update_number = self.update_number;
        view.position = self.position;
        view.stored = self.voxels.len();
        view.inflated = self.inflation.inflated;
        view.replace_pages(&self.tree, &dirty);
        self.tree.shown(dirty);
        self.view = Arc::new(view);
        self.shared.set(self.view.clone());
    }

    fn occupied(&self) -> usize {
        self.tree.page_ids().map(|page| self.tree.pages.get(page).occupied as usize).sum()
    }

    /// Returns the map after the last update; the view never changes.
    pub fn view(&self) -> &Arc<LocalView> {
        &self.view
    }

    /// Returns a reader for another thread.
    pub fn reader(&self) -> LocalReader {
        LocalReader::new(self.shared.clone())
    }

    /// Returns the number of stored voxels (`n_occ`): occupied, or not yet known to be free.
    pub fn stored_voxels(&self) -> usize {
        self.voxels.len()
    }

    /// Returns the number of inflated voxels (`n_inf`).
    pub fn inflated_voxels(&self) -> usize {
        self.inflation.inflated
    }

    /// Returns the number of voxels that are stored or inflated; visits all of them.
    pub fn voxels(&self) -> usize {
        self.inflation.inflated + self.tree.stored_but_not_inflated()
    }

    /// Returns each stored voxel and its log-odds in the order of removal: the least recently updated first.
    pub fn history(&self) -> impl Iterator<Item = (VoxelIndex, f64)> + '_ {
        self.voxels.in_order().map(|voxel| {
            let (block, place) = voxel.home();
            (super::place::cell_at(self.tree.block_index(block), place), voxel.log_odds)
        })
    }

    /// Returns the memory used in bytes, including the views of readers and some buffers.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + self.voxels.slab.bytes()
            + self.inflation.bytes()
            + self.frame.bytes()
            + self.sweep.bytes()
            + self.view.bytes()
    }
}

/// Stopwatch for consecutive stages.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}

/// Returns the points of a scan in place if possible, else copied to a buffer.
fn points_in_world<'p>(scan: &'p dyn ScanPoints, buffer: &'p mut Vec<Point>) -> Result<&'p [Point]> {
    if let Some(points) = scan.in_memory() {
        return Ok(points);
    }
    buffer.clear();
    scan.for_each_chunk(0..scan.len(), &mut |points, _| {
        buffer.extend_from_slice(points);
        true
    })?;
    Ok(buffer)
}

/// Checks that this many points fit as new voxels in addition to those stored.
fn check_room(stored: usize, points: usize) -> Result<()> {
    if stored.saturating_add(points) <= MAX_NUMBERED {
        return Ok(());
    }
    let reason = format!(
        "{points} points and the {stored} stored voxels may exceed the {MAX_NUMBERED} voxels of a local map; \
         limit the map (`LocalParameters::max_voxels`) or split the scan"
    );
    Err(Error::argument("points of the scan", reason))
}

/// Returns whether a voxel with these log-odds is removed. If the thresholds are equal, occupied wins.
pub(super) fn is_known_free(parameters: &LocalParameters, log_odds: f64) -> bool {
    log_odds <= parameters.free_log_odds && log_odds < parameters.occupied_log_odds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_that_may_exceed_the_capacity_are_refused() {
        assert!(check_room(0, MAX_NUMBERED).is_ok() && check_room(MAX_NUMBERED - 4000, 4000).is_ok());
        let error = check_room(MAX_NUMBERED - 4000, 4001).unwrap_err().to_string();
        assert!(error.contains("max_voxels") && error.contains("4001 points"), "{error}");
        assert!(check_room(1, usize::MAX).is_err());
    }
}
