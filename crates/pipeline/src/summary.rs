use crate::memory;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use voxtile::OctreeConfig;
use voxtile::mapper::{IoCounts, MapReader, MapView, MemoryCounts, StallCounts};
use voxtile::scan::ScanReport;
use voxtile::space::{Grid, TileBox};
use voxtile::tile::{OctreeStatistics, TileCounts};

/// What a build did, and what the map now is.
#[derive(Debug, Serialize)]
pub struct Summary {
    /// Folder of the map.
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub map: PathBuf,
    /// Scans that were inserted.
    pub scans: u64,
    /// Scans of the same input that were in the map before.
    pub resumed_after: u64,
    /// Whether it was asked to stop before the end of the input.
    pub interrupted: bool,
    /// Where the poses come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<String>,
    /// The tiles that are mapped; missing where that is all of space.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_tiles: Option<TileBox>,
    /// The scans that were skipped, with the reason of each.
    #[serde(rename = "unread_scans")]
    pub unread: Vec<String>,
    /// How many scans were left out because they came faster than they could be mapped.
    #[serde(rename = "left_out_scans")]
    pub left_out: u64,
    /// What a person should know beside.
    pub remarks: Vec<String>,
    /// Voxels and tiles.
    #[serde(skip)]
    pub grid: Grid,
    /// What was done with points and rays.
    #[serde(flatten)]
    pub report: ScanReport,
    /// Number of the last scan in the map.
    pub scan_number: u64,
    /// Observed voxels of the map.
    pub voxels: u64,
    /// Those that are occupied.
    pub occupied: u64,
    /// Tiles of the map.
    pub tiles: u64,
    /// Those in memory at the end.
    pub cached_tiles: u64,
    /// Sizes of the tiles in memory at the end.
    pub cached: TileCounts,
    /// The work for pointer octrees; missing where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub octrees: Option<OctreeWork>,
    /// Bytes of the map on disk.
    pub disk_bytes: u64,
    /// Tiles that were read.
    pub loads: u64,
    /// Tiles that were written.
    pub saves: u64,
    /// What went to disk and came back.
    pub io: IoCounts,
    /// Waits for the disk.
    pub stalls: StallCounts,
    /// Bytes of memory at the end, by what they hold.
    pub memory: MemoryCounts,
    /// Wall time.
    pub seconds: f64,
    /// Largest resident memory of the process.
    pub peak_rss_bytes: Option<u64>,
}

/// What was done for pointer octrees, from the start to the last flush.
#[derive(Debug, Serialize)]
pub struct OctreeWork {
    /// Hits of the voxel caches among all updates; missing where there are no caches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hit_rate: Option<f64>,
    /// The counts.
    #[serde(flatten)]
    pub statistics: OctreeStatistics,
}

impl Summary {
    /// The summary of `scans` inserted into a map that has been flushed.
    ///
    /// # Errors
    ///
    /// A map that cannot be opened.
    pub fn of(
        map: &Path,
        scans: u64,
        report: ScanReport,
        mapper: &impl MapView,
        elapsed: Duration,
    ) -> voxtile::Result<Self> {
        let reader = MapReader::open(map, 0)?;
        let (voxels, occupied) = reader.voxel_counts().unwrap_or_default();
        let statistics = mapper.statistics();
        Ok(Self {
            map: map.to_owned(),
            scans,
            resumed_after: 0,
            interrupted: false,
            poses: None,
            region_tiles: mapper.config().rays.region,
            unread: Vec::new(),
            left_out: 0,
            remarks: Vec::new(),
            grid: mapper.config().grid,
            report,
            scan_number: reader.scan_number(),
            voxels,
            occupied,
            tiles: statistics.tiles,
            cached_tiles: statistics.cached_tiles,
            cached: statistics.cached,
            octrees: OctreeWork::of(mapper),
            disk_bytes: statistics.disk_bytes,
            loads: statistics.io.loads,
            saves: statistics.io.saves,
            io: statistics.io,
            stalls: statistics.stalls,
            memory: statistics.memory,
            seconds: elapsed.as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        })
    }
}

impl OctreeWork {
    fn of(mapper: &impl MapView) -> Option<Self> {
        let OctreeConfig::Pointers(cache) = mapper.config().octree else { return None };
        let statistics = mapper.statistics().octrees;
        let hit_rate = cache.cache().map(|_| statistics.voxel_cache.hit_rate());
        Some(Self { hit_rate, statistics })
    }
}
