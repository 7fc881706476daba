use super::map::{LocalMap, is_known_free};
use super::place::place_of;
use super::report::LocalReport;
use super::view::{LocalState, LocalView};
use super::voxels::{MAX_NUMBERED, Voxel};
use voxtile::mapper::{MapView, Mapper};
use voxtile::query::{MapQueries, Occupancy, Queries};
use voxtile::scan::{Scan, ScanPoints, ScanReport};
use voxtile::space::{Aabb, Point, VoxelIndex};
use voxtile::{Error, Result};

/// Combined answer of a local map and an archive, which is a map of all scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalAnswer {
    /// Occupied in the local map, or in the archive if the local map has removed the voxel.
    Occupied,
    /// Within the inflation radius of an occupied voxel of the local map.
    Inflated,
    /// Free in the archive; the value is the probability of being occupied.
    Free(f64),
    /// Never observed.
    Unknown,
}

impl LocalView {
    /// Returns the state of a point. The archive distinguishes free from unknown.
    ///
    /// # Errors
    ///
    /// If a tile of the archive cannot be read.
    pub fn answer_at(&self, point: Point, archive: &(impl MapView + Sized)) -> Result<LocalAnswer> {
        Ok(match self.state_at(point) {
            LocalState::Occupied => LocalAnswer::Occupied,
            LocalState::Inflated => LocalAnswer::Inflated,
            LocalState::None => match archive.occupancy_at(point)? {
                Occupancy::Occupied(_) => LocalAnswer::Occupied,
                Occupancy::Free(probability) => LocalAnswer::Free(probability),
                Occupancy::Unknown => LocalAnswer::Unknown,
            },
        })
    }
}

impl LocalMap {
    /// Copies the occupied voxels of an archive within `radius_m` metres of `position`, for a robot that returns to a
    /// known place. Returns the number of new voxels.
    ///
    /// Existing voxels keep their evidence. Copied voxels are placed before all existing voxels in the history, so they
    /// are removed first, the farthest before the nearest. The limit on voxels applies.
    ///
    /// # Errors
    ///
    /// If a tile cannot be read, the resolutions differ, the position is not finite or outside of the range of voxel
    /// indices, or the radius is invalid. The map is then unchanged.
    pub fn prime(
        &mut self,
        archive: &(impl MapView + Sized),
        position: Point,
        radius_m: f64,
    ) -> Result<usize> {
        self.check_position(position)?;
        check_resolution(self.resolution_m(), archive)?;
        if !(radius_m >= 0.0 && radius_m.is_finite()) {
            return Err(Error::argument("radius", format!("must be at least 0 m, but is {radius_m} m")));
        }
        let found = self.occupied_around(archive, position, radius_m)?;
        self.position = Some(position);
        self.apply_parameters(&mut LocalReport::default());
        let mut new = 0;
        for (_, voxel, log_odds) in found {
            if self.voxels.len() >= self.applied.max_voxels.unwrap_or(MAX_NUMBERED).min(MAX_NUMBERED) {
                break;
            }
            new += usize::from(self.add_oldest(voxel, log_odds));
        }
        self.inflate(position, &mut LocalReport::default());
        self.publish();
        Ok(new)
    }

    /// Returns the squared distance, index and log-odds of the archive's occupied voxels in a ball, nearest first.
    fn occupied_around(
        &self,
        archive: &(impl MapView + Sized),
        position: Point,
        radius_m: f64,
    ) -> Result<Vec<(f64, VoxelIndex, f64)>> {
        let mut found = Vec::new();
        let around = Aabb { min: position.map(|x| x - radius_m), max: position.map(|x| x + radius_m) };
        archive.for_each_occupied(None, Some(&around), |voxel| {
            let center_m = self.grid.center_m(voxel.index);
            let squared = (0..3).map(|k| (center_m[k] - position[k]).powi(2)).sum::<f64>();
            if squared <= radius_m * radius_m && self.voxel_of(center_m).is_some() {
                found.push((squared, voxel.index, voxel.evidence.log_odds));
            }
        })?;
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        Ok(found)
    }

