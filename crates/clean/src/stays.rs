use crate::neighborhood::HitVoxels;
use crate::search::cache_bytes;
use tempfile::TempDir;
use voxtile::scan::PointBatch;
use voxtile::{
    Error, MapConfig, MapQueries, MapReader, Mapper, MemoryLimit, OutOfCoreTileMapper, Queries, Result,
};

/// Number of scans that hit each voxel that was seen through: in a temporary map beside the map, so that it may exceed
/// memory.
#[derive(Debug)]
pub(crate) struct StayCounter {
    /// Removed after the mapper is closed: fields are dropped in order.
    counts: OutOfCoreTileMapper,
    folder: TempDir,
}

/// Finished counts.
#[derive(Debug)]
pub(crate) struct Stays {
    counts: MapReader,
    min_scans: u32,
    _folder: TempDir,
}

impl StayCounter {
    /// Creates an empty counter with the grid of a map.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn beside(map: &MapReader, memory: MemoryLimit) -> Result<Self> {
        // The path of the map may be relative, such as `..`, or a link.
        let real = map.folder().canonicalize().map_err(|error| Error::io(map.folder(), "find", error))?;
        let parent = real.parent().unwrap_or(&real);
        let folder = tempfile::Builder::new().prefix(".voxtile-clean-").tempdir_in(parent);
        let folder = folder.map_err(|error| Error::io(parent, "create a temporary folder in", error))?;
        let grid = map.grid();
        let config = MapConfig::new(grid.resolution_m(), grid.tile_size_m())?;
        let config = config.with_memory_bytes(cache_bytes(memory).max(MemoryLimit::min_bytes(&grid)));
        Ok(Self { counts: OutOfCoreTileMapper::create(folder.path().join("counts"), config)?, folder })
    }

    /// Counts a scan in each of its voxels that was seen through.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn add(&mut self, voxels: &HitVoxels) -> Result<()> {
        let grid = self.counts.grid();
        let points: Vec<_> = voxels.iter_seen_through().map(|voxel| grid.center_m(voxel)).collect();
        let is_occupied = vec![true; points.len()];
        self.counts.batch_update(&PointBatch {
            points: &points,
            intensities: None,
            is_occupied: &is_occupied,
        })?;
        Ok(())
    }

    /// Ends the count. A thing stays if at least `min_scans` scans hit it in the same voxel.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn finish(mut self, min_scans: u32, memory: MemoryLimit) -> Result<Stays> {
        self.counts.flush()?;
        drop(self.counts);
        let counts = MapReader::open(self.folder.path().join("counts"), cache_bytes(memory) / 2)?;
        Ok(Stays { counts, min_scans, _folder: self.folder })
    }
}

impl Stays {
    /// Clears the record that voxels were seen through where something stayed.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub(crate) fn keep_in(&self, voxels: &mut HitVoxels) -> Result<()> {
        let grid = self.counts.grid();
        let all: Vec<_> = voxels.iter_seen_through().collect();
        let centers: Vec<_> = all.iter().map(|&voxel| grid.center_m(voxel)).collect();
        for (&voxel, evidence) in all.iter().zip(self.counts.evidence_at_points(&centers)?) {
            let scans = evidence.map_or(0, |evidence| evidence.observation_count);
            if i64::from(scans) >= i64::from(self.min_scans) {
                voxels.clear_seen_through(voxel);
            }
        }
        Ok(())
    }
}
