use crate::scan::per_scan::PerScanCollector;
use crate::scan::updates::mean_tiles_of_brick;
use crate::space::Grid;

/// Memory limit for tracing a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TraceLimit {
    bytes: usize,
}

/// Share of one collector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CollectorLimit {
    /// Maximum number of fast pages, which are large.
    pub(crate) fast_pages: usize,
    /// Maximum bytes of all other marks. Converting them to updates takes about as much again.
    pub(crate) small_bytes: usize,
}

/// Size of a fast page: one bit per voxel, and at most as much again for hits and the numbers of their bricks.
const FAST_PAGE_BYTES: usize = 66 << 10;
/// Bytes of a brick while its marks are converted to updates, which are in three lists.
const UPDATE_BYTES: usize = 530;
/// Minimum bytes of a collector. With less memory, it would be drained constantly.
const MIN_COLLECTOR_BYTES: usize = 4 << 20;

impl Default for TraceLimit {
    fn default() -> Self {
        Self::new(usize::MAX)
    }
}

impl TraceLimit {
    pub(crate) fn new(bytes: usize) -> Self {
        Self { bytes }
    }

    pub(crate) fn is_none(&self) -> bool {
        self.bytes == usize::MAX
    }

    /// The limit of each of `tracers` tracers.
    pub(crate) fn divided(self, tracers: usize) -> Self {
        if self.is_none() { self } else { Self::new(self.bytes / tracers.max(1)) }
    }

    /// Returns whether this many bytes, of the points that hit voxels, fit.
    pub(crate) fn has_room_for_bytes(&self, bytes: usize) -> bool {
        bytes <= self.bytes / 4
    }

    /// Number of collectors that fit, at most `wanted`.
    pub(crate) fn collectors(&self, wanted: usize) -> usize {
        wanted.min(self.bytes / MIN_COLLECTOR_BYTES).max(1)
    }

    /// Returns whether the updates of these collectors fit in memory, by tile of `grid`.
    pub(crate) fn has_room_for(&self, collectors: &[PerScanCollector], grid: &Grid) -> bool {
        let max_bricks = self.bytes / 2 / UPDATE_BYTES / mean_tiles_of_brick(grid);
        let marks_bytes: usize = collectors.iter().map(PerScanCollector::marks_bytes).sum();
        // A page has at most 512 bricks; they are counted only if that could be too many.
        marks_bytes / FAST_PAGE_BYTES * 2 * 512 < max_bricks
            || collectors.iter().map(PerScanCollector::count_bricks).sum::<usize>() < max_bricks
    }

    /// The limit of each of `collectors` collectors.
    pub(crate) fn of_collector(&self, collectors: usize) -> CollectorLimit {
        let bytes = self.bytes / collectors.max(1);
        CollectorLimit { fast_pages: bytes / 2 / FAST_PAGE_BYTES, small_bytes: bytes / 4 }
    }
}

impl CollectorLimit {
    pub(crate) const NONE: Self = Self { fast_pages: usize::MAX, small_bytes: usize::MAX };
}

/// Budget of bytes that is charged with upper bounds, so that memory is rarely measured.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Allowance {
    bytes: usize,
}

impl Allowance {
    /// Sets the remaining budget.
    pub(crate) fn grant(&mut self, bytes: usize) {
        self.bytes = bytes;
    }

    /// Charges bytes; returns whether they exceed the budget, so that memory must be measured.
    #[inline]
    pub(crate) fn is_spent_by(&mut self, bytes: usize) -> bool {
        let is_spent = self.bytes < bytes;
        self.bytes = self.bytes.saturating_sub(bytes);
        is_spent
    }
}
