use crate::scan::per_scan::OnceCollector;

/// How much memory it may take to follow the rays of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TraceLimit {
    bytes: usize,
}

/// The share of one collector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CollectorLimit {
    /// How many pages may be fast, and large.
    pub(crate) fast_pages: usize,
    /// Most bytes of all other marks; what they are made into when they are drained takes about as much again.
    pub(crate) small_bytes: usize,
}

/// A fast page, with hits.
const FAST_PAGE_BYTES: usize = 64 << 10;
/// What a brick takes while its marks are made into updates, three times in lists.
const UPDATE_BYTES: usize = 450;
/// A collector with less would be drained all the time.
const LEAST_COLLECTOR_BYTES: usize = 4 << 20;

impl Default for TraceLimit {
    fn default() -> Self {
        Self::new(usize::MAX)
    }
}

impl TraceLimit {
    pub(crate) fn new(bytes: usize) -> Self {
        Self { bytes }
    }

    /// How many of so many collectors there is memory for.
    pub(crate) fn collectors(&self, wanted: usize) -> usize {
        wanted.min(self.bytes / LEAST_COLLECTOR_BYTES).max(1)
    }

    /// Whether there is room for all that the marks of some collectors are made into.
    pub(crate) fn has_room_for(&self, collectors: &[OnceCollector]) -> bool {
        let most_bricks = self.bytes / 2 / UPDATE_BYTES;
        let marks_bytes: usize = collectors.iter().map(OnceCollector::marks_bytes).sum();
        // A page has 512 bricks at most; only where that might be too many they are counted.
        marks_bytes / FAST_PAGE_BYTES * 2 * 512 < most_bricks
            || collectors.iter().map(OnceCollector::count_bricks).sum::<usize>() < most_bricks
    }

    /// What each of so many collectors may take.
    pub(crate) fn of_collector(&self, collectors: usize) -> CollectorLimit {
        let bytes = self.bytes / collectors.max(1);
        CollectorLimit { fast_pages: bytes / 2 / FAST_PAGE_BYTES, small_bytes: bytes / 4 }
    }
}

impl CollectorLimit {
    /// None.
    pub(crate) const NONE: Self = Self { fast_pages: usize::MAX, small_bytes: usize::MAX };
}

/// Counts what rays may have left since the memory was last looked at, so that it is looked at seldom.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Allowance {
    bytes: usize,
}

impl Allowance {
    /// So many bytes are free.
    pub(crate) fn grant(&mut self, bytes: usize) {
        self.bytes = bytes;
    }

    /// Whether so many more may be too many, and it is time to look.
    #[inline]
    pub(crate) fn is_spent_by(&mut self, bytes: usize) -> bool {
        let is_spent = self.bytes < bytes;
        self.bytes = self.bytes.saturating_sub(bytes);
        is_spent
    }
}
