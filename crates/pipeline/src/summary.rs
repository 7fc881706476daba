use crate::memory;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::time::Duration;
use voxtile::OctreeConfig;
use voxtile::mapper::{IoCounts, MapReader, MapView, MemoryCounts, StallCounts};
use voxtile::scan::ScanReport;
use voxtile::space::{Grid, TileBox};
use voxtile::tile::{OctreeStatistics, TileCounts};

/// Result of a build, and the state of the map.
#[derive(Debug, Serialize)]
pub struct Summary {
    /// Folder of the map.
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub map: PathBuf,
    /// Number of scans inserted.
    pub scans: u64,
    /// Number of scans of this input that the map already had.
    pub resumed_after: u64,
    /// Whether the build was stopped before the end of the input.
    pub interrupted: bool,
    /// Origin of the poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<String>,
    /// Mapped tiles; missing if there is no region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_tiles: Option<TileBox>,
    /// Skipped scans with the reasons.
    #[serde(rename = "unread_scans")]
    pub unread: Vec<String>,
    /// Number of scans dropped because they arrived faster than they could be inserted.
    #[serde(rename = "left_out_scans")]
    pub left_out: u64,
    /// Further remarks for the user.
    pub remarks: Vec<String>,
    /// Grid of voxels and tiles; serialized as `resolution_m` and `tile_size_m`.
    #[serde(flatten, serialize_with = "lengths")]
    pub grid: Grid,
    /// Statistics of points and rays.
    #[serde(flatten)]
    pub report: ScanReport,
    /// Number of the last scan in the map.
    pub scan_number: u64,
    /// Number of observed voxels in the map.
    pub voxels: u64,
    /// Number of occupied voxels.
    pub occupied: u64,
    /// Number of tiles in the map.
    pub tiles: u64,
    /// Number of tiles in memory at the end.
    pub cached_tiles: u64,
    /// Sizes of the tiles in memory at the end.
    pub cached: TileCounts,
    /// Statistics of pointer octrees; missing if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub octrees: Option<OctreeWork>,
    /// Size of the map on disk, in bytes.
    pub disk_bytes: u64,
    /// Number of tiles read.
    pub loads: u64,
    /// Number of tiles written.
    pub saves: u64,
    /// Disk reads and writes.
    pub io: IoCounts,
    /// Waits for the disk.
    pub stalls: StallCounts,
    /// Memory use at the end in bytes, by purpose.
    pub memory: MemoryCounts,
    /// Wall time.
    pub seconds: f64,
    /// Peak resident memory of the process.
    pub peak_rss_bytes: Option<u64>,
}

fn lengths<S: Serializer>(grid: &Grid, serializer: S) -> Result<S::Ok, S::Error> {
    let mut lengths = serializer.serialize_map(Some(2))?;
    lengths.serialize_entry("resolution_m", &grid.resolution_m())?;
    lengths.serialize_entry("tile_size_m", &grid.tile_size_m())?;
    lengths.end()
}

/// Statistics of pointer octrees, from the start to the last flush.
#[derive(Debug, Serialize)]
pub struct OctreeWork {
    /// Fraction of updates that hit the voxel caches; missing if there are no caches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hit_rate: Option<f64>,
    /// Counters of the octrees.
    #[serde(flatten)]
    pub statistics: OctreeStatistics,
}

impl Summary {
    /// Creates the summary after `scans` were inserted and the map was flushed.
    ///
    /// # Errors
    ///
    /// The map cannot be opened.
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

impl Summary {
    /// Returns the summary of two runs of one command. Sizes and states are those of the later one.
    pub(crate) fn after(mut self, earlier: Self) -> Self {
        self.scans += earlier.scans;
        self.resumed_after += earlier.resumed_after;
        self.left_out += earlier.left_out;
        self.report += earlier.report;
        self.loads += earlier.loads;
        self.saves += earlier.saves;
        let (io, before) = (&mut self.io, earlier.io);
        io.loads += before.loads;
        io.prefetches += before.prefetches;
        io.saves += before.saves;
        io.encoded += before.encoded;
        io.decoded += before.decoded;
        io.hits += before.hits;
        io.bytes_read += before.bytes_read;
        io.bytes_written += before.bytes_written;
        // Percentiles of both cannot be computed: those of the run that waited more are reported.
        let stalls = [earlier.stalls, self.stalls];
        let most = if stalls[0].count > stalls[1].count { stalls[0] } else { stalls[1] };
        self.stalls = most;
        self.stalls.count = stalls[0].count + stalls[1].count;
        self.stalls.worst_us = stalls[0].worst_us.max(stalls[1].worst_us);
        self.poses = match (earlier.poses, self.poses) {
            (Some(first), Some(next)) if !first.split(", ").any(|known| known == next) => {
                Some(format!("{first}, {next}"))
            }
            (first, next) => first.or(next),
        };
        self.unread.splice(0..0, earlier.unread);
        self.remarks.splice(0..0, earlier.remarks);
        self
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
