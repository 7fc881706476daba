use crate::space::{Point, VoxelIndex};

/// Voxels along the edge of a page of 8 x 8 x 8 bricks.
pub(crate) const PAGE_EDGE: i64 = 64;

/// Possible reaches of a window in voxels, to both sides of the sensor along each axis. A window has the largest reach
/// with which it has at most [`MAX_PAGES`], or the smallest reach if none fits. A stray ray that points up can reduce
/// the reach, which only costs time.
const REACHES: [i64; 3] = [8128, 4032, 1984];

/// Number of pages of a window with the smallest reach to all sides: 1 MiB of page numbers.
const MAX_PAGES: u64 = 63 * 63 * 63;

/// Voxel relative to the lowest voxel of a window.
pub(crate) type Local = [u32; 3];

/// Box of whole pages around a sensor, in which the rays of a scan are marked without a hash map. Outside of it, rays
/// are traced voxel by voxel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Window {
    base: VoxelIndex,
    pages: [u32; 3],
}

impl Window {
    /// Returns whether a window of at most `max_pages` holds all points with these bounds, in units of voxels.
    pub(crate) fn can_hold((low, high): (Point, Point), max_pages: usize) -> bool {
        let pages: f64 = (0..3).map(|k| (high[k] - low[k]) / PAGE_EDGE as f64 + 2.0).product();
        pages <= (max_pages as f64).min(MAX_PAGES as f64)
    }

    /// Returns the window around `center` for points with these bounds, both in units of voxels.
    pub(crate) fn around(center: VoxelIndex, bounds: (Point, Point)) -> Self {
        let windows = REACHES.map(|reach| Self::reaching(reach, center, bounds));
        let is_small =
            |window: &&Self| window.pages.iter().map(|&pages| u64::from(pages)).product::<u64>() <= MAX_PAGES;
        *windows.iter().find(is_small).unwrap_or(&windows[REACHES.len() - 1])
    }

    fn reaching(reach: i64, center: VoxelIndex, bounds: (Point, Point)) -> Self {
        let page = |axis: usize, coordinate: f64| {
            let center = i64::from(center[axis]);
            // The cast saturates. It would convert NaN to 0, but no bound is NaN.
            let voxel = (coordinate.floor() as i64).clamp(center - reach, center + reach);
            voxel
                .clamp(i64::from(i32::MIN) + PAGE_EDGE, i64::from(i32::MAX) - PAGE_EDGE)
                .div_euclid(PAGE_EDGE)
        };
        let first: [i64; 3] = std::array::from_fn(|k| page(k, bounds.0[k].min(f64::from(center[k]))));
        let last: [i64; 3] = std::array::from_fn(|k| page(k, bounds.1[k].max(f64::from(center[k]))));
        Self {
            base: first.map(|page| (page * PAGE_EDGE) as i32),
            pages: std::array::from_fn(|k| (last[k] - first[k]).max(0) as u32 + 1),
        }
    }

    /// Number of the page that contains a voxel.
    #[inline]
    pub(crate) fn page_of(&self, [x, y, z]: Local) -> usize {
        let [_, height, depth] = self.pages;
        ((x / 64 * height + y / 64) * depth + z / 64) as usize
    }

    #[cfg(test)]
    pub(crate) fn pages(&self) -> [u32; 3] {
        self.pages
    }

    /// Number of pages.
    pub(crate) fn count(&self) -> usize {
        self.pages.map(|pages| pages as usize).iter().product()
    }

    /// Lowest voxel of the window.
    pub(crate) fn base(&self) -> VoxelIndex {
        self.base
    }

    /// Returns whether a voxel, relative to the lowest one, is inside.
    #[inline]
    pub(crate) fn holds(&self, local: Local) -> bool {
        (0..3).all(|k| local[k] < self.pages[k] * PAGE_EDGE as u32)
    }

    /// Returns a voxel relative to the lowest one; `None` if it is outside.
    #[inline]
    pub(crate) fn local(&self, voxel: VoxelIndex) -> Option<Local> {
        let local: Local = std::array::from_fn(|k| voxel[k].wrapping_sub(self.base[k]) as u32);
        self.holds(local).then_some(local)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_has_the_largest_reach_within_its_page_limit() {
        let pages = |low: Point, high: Point| Window::around([0; 3], (low, high)).pages();
        assert_eq!(pages([-6000.0, -100.0, -10.0], [8000.0, 100.0, 10.0]), [220, 4, 2]);
        assert_eq!(pages([-9e9; 3], [9e9; 3]), [63; 3]);
        // A stray ray that points straight up.
        assert_eq!(pages([-3000.0, -3000.0, -10.0], [3000.0, 3000.0, 1e6]), [63, 63, 33]);
        assert_eq!(pages([-1500.0, -1500.0, -10.0], [1500.0, 1500.0, 1e6]), [48, 48, 65]);
    }
}
