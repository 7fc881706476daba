use crate::tile::{OctreeStatistics, TileCounts};
use serde::Serialize;

/// Sizes of a map and of what it holds in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct MapStatistics {
    /// Scans and batches in the map.
    pub scan_number: u64,
    /// Tiles in which something was observed.
    pub tiles: u64,
    /// Tiles in memory.
    pub cached_tiles: u64,
    /// Tiles in memory that are not on disk as they are.
    pub dirty_tiles: u64,
    /// Sizes of the tiles in memory.
    pub cached: TileCounts,
    /// Tiles with buffered updates.
    pub buffered_tiles: u64,
    /// Buffered updates of voxels.
    pub buffered_updates: u64,
    /// Bytes of memory that these updates occupy.
    pub buffered_bytes: u64,
    /// Bytes of such updates in files, because memory was short.
    pub spilled_bytes: u64,
    /// Tiles in memory in the compact form: not in use, and not counted above.
    pub compact_tiles: u64,
    /// Such tiles that are not on disk as they are.
    pub dirty_compact_tiles: u64,
    /// Bytes on disk in tables and octrees, the latest version of each tile.
    pub disk_bytes: u64,
    /// The work done for pointer trees since the map was opened.
    pub octrees: OctreeStatistics,
    /// What went to disk and came back.
    pub io: IoCounts,
    /// Bytes of memory, by what they hold.
    pub memory: MemoryCounts,
    /// Waits of the mapping thread for the disk since the map was opened.
    pub stalls: StallCounts,
}

/// Bytes of memory of all that grows with a map, by what they hold. They keep to the limit together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct MemoryCounts {
    /// Tiles ready for use: tables, octrees, voxel caches.
    pub tiles: u64,
    /// Tiles in the compact form.
    pub compact_tiles: u64,
    /// Buffered updates.
    pub write_buffer: u64,
    /// Kept free for inserting scans: what the largest so far took.
    pub scan: u64,
    /// Tiles on their way to and from disk.
    pub in_flight: u64,
    /// What is known of each tile without reading it.
    pub index: u64,
    /// What is kept for readers in other threads.
    pub readers: u64,
}

/// Waits of the mapping thread for the disk; times in microseconds, to two digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct StallCounts {
    /// How many.
    pub count: u64,
    /// Half of them took no longer than this.
    pub p50_us: u64,
    /// Of a hundred, 99 took no longer than this.
    pub p99_us: u64,
    /// The longest took this.
    pub worst_us: u64,
}

impl MemoryCounts {
    /// All together.
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

/// What went to disk and came back since the map was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct IoCounts {
    /// Tiles read.
    pub loads: u64,
    /// Tiles read ahead of use, of those read.
    pub prefetches: u64,
    /// Tiles written.
    pub saves: u64,
    /// Tiles that were brought into the compact form.
    pub encoded: u64,
    /// Tiles that came back from the compact form.
    pub decoded: u64,
    /// Queries and updates that found their tile in memory.
    pub hits: u64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Bytes written, spilled updates included.
    pub bytes_written: u64,
}
