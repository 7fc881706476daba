use crate::neighborhood::HitVoxels;
use crate::temporary_map;
use voxtile::scan::PointBatch;
use voxtile::space::{Grid, VoxelIndex};
use voxtile::store::StagedMap;
use voxtile::{MapConfig, MapQueries, MapReader, Mapper, MemoryLimit, OutOfCoreTileMapper, Queries, Result};

/// Edge of a tile of counts in voxels.
const VOXELS_PER_EDGE: u32 = 32;

/// Number of scans that hit each voxel that was seen through, in a temporary map so that it may exceed memory.
#[derive(Debug)]
pub(crate) struct StayCounter {
    counts: StagedMap<OutOfCoreTileMapper>,
}

/// Finished counts.
#[derive(Debug)]
pub(crate) struct Stays {
    counts: Counts,
    min_scans: u32,
}

#[derive(Debug)]
enum Counts {
    Own(Box<StagedMap<OutOfCoreTileMapper>>),
    OfParts(Box<MapReader>),
}

impl StayCounter {
    /// Creates an empty counter with the voxels of a map.
    ///
    /// # Errors
    ///
    /// A running search of this map, or an I/O error.
    pub(crate) fn begin(map: &MapReader, memory_bytes: usize) -> Result<Self> {
        // Small tiles need little memory.
        let resolution_m = map.grid().resolution_m();
        let config = MapConfig::new(resolution_m, f64::from(VOXELS_PER_EDGE) * resolution_m)?;
        let memory_bytes = memory_bytes.max(MemoryLimit::min_bytes(&config.grid));
        Ok(Self { counts: temporary_map::begin(map, "counts", config.with_memory_bytes(memory_bytes))? })
    }

    /// Counts a scan in each of its voxels that was seen through.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn add(&mut self, voxels: &HitVoxels) -> Result<()> {
        count_in(self.counts.writer(), voxels)
    }

    /// Ends the count. A thing stays if at least `min_scans` scans hit it in the same voxel.
    pub(crate) fn finish(self, min_scans: u32) -> Stays {
        Stays { counts: Counts::Own(Box::new(self.counts)), min_scans }
    }
}

/// Counts a scan in each of its voxels that was seen through.
///
/// # Errors
///
/// An I/O error.
pub(crate) fn count_in(counts: &mut OutOfCoreTileMapper, voxels: &HitVoxels) -> Result<()> {
    let grid = counts.grid();
    let points: Vec<_> = voxels.iter_seen_through().map(|voxel| grid.center_m(voxel)).collect();
    let is_occupied = vec![true; points.len()];
    counts.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &is_occupied })?;
    Ok(())
}

impl Stays {
    /// Counts that [`count_in`] has made in a map.
    pub(crate) fn of(counts: MapReader, min_scans: u32) -> Self {
        Self { counts: Counts::OfParts(Box::new(counts)), min_scans }
    }

    /// Clears the record that voxels were seen through where something stayed.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn keep_in(&self, voxels: &mut HitVoxels) -> Result<()> {
        let all: Vec<VoxelIndex> = voxels.iter_seen_through().collect();
        let centers = |grid: Grid| all.iter().map(|&voxel| grid.center_m(voxel)).collect::<Vec<_>>();
        let found = match &self.counts {
            Counts::Own(counts) => counts.get().evidence_at_points(&centers(counts.get().grid()))?,
            Counts::OfParts(counts) => counts.evidence_at_points(&centers(counts.grid()))?,
        };
        for (&voxel, evidence) in all.iter().zip(found) {
            let scans = evidence.map_or(0, |evidence| evidence.observation_count);
            if i64::from(scans) >= i64::from(self.min_scans) {
                voxels.clear_seen_through(voxel);
            }
        }
        Ok(())
    }
}
