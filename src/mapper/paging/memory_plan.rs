use crate::config::MemoryLimit;

/// How the memory that a mapper may use is shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mapper) struct MemoryPlan {
    /// Most tiles.
    pub(super) tiles: usize,
    /// Most bytes of all that grows.
    pub(super) bytes: usize,
    /// Most bytes of updates that wait for tiles on disk before those are fetched; one scan may come on top.
    pub(super) buffer_bytes: usize,
    /// Most bytes of what is known of a scan while it is inserted.
    pub(in crate::mapper) scan_bytes: usize,
    /// Most bytes of packed updates of a scan; what comes on top goes to files.
    pub(in crate::mapper) updates_bytes: usize,
    /// Bytes that are kept free for inserting scans from the beginning.
    pub(super) least_scan_bytes: usize,
    /// Whether the bytes are a limit that is kept, so that what a scan takes counts, and a map that cannot keep to it is
    /// refused. Where tiles are counted, all of it holds.
    pub(super) is_kept: bool,
    /// Bytes that stay free of tiles that need not come in yet.
    pub(super) spare_bytes: usize,
    /// Most bytes of tiles in the compact form while others have to go.
    pub(super) compact_bytes: usize,
}

impl MemoryPlan {
    pub(in crate::mapper) fn new(limit: MemoryLimit) -> Self {
        match limit {
            MemoryLimit::Tiles { tiles, pending_bytes } => Self {
                tiles,
                bytes: usize::MAX,
                buffer_bytes: pending_bytes,
                scan_bytes: usize::MAX,
                updates_bytes: usize::MAX,
                least_scan_bytes: 0,
                is_kept: true,
                spare_bytes: 0,
                compact_bytes: 0,
            },
            // Waiting updates are small beside their tiles, and the more wait the fewer reads and writes there are.
            MemoryLimit::Bytes(bytes) => Self::shares_of(bytes),
            // The marks of even a small scan take more than there is.
            MemoryLimit::Tight(bytes) => {
                Self { least_scan_bytes: 0, is_kept: false, ..Self::shares_of(bytes) }
            }
        }
    }

    fn shares_of(bytes: usize) -> Self {
        Self {
            tiles: usize::MAX,
            bytes,
            buffer_bytes: bytes / 4,
            scan_bytes: bytes / 4,
            updates_bytes: bytes / 8,
            least_scan_bytes: bytes / 8,
            is_kept: true,
            spare_bytes: bytes / 4,
            compact_bytes: bytes / 8 * 3,
        }
    }
}
