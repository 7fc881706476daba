use super::window::Window;

/// How much memory the marks of a scan may take, and did take.
#[derive(Clone, Copy, Debug)]
pub(super) struct TraceMemory {
    most_bytes: usize,
    /// What a page takes, as far as was seen.
    page_bytes: usize,
}

/// What a page takes until the first was seen.
const PAGE_BYTES: usize = 48 << 10;

impl Default for TraceMemory {
    fn default() -> Self {
        Self::new(usize::MAX)
    }
}

impl TraceMemory {
    pub(super) fn new(most_bytes: usize) -> Self {
        Self { most_bytes, page_bytes: PAGE_BYTES }
    }

    /// Whether the pages of a window, if rays went through all of them, would take too much for so many collectors.
    pub(super) fn may_be_short(&self, window: &Window, collectors: usize) -> bool {
        let pages: usize = window.pages().iter().map(|&pages| pages as usize).product();
        pages > self.pages_at_a_time(collectors)
    }

    /// How many pages may be marked at a time, by each of so many collectors.
    pub(super) fn pages_at_a_time(&self, collectors: usize) -> usize {
        // Of what is marked, lists of bricks and updates are made, which take as much again.
        (self.most_bytes / 2 / self.page_bytes / collectors).max(1)
    }

    /// Learns what so many pages took, over all collectors.
    pub(super) fn note(&mut self, bytes: usize, pages: usize) {
        if pages >= 64 {
            self.page_bytes = (bytes / pages).max(1 << 10);
        }
    }
}
