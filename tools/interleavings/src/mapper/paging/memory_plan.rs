use crate::config::MapConfig;

/// Memory for two or three tiles in use and as many packed ones, so that tiles are saved and loaded all the time.
#[derive(Clone, Copy, Debug)]
pub(in crate::mapper) struct MemoryPlan {
    pub(super) tiles: usize,
    pub(super) bytes: usize,
    buffer_bytes: usize,
    pub(super) min_scan_bytes: usize,
    pub(super) is_enforced: bool,
    pub(super) spare_bytes: usize,
    pub(super) often_scans: u32,
    compact_bytes: usize,
    pub(super) view_bytes: usize,
    pub(super) flush_list_bytes: usize,
}

impl MemoryPlan {
    pub(super) fn of(_: &MapConfig) -> Self {
        Self {
            tiles: 3,
            bytes: 20 << 10,
            buffer_bytes: 2 << 10,
            min_scan_bytes: 0,
            is_enforced: false,
            spare_bytes: 2 << 10,
            often_scans: 1,
            compact_bytes: 1 << 10,
            view_bytes: 2 << 10,
            flush_list_bytes: usize::MAX,
        }
    }

    pub(super) fn has_compact_tier(&self) -> bool {
        self.compact_bytes > 0
    }

    /// Does nothing: the index of these few tiles is small.
    pub(super) fn note_index(&mut self, _: usize) {}

    pub(super) fn buffer_bytes(&self) -> usize {
        self.buffer_bytes
    }

    pub(super) fn compact_bytes(&self) -> usize {
        self.compact_bytes
    }
}
