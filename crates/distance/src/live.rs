use crate::cap::Cap;
use crate::extent::Extent;
use crate::field::DistanceField;
use crate::line::Line;
use crate::live_observed::LiveObserved;
use crate::options::DistanceOptions;
use crate::solve::Solver;
use parking_lot::RwLock;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::query::occupied_set::OccupiedSet;
use voxtile::{Error, Grid, Point, Result};

/// Distance field of a box around a robot, updated after each scan by what changed.
///
/// The field equals [`MapDistances::distance_field`](crate::MapDistances::distance_field) of the same box and map to the
/// last bit. Readers in other threads see the last complete field and never wait for an update.
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan};
/// use voxtile_distance::{DistanceOptions, LiveDistances, UnknownRule};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.2, 10.0)?)?;
/// let options = DistanceOptions::new(2.0).with_unknown(UnknownRule::Free);
/// let mut live = LiveDistances::new([40.0, 40.0, 8.0], options)?;
/// let reader = live.reader(); // For the planner's thread.
/// map.insert_scan(&Scan { points: vec![[4.1, 0.1, 0.1]], ..Scan::default() })?;
/// live.update(&map, [0.0; 3])?; // With a mapper on disk: `&mapper.reader()?.view()`.
/// let field = reader.field().expect("an update");
/// assert_eq!(field.voxel([15, 0, 0]).squared_voxels(), Some(25));
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct LiveDistances {
    size_m: [f64; 3],
    options: DistanceOptions,
    state: Option<State>,
    /// Memory of an earlier field, for the next one.
    spare: Vec<Line>,
    reader: DistanceReader,
}

/// Handle for the threads that use the field.
#[derive(Clone, Debug, Default)]
pub struct DistanceReader(Arc<RwLock<Option<Arc<DistanceField>>>>);

impl DistanceReader {
    /// Returns the last complete field; `None` before the first update. It never changes: take the next one for the
    /// next decision.
    pub fn field(&self) -> Option<Arc<DistanceField>> {
        // The lock is only held to copy or to replace the pointer.
        self.0.read().clone()
    }

    /// Replaces the field. Returns the memory of the earlier one, unless a reader still uses it.
    fn set(&self, field: DistanceField) -> Vec<Line> {
        let before = self.0.write().replace(Arc::new(field));
        // Freed after the lock is released, if at all.
        before.and_then(Arc::into_inner).map(DistanceField::into_lines).unwrap_or_default()
    }
}

/// Result of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct DistanceUpdate {
    /// Whether the box is new or has moved, so that all of it was computed.
    pub has_moved: bool,
    /// Number of rows along x whose obstacles changed, in the box and its surroundings within the cap.
    pub changed_rows: usize,
}

/// Voxels that the robot may be away from the center of the box along an axis before the box moves.
const SLACK_VOXELS: i64 = 16;

/// State of one box.
#[derive(Debug)]
struct State {
    grid: Grid,
    extent: Extent,
    live: LiveObserved,
    solver: Solver,
    is_new: bool,
}

impl LiveDistances {
    /// Creates a field for a box of `size_m` along x, y and z around the robot.
    ///
    /// # Errors
    ///
    /// Fails if a length is not positive and finite. The first update checks the cap, because it depends on the
    /// resolution of the map.
    pub fn new(size_m: [f64; 3], options: DistanceOptions) -> Result<Self> {
        if !size_m.iter().all(|&edge_m| edge_m > 0.0 && edge_m.is_finite()) {
            let reason = format!("{size_m:?} m; the edges of the box must be positive and finite");
            return Err(Error::argument("size", reason));
        }
        Ok(Self { size_m, options, state: None, spare: Vec::new(), reader: DistanceReader::default() })
    }

    /// Returns a handle for other threads.
    pub fn reader(&self) -> DistanceReader {
        self.reader.clone()
    }

    /// The last complete field; `None` before the first update.
    pub fn field(&self) -> Option<Arc<DistanceField>> {
        self.reader.field()
    }

    /// Updates the field to a map, such as an [`InMemoryMapper`](voxtile::InMemoryMapper) or the view of a
    /// [`LiveReader`](voxtile::LiveReader). The box moves when the robot is more than 16 voxels away from its center.
    ///
    /// # Errors
    ///
    /// Fails if the cap is invalid for the map, the box is too large, the position is outside of the map's space, or a
    /// tile cannot be read. Readers then keep the last field, and the call can be repeated.
    pub fn update(&mut self, map: &impl MapView, robot_m: Point) -> Result<DistanceUpdate> {
        self.update_with(map.config().grid, robot_m, |live| live.look_at_map(map))
    }

    /// As [`LiveDistances::update`], for a set of occupied voxels such as the obstacles of a local map. All other voxels
    /// are unknown: use [`UnknownRule::Free`](crate::UnknownRule).
    ///
    /// # Errors
    ///
    /// As for [`LiveDistances::update`].
    pub fn update_from_set(&mut self, set: &impl OccupiedSet, robot_m: Point) -> Result<DistanceUpdate> {
        self.update_with(set.grid_of_set(), robot_m, |live| {
            live.look_at_set(set);
            Ok(())
        })
    }

    fn update_with(
        &mut self,
        grid: Grid,
        robot_m: Point,
        look: impl FnOnce(&mut LiveObserved) -> Result<()>,
    ) -> Result<DistanceUpdate> {
        let extent = self.place(&grid, robot_m)?;
        let state = match &mut self.state {
            Some(state) if state.grid == grid && state.extent == extent => state,
            state => state.insert(State::new(grid, extent, self.options)?),
        };
        look(&mut state.live)?;
        let changed_rows = state.live.changed_rows().iter().filter(|changed| **changed).count();
        let update = DistanceUpdate { has_moved: state.is_new, changed_rows };
        if !state.is_new && !state.live.has_changes() {
            return Ok(update);
        }
        match state.is_new {
            true => state.solver.compute(&state.live.observed),
            false => state.solver.update(&state.live.observed, state.live.changed_rows()),
        }
        state.is_new = false;
        state.live.forget_changes();
        let mut lines = std::mem::take(&mut self.spare);
        state.solver.copy_distances(&state.live.observed, &mut lines);
        self.spare = self.reader.set(DistanceField::of_lines(grid, self.options, extent, lines));
        Ok(update)
    }

    /// Returns the box for a position of the robot: the last one if the robot is near its center.
    fn place(&self, grid: &Grid, robot_m: Point) -> Result<Extent> {
        let Some(robot) = grid.voxel_of(robot_m) else {
            return Err(Error::argument("robot", format!("{robot_m:?} m is outside of the map's space")));
        };
        let size = self.size_m.map(|edge_m| (edge_m / grid.resolution_m()).round().max(1.0) as usize);
        let half = |k: usize| size[k] as i64 / 2;
        if let Some(State { grid: last, extent, .. }) = &self.state
            && last == grid
            && (0..3).all(|k| (i64::from(robot[k]) - extent.min[k] - half(k)).abs() <= SLACK_VOXELS)
        {
            return Ok(*extent);
        }
        Ok(Extent { min: std::array::from_fn(|k| i64::from(robot[k]) - half(k)), size })
    }
}

impl State {
    fn new(grid: Grid, extent: Extent, options: DistanceOptions) -> Result<Self> {
        let cap = Cap::of(options.max_distance_m, grid.resolution_m())?;
        extent.check_size()?;
        let around = extent.grown(cap.reach);
        around.check_size()?;
        let (live, solver) = (LiveObserved::new(around, &options), Solver::new(extent, cap, options));
        Ok(Self { grid, extent, live, solver, is_new: true })
    }
}
