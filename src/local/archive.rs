use super::map::{LocalMap, is_known_free};
use super::place::place_of;
use super::report::LocalReport;
use super::view::{LocalState, LocalView};
use super::voxels::{MOST_VOXELS, Voxel};
use crate::error::{Error, Result};
use crate::mapper::{MapView, Mapper};
use crate::query::{Occupancy, Questions};
use crate::scan::{Scan, ScanReport};
use crate::space::{Aabb, Point, VoxelIndex};

/// What a local map and an archive say of a place together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalAnswer {
    /// Occupied: in the local map, or in the archive where the local map has forgotten it.
    Occupied,
    /// Near to an occupied voxel of the local map.
    Inflated,
    /// Free by the archive, with the probability of being occupied.
    Free(f64),
    /// Never observed.
    Unknown,
}

impl LocalView {
    /// What the map says of a point, with free and unknown told apart by an archive.
    ///
    /// # Errors
    ///
    /// A tile of the archive that cannot be read.
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
    /// Takes voxels that are occupied in an archive and at most `radius_m` metres from `position`, where a robot has come
    /// back to a known place; returns how many were new.
    ///
    /// What scans have told the map stays as it is. The voxels of the archive count as older than all of that, the nearest
    /// as the youngest of them, and no more come than there is room for.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read, an archive of another resolution, a position without a voxel, a radius that is no
    /// length: the map stays as it was.
    pub fn prime(
        &mut self,
        archive: &(impl MapView + Sized),
        position: Point,
        radius_m: f64,
    ) -> Result<usize> {
        self.check_position(position)?;
        check_resolution(self.resolution_m(), archive)?;
        if !(radius_m >= 0.0 && radius_m.is_finite()) {
            return Err(Error::argument("radius", format!("{radius_m} m is not a length of at least 0")));
        }
        let found = self.occupied_around(archive, position, radius_m)?;
        self.position = Some(position);
        self.take_over_parameters(&mut LocalReport::default());
        let mut new = 0;
        for (_, voxel, log_odds) in found {
            if self.voxels.len() >= self.applied.max_voxels.unwrap_or(MOST_VOXELS).min(MOST_VOXELS) {
                break;
            }
            new += usize::from(self.add_oldest(voxel, log_odds));
        }
        self.inflate(position, &mut LocalReport::default());
        self.publish();
        Ok(new)
    }

    /// Squared distance, voxel and log-odds of the archive's occupied voxels in a ball, the nearest first.
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

    /// Adds a voxel at the beginning of the history, unless it is there already or free by the map's own thresholds.
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

/// An archive and a local map that one call feeds.
#[derive(Debug)]
pub struct WithLocalMap<M> {
    archive: M,
    local: LocalMap,
}

impl<M: Mapper> WithLocalMap<M> {
    /// Puts a local map beside an archive.
    ///
    /// # Errors
    ///
    /// Voxels of different sizes.
    pub fn new(archive: M, local: LocalMap) -> Result<Self> {
        check_resolution(local.resolution_m(), &archive)?;
        Ok(Self { archive, local })
    }

    /// Adds a scan to both.
    ///
    /// # Errors
    ///
    /// As for [`Mapper::insert_scan`] and [`LocalMap::insert_scan`]; then both are as before the call.
    pub fn insert_scan(&mut self, scan: &Scan) -> Result<(ScanReport, LocalReport)> {
        // All that the local map can refuse; then nothing but the archive can fail.
        self.local.check_scan(scan.origin, &scan.points)?;
        let report = self.archive.insert_scan(scan)?;
        Ok((report, self.local.insert_scan(scan)?))
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

    /// What the two say of a point together.
    ///
    /// # Errors
    ///
    /// A tile of the archive that cannot be read.
    pub fn answer_at(&self, point: Point) -> Result<LocalAnswer> {
        self.local.view().answer_at(point, &self.archive)
    }

    /// The archive.
    pub fn archive(&self) -> &M {
        &self.archive
    }

    /// The archive, to flush it or to add to it alone.
    pub fn archive_mut(&mut self) -> &mut M {
        &mut self.archive
    }

    /// The local map.
    pub fn local(&self) -> &LocalMap {
        &self.local
    }

    /// The local map, to change its parameters or to add to it alone.
    pub fn local_mut(&mut self) -> &mut LocalMap {
        &mut self.local
    }

    /// The two for themselves.
    pub fn into_parts(self) -> (M, LocalMap) {
        (self.archive, self.local)
    }
}

fn check_resolution(resolution_m: f64, archive: &impl MapView) -> Result<()> {
    let of_archive = archive.config().grid.resolution_m();
    if of_archive == resolution_m {
        return Ok(());
    }
    let reason = format!("{resolution_m} m, but the archive has {of_archive} m; take the same for both");
    Err(Error::argument("resolution of the local map", reason))
}
