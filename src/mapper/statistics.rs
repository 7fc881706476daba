use crate::tile::{OctreeStatistics, TileCounts};
use serde::Serialize;

/// Size of a map and of its content in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct MapStatistics {
    /// Number of scans and batches in the map.
    pub scan_number: u64,
    /// Tiles that contain observations.
    pub tiles: u64,
    /// Tiles in memory.
    pub cached_tiles: u64,
    /// Tiles in memory that differ from their version on disk.
    pub dirty_tiles: u64,
    /// Sizes of the tiles in memory.
    pub cached: TileCounts,
    /// Tiles with buffered updates.
    pub buffered_tiles: u64,
    /// Buffered updates of voxels.
    pub buffered_updates: u64,
    /// Bytes of memory of the buffered updates.
    pub buffered_bytes: u64,
    /// Bytes of buffered updates in spill files.
    pub spilled_bytes: u64,
    /// Tiles in memory in the compact form, which is compressed; not included in the counts above.
    pub compact_tiles: u64,
    /// Tiles in the compact form that differ from their version on disk.
    pub dirty_compact_tiles: u64,
    /// Bytes on disk of the tables and octrees of the latest version of each tile.
    pub disk_bytes: u64,
    /// Work on pointer trees since the map was opened.
    pub octrees: OctreeStatistics,
    /// Disk reads and writes.
    pub io: IoCounts,
    /// Bytes of memory, by purpose.
    pub memory: MemoryCounts,
    /// Waits of the mapping thread for the disk since the map was opened.
    pub stalls: StallCounts,
}

/// Bytes of memory of all data that grow with a map, by purpose. The limit applies to their sum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct MemoryCounts {
    /// Tiles ready for use: tables, octrees, voxel caches.
    pub tiles: u64,
    /// Tiles in the compact form.
    pub compact_tiles: u64,
    /// Buffered updates.
    pub write_buffer: u64,
    /// Reserved for inserting scans: the most that a scan has needed so far.
    pub scan: u64,
    /// Tiles that are being read from or written to disk.
    pub in_flight: u64,
    /// Index of tiles.
    pub index: u64,
    /// Data kept for readers in other threads.
    pub readers: u64,
}

/// Times that the mapping thread waited for the disk, in microseconds, to two significant digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct StallCounts {
    /// Number of waits.
    pub count: u64,
    /// Median.
    pub p50_us: u64,
    /// 99th percentile.
    pub p99_us: u64,
    /// Maximum.
    pub worst_us: u64,
}

impl MemoryCounts {
    /// Sum over all purposes.
    pub fn bytes(&self) -> u64 {
        self.tiles
            + self.compact_tiles
            + self.write_buffer
            + self.scan
            + self.in_flight
            + self.index
            + self.readers
    }
}

/// Disk reads and writes since the map was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct IoCounts {
    /// Tiles read.
    pub loads: u64,
    /// Tiles read ahead of use; `loads` includes them.
    pub prefetches: u64,
    /// Tiles written.
    pub saves: u64,
    /// Tiles encoded into the compact form in memory.
    pub encoded: u64,
    /// Tiles decoded from the compact form in memory.
    pub decoded: u64,
    /// Queries and updates that found their tile in memory.
    pub hits: u64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Bytes written, including spilled updates.
    pub bytes_written: u64,
}
