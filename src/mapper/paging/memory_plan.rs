use crate::config::{MapConfig, MemoryLimit};
use crate::space::BRICK_EDGE;

/// Division of a mapper's memory limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mapper) struct MemoryPlan {
    /// Maximum number of resident tiles.
    pub(super) tiles: usize,
    /// Limit for all data that grow with the map, in bytes.
    pub(super) bytes: usize,
    /// Maximum bytes of buffered updates while the index is empty; see [`MemoryPlan::buffer_bytes`].
    buffer_bytes: usize,
    /// Maximum bytes for tracing a scan.
    pub(in crate::mapper) scan_bytes: usize,
    /// Maximum bytes of packed updates of a scan; the rest is spilled to files.
    pub(in crate::mapper) updates_bytes: usize,
    /// Bytes that are reserved for inserting scans from the beginning.
    pub(super) min_scan_bytes: usize,
    /// Whether the limit is enforced: memory of a scan counts, and a map whose index does not fit is rejected. False
    /// only for [`MemoryLimit::Tight`], which tests use.
    pub(super) is_enforced: bool,
    /// Bytes that prefetched tiles must leave free.
    pub(super) spare_bytes: usize,
    /// A tile counts as changed often if updates of at least this many scans are buffered for it.
    pub(super) often_scans: u32,
    /// Maximum bytes of tiles in the compact form while the index is empty; see [`MemoryPlan::compact_bytes`].
    compact_bytes: usize,
    index_bytes: usize,
    /// Maximum bytes of tiles that readers in other threads cache.
    pub(in crate::mapper) reader_bytes: usize,
    /// Maximum bytes of old tile states that are kept for open views.
    pub(super) view_bytes: usize,
    /// Maximum bytes of the lists of a background flush.
    pub(super) flush_list_bytes: usize,
}

const OFTEN_SCANS: u32 = 8;

/// If tiles are smaller than a brick, the limit is reduced by one part in this number to allow for fragmentation by the
/// allocator: hundreds of thousands of blocks of a few hundred bytes are allocated and freed. Measured: up to 3 MiB over
/// a limit of 81 MiB.
const FRAGMENTATION_PART: usize = 12;

impl MemoryPlan {
    pub(in crate::mapper) fn of(config: &MapConfig) -> Self {
        let has_tiny_tiles = config.grid.voxels_per_tile_edge() < BRICK_EDGE;
        match (config.memory, config.memory_bytes()) {
            // For tests: the limit is below the smallest that works, so it is not enforced.
            (MemoryLimit::Tight(bytes), _) => {
                let (is_enforced, min_scan_bytes, flush_list_bytes) = (false, 0, usize::MAX);
                Self { min_scan_bytes, is_enforced, flush_list_bytes, ..Self::of_bytes(bytes) }
            }
            (MemoryLimit::Tiles { tiles, write_buffer_bytes }, _) => {
                Self::of_tiles(tiles, write_buffer_bytes)
            }
            (_, Some(bytes)) if has_tiny_tiles => Self::of_bytes(bytes - bytes / FRAGMENTATION_PART),
            (_, bytes) => Self::of_bytes(bytes.unwrap_or(usize::MAX)),
        }
    }

    fn of_tiles(tiles: usize, write_buffer_bytes: usize) -> Self {
        Self {
            tiles,
            bytes: usize::MAX,
            buffer_bytes: write_buffer_bytes,
            scan_bytes: usize::MAX,
            updates_bytes: usize::MAX,
            min_scan_bytes: 0,
            is_enforced: true,
            spare_bytes: 0,
            often_scans: OFTEN_SCANS,
            compact_bytes: 0,
            index_bytes: 0,
            reader_bytes: 64 << 20,
            view_bytes: usize::MAX,
            flush_list_bytes: usize::MAX,
        }
    }

    pub(super) fn has_compact_tier(&self) -> bool {
        self.compact_bytes > 0
    }

    pub(super) fn note_index(&mut self, bytes: usize) {
        self.index_bytes = bytes;
    }

    /// Maximum bytes of buffered updates. The updates of one scan may exceed it.
    pub(super) fn buffer_bytes(&self) -> usize {
        self.left_by_index(self.buffer_bytes)
    }

    /// Maximum bytes of tiles in the compact form while tiles are being evicted.
    pub(super) fn compact_bytes(&self) -> usize {
        self.left_by_index(self.compact_bytes)
    }

    /// Returns a share reduced in proportion to the size of the index. If the index reduced only the memory of resident
    /// tiles, scans of large maps would encode and decode many more tiles.
    fn left_by_index(&self, share: usize) -> usize {
        let taken = self.index_bytes.min(self.bytes);
        share - (share as u128 * taken as u128 / self.bytes.max(1) as u128) as usize
    }

    /// Returns the plan for a limit in bytes. A quarter is for buffered updates: they are small compared with their
    /// tiles, and a large buffer saves reads and writes.
    fn of_bytes(bytes: usize) -> Self {
        Self {
            tiles: usize::MAX,
            bytes,
            buffer_bytes: bytes / 4,
            scan_bytes: bytes / 4,
            updates_bytes: bytes / 8,
            min_scan_bytes: bytes / 8,
            is_enforced: true,
            spare_bytes: bytes / 4,
            often_scans: OFTEN_SCANS,
            compact_bytes: bytes / 8 * 3,
            index_bytes: 0,
            reader_bytes: bytes / 16,
            view_bytes: bytes / 8,
            flush_list_bytes: bytes / 16,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_reduces_all_shares_equally() {
        let mut plan = MemoryPlan::of_bytes(64 << 20);
        assert_eq!((plan.buffer_bytes(), plan.compact_bytes()), (16 << 20, 24 << 20));
        plan.note_index(8 << 20);
        assert_eq!((plan.buffer_bytes(), plan.compact_bytes()), (14 << 20, 21 << 20));
        plan.note_index(usize::MAX);
        assert_eq!((plan.buffer_bytes(), plan.compact_bytes()), (0, 0));
        let mut plan = MemoryPlan::of_tiles(3, 1000);
        plan.note_index(1 << 30);
        assert_eq!((plan.buffer_bytes(), plan.compact_bytes()), (1000, 0));
    }
}