    /// Adds a voxel at the start of the history. Returns `false` if the map already has the voxel, or if the thresholds
    /// of the map classify it as free.
    fn add_oldest(&mut self, voxel: VoxelIndex, log_odds: f64) -> bool {
        let limits = self.applied.log_odds;
        let log_odds = log_odds.clamp(limits.min, limits.max);
        if is_known_free(&self.applied, log_odds) {
            return false;
        }
        let block = self.tree.make_block(voxel.map(|k| k >> 2), self.inflation.rules.current());
        let place = place_of(voxel);
        if self.tree.blocks.get(block).voxels.mask >> place & 1 != 0 {
            return false;
        }
        let id = self.voxels.slab.insert(Voxel::new(block, place, log_odds));
        self.tree.store(block, place, id);
        self.voxels.push_oldest(id);
        if self.tree.set_occupied(block, place, log_odds >= self.applied.occupied_log_odds) {
            self.inflation.wait(&mut self.tree, block);
        }
        true
    }
}

/// Archive (a map of all scans) and local map that are updated with the same scans.
#[derive(Debug)]
pub struct WithLocalMap<M> {
    archive: M,
    local: LocalMap,
}

impl<M: Mapper> WithLocalMap<M> {
    /// Combines a local map with an archive.
    ///
    /// # Errors
    ///
    /// If the resolutions differ.
    pub fn new(archive: M, local: LocalMap) -> Result<Self> {
        check_resolution(local.resolution_m(), &archive)?;
        Ok(Self { archive, local })
    }

    /// Inserts a scan into both.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::insert_points`] and [`LocalMap::insert_points`]. Both maps are then unchanged.
    pub fn insert_points(&mut self, scan: &dyn ScanPoints) -> Result<(ScanReport, LocalReport)> {
        let Self { archive, local } = self;
        // The local map runs all its checks first, so only the archive can fail from here on.
        let (local_report, report) = local.insert_after(scan, || archive.insert_points(scan))?;
        Ok((report, local_report))
    }

    /// [`WithLocalMap::insert_points`] for a [`Scan`].
    ///
    /// # Errors
    ///
    /// As for [`WithLocalMap::insert_points`].
    pub fn insert_scan(&mut self, scan: &Scan) -> Result<(ScanReport, LocalReport)> {
        self.insert_points(scan)
    }

    /// Primes the local map from the archive; see [`LocalMap::prime`].
    ///
    /// # Errors
    ///
    /// As for [`LocalMap::prime`].
    pub fn prime(&mut self, position: Point, radius_m: f64) -> Result<usize>
    where
        M: Sized,
    {
        self.local.prime(&self.archive, position, radius_m)
    }

    /// Returns the combined answer for a point.
    ///
    /// # Errors
    ///
    /// If a tile of the archive cannot be read.
    pub fn answer_at(&self, point: Point) -> Result<LocalAnswer> {
        self.local.view().answer_at(point, &self.archive)
    }

    /// Returns the archive.
    pub fn archive(&self) -> &M {
        &self.archive
    }

    /// Returns the archive, mutably: to flush it or to update it alone.
    pub fn archive_mut(&mut self) -> &mut M {
        &mut self.archive
    }

    /// Returns the local map.
    pub fn local(&self) -> &LocalMap {
        &self.local
    }

    /// Returns the local map, mutably: to change its parameters or to update it alone.
    pub fn local_mut(&mut self) -> &mut LocalMap {
        &mut self.local
    }

    /// Returns the archive and the local map.
    pub fn into_parts(self) -> (M, LocalMap) {
        (self.archive, self.local)
    }
}

fn check_resolution(resolution_m: f64, archive: &impl MapView) -> Result<()> {
    let of_archive = archive.config().grid.resolution_m();
    if of_archive == resolution_m {
        return Ok(());
    }
    let reason =
        format!("{resolution_m} m, but the archive has {of_archive} m; use the same resolution for both");
    Err(Error::argument("resolution of the local map", reason))
}
