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
    /// Tiles on disk for which updates wait.
    pub pending_tiles: u64,
    /// Updates of voxels that wait for their tiles.
    pub pending_updates: u64,
    /// Bytes of memory that these updates occupy.
    pub pending_bytes: u64,
    /// Bytes on disk in tables and octrees, the latest version of each tile.
    pub disk_bytes: u64,
    /// The work done for pointer trees since the map was opened.
    pub octrees: OctreeStatistics,
    /// What went to disk and came back.
    pub io: IoCounts,
}

/// What went to disk and came back since the map was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct IoCounts {
    /// Tiles read.
    pub loads: u64,
    /// Tiles written.
    pub saves: u64,
    /// Questions and updates that found their tile in memory.
    pub hits: u64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Bytes written.
    pub bytes_written: u64,
}
