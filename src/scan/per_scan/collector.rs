use super::bricks::{Intensities, add_bricks, hits_and_misses, updates_by_tile};
use super::far_bricks::FarBricks;
use super::hit_batch::HitBatch;
use super::page_marks::PageMarks;
use super::page_updates::updates_of_pages;
use crate::scan::ScanReport;
use crate::scan::clearing::Clearance;
use crate::scan::coherence::{MarkedPrefixes, cell_of};
use crate::scan::pages::{Footprint, MarkedBrick, MarkedPage, PAGE_EDGE, PageMap, Window};
use crate::scan::ray::{RayCut, RayEnd, RayOrigin, SlabRay};
use crate::scan::spill::ScanParts;
use crate::scan::trace::{Allowance, CollectorLimit};
use crate::scan::updates::{BrickUpdate, MappedTiles, ScanUpdates, TileUpdates, in_order_of_tiles};
use crate::space::{BrickMask, TileIndex, VoxelIndex, hash_table_bytes};
use rayon::prelude::*;

/// Maximum number of rays per call of [`PerScanCollector::take`].
pub(crate) const BATCH: usize = 256;

/// Collector of the updates of one scan, one per voxel: a hit overrides a miss, and the largest intensity of its hits
/// is used.
///
/// If memory is short, only the first pages are fast; the marks in others are drained to [`ScanParts`] when they exceed
/// the limit.
#[derive(Clone, Debug, Default)]
pub(crate) struct PerScanCollector {
    pages: PageMap<MarkedPage>,
    prefixes: MarkedPrefixes,
    /// Bricks outside the window.
    far: FarBricks,
    intensities: Intensities,
    max_small_bytes: usize,
    allowance: Allowance,
}

/// Maximum bytes that a ray adds per slab: three eighths of a brick of 64 bytes in a list that may be half empty, and
/// three 64ths of a page.
const BYTES_PER_SLAB: usize = 128;
/// Maximum bytes that a ray adds in addition to its slabs: the page and brick that it ends in.
const BYTES_PER_RAY: usize = 4 << 10;

impl PerScanCollector {
    /// Clears the collector and sets another window; the memory is kept.
    pub(crate) fn clear(&mut self, window: Window, limit: &CollectorLimit) {
        self.pages.clear(window, limit.fast_pages);
        self.prefixes.clear();
        self.far.clear();
        self.intensities.clear();
        self.max_small_bytes = limit.small_bytes;
        self.allowance.grant(limit.small_bytes);
    }

    pub(crate) fn bytes(&self) -> usize {
        self.pages.bytes() + self.prefixes.bytes() + self.far.bytes() + self.intensities_bytes()
    }

    fn intensities_bytes(&self) -> usize {
        hash_table_bytes::<(VoxelIndex, f32)>(self.intensities.capacity())
    }

    pub(crate) fn marks_bytes(&self) -> usize {
        self.pages.pages().iter().map(MarkedPage::heap_bytes).sum::<usize>() + self.far.bytes()
    }

    pub(crate) fn count_bricks(&self) -> usize {
        self.pages.pages().iter().map(MarkedPage::count_bricks).sum::<usize>() + self.far.len()
    }

    /// Records at most [`BATCH`] rays from one origin: their hits, and the voxels before them. Marks that exceed the
    /// limit, if there is one, are drained to `parts`.
    pub(crate) fn take(
        &mut self,
        origin: &RayOrigin,
        ends: &[RayEnd],
        needs_intensity: bool,
        parts: Option<&ScanParts<'_>>,
    ) {
        for end in ends {
            if let Some(intensity) = end.hit {
                self.hit(end.voxel, needs_intensity.then_some(intensity));
            }
        }
        // Selects the rays that have to be traced. Branchless, because a branch would be unpredictable.
        let (mut left, mut count) = ([(0, 0); BATCH], 0);
        for (number, &end) in ends.iter().enumerate() {
            let ray = SlabRay::new(origin, end);
            let slabs = self.prefixes.of(cell_of(&ray.slope()), ray.last_slab());
            left[count % BATCH] = (number, slabs.unwrap_or(0));
            count += usize::from(slabs.is_some());
        }
        self.trace(origin, left[..count].iter().map(|&(number, slabs)| (ends[number], slabs)), parts);
    }

    /// Like [`PerScanCollector::take`], for rays that all end in hits and are not cut.
    pub(crate) fn take_hits(&mut self, origin: &RayOrigin, hits: &HitBatch, parts: Option<&ScanParts<'_>>) {
        let (mut left, mut count) = ([(0, 0); BATCH], 0);
        for (row, ray) in hits.rays().iter().enumerate() {
            self.hit(hits.voxel(row), None);
            let slabs = self.prefixes.of(ray.cell, ray.last_slab);
            left[count % BATCH] = (row, slabs.unwrap_or(0));
            count += usize::from(slabs.is_some());
        }
        self.trace(origin, left[..count].iter().map(|&(row, slabs)| (hits.end(row), slabs)), parts);
    }

    /// Marks the voxels before the ends of rays, after the given number of slabs.
    #[inline]
    fn trace(
        &mut self,
        origin: &RayOrigin,
        rays: impl Iterator<Item = (RayEnd, u32)>,
        parts: Option<&ScanParts<'_>>,
    ) {
        for (end, slabs) in rays {
            let ray = SlabRay::new(origin, end);
            if let Some(parts) = parts {
                let new_bytes = BYTES_PER_RAY + BYTES_PER_SLAB * ray.slabs_after(slabs) as usize;
                if self.allowance.is_spent_by(new_bytes) {
                    self.keep_to_limit(new_bytes, parts);
                }
            }
            let Self { pages, far, intensities, max_small_bytes, .. } = self;
            ray.pass(pages, slabs, end.hit.is_some(), |voxel| {
                far.pass(voxel);
                if let Some(parts) = parts
                    && far.bytes() > *max_small_bytes / 2
                {
                    parts.add_marked(far.take().into_iter(), intensities);
                }
            });
        }
    }

    /// Lets later rays skip the voxels marked so far; see [`MarkedPrefixes::extend`] for `edges`.
    pub(crate) fn extend_prefixes(&mut self, origin: &RayOrigin, edges: &[usize], cut: Option<&RayCut<'_>>) {
        self.prefixes.extend(&self.pages, origin, edges, cut);
    }

    fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        match self.pages.window().local(voxel) {
            Some(near) => self.pages.at(near).hit(voxel),
            None => self.far.hit(voxel),
        }
        if let Some(intensity) = intensity {
            keep_largest(&mut self.intensities, voxel, intensity);
        }
    }

    /// Frees `new_bytes` bytes: drains the small pages to `parts` and, if that is not enough, all pages.
    #[cold]
    fn keep_to_limit(&mut self, new_bytes: usize, parts: &ScanParts<'_>) {
        let first_small = self.pages.first_small();
        let pages_bytes: usize = self.pages.pages()[first_small..]
            .iter()
            .map(|page| size_of::<MarkedPage>() + page.heap_bytes())
            .sum();
        let bytes = pages_bytes + self.far.bytes() + self.intensities_bytes();
        // Requires a minimum of free bytes; otherwise the next ray would measure again.
        let least = new_bytes.max(self.max_small_bytes / 8);
        if bytes + least <= self.max_small_bytes {
            return self.allowance.grant(self.max_small_bytes - bytes);
        }
        let first = if self.intensities_bytes() > self.max_small_bytes / 4 { 0 } else { first_small };
        self.drain_from(first, parts);
        self.allowance.grant(self.max_small_bytes - self.intensities_bytes().min(self.max_small_bytes));
    }

    /// Drains the pages from this number on, and all marks outside the window. Marked prefixes remain valid.
    fn drain_from(&mut self, first: usize, parts: &ScanParts<'_>) {
        let mut pages = self.pages.take_from(first);
        pages.sort_unstable_by_key(|(index, _)| *index);
        let bricks = pages.iter().flat_map(|(index, page)| page.bricks(*index));
        parts.add_marked(bricks, &self.intensities);
        parts.add_marked(self.far.take().into_iter(), &self.intensities);
        if first == 0 {
            self.intensities = Intensities::default();
        }
    }

    pub(crate) fn finish(&mut self, parts: &ScanParts<'_>) {
        self.drain_from(0, parts);
    }

    /// Adds the marks of another collector with the same window.
    pub(crate) fn absorb(&mut self, other: &Self) {
        for (page, index) in other.pages.pages().iter().zip(other.pages.indices()) {
            let number = self.pages.number_of(index.map(|k| k * PAGE_EDGE as i32));
            self.pages.pages_mut()[number].absorb(page);
        }
        self.far.absorb(&other.far);
        for (&voxel, &intensity) in &other.intensities {
            keep_largest(&mut self.intensities, voxel, intensity);
        }
    }

    /// Returns the updates. Bricks across a tile border are split.
    pub(crate) fn updates(
        &mut self,
        mapped: MappedTiles<'_>,
        clearance: Option<&Clearance>,
        mut report: ScanReport,
    ) -> ScanUpdates {
        // One scope for all steps, because each transfer to the pool costs a thread switch.
        let tiles = rayon::scope(|_| {
            self.pages.pages_mut().par_iter_mut().for_each(MarkedPage::find_bricks);
            self.far.put_latest_in();
            match clearance {
                None => self.updates_by_tile(mapped, |_| [0; 8]),
                Some(clearance) => {
                    let marks = PageMarks::new(&self.pages, &self.far);
                    self.updates_by_tile(mapped, |brick| clearance.weak_misses(brick, &marks))
                }
            }
        });
        // A stray ray must not occupy memory permanently.
        drop(self.far.take());
        let tiles: Vec<_> = tiles
            .into_iter()
            .map(|(tile, bricks)| {
                let (hits, misses) = hits_and_misses(&bricks);
                report.hits += hits;
                report.misses += misses;
                (tile, TileUpdates::Masks(bricks))
            })
            .collect();
        in_order_of_tiles(mapped.grid, tiles, report)
    }

    fn updates_by_tile(
        &self,
        mapped: MappedTiles<'_>,
        weak: impl Fn(VoxelIndex) -> BrickMask + Sync,
    ) -> Vec<(TileIndex, Vec<BrickUpdate>)> {
        let mut tiles = if mapped.grid.voxels_per_tile_edge() >= PAGE_EDGE as i32 / 2 {
            updates_of_pages(mapped, &self.pages, &self.intensities, &weak)
        } else {
            // A page would overlap hundreds of tiles.
            let pages = self.pages.pages().iter().zip(self.pages.indices());
            let bricks: Vec<MarkedBrick> = pages.flat_map(|(page, index)| page.bricks(*index)).collect();
            updates_by_tile(mapped, &bricks, &self.intensities, &weak)
        };
        if !self.far.is_empty() {
            let far: Vec<MarkedBrick> = self.far.iter().copied().collect();
            add_bricks(&mut tiles, updates_by_tile(mapped, &far, &self.intensities, &weak));
        }
        tiles
    }
}

fn keep_largest(intensities: &mut Intensities, voxel: VoxelIndex, intensity: f32) {
    let largest = intensities.entry(voxel).or_insert(intensity);
    if intensity.total_cmp(largest).is_gt() {
        *largest = intensity;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::ray::SlabSpan;
    use crate::space::{BRICK_EDGE, Point, is_in_mask};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn end(point: Point, hit: bool) -> RayEnd {
        RayEnd {
            point,
            voxel: point.map(|x| x.floor() as i32),
            hit: hit.then_some(0.0),
            span: SlabSpan::WHOLE,
        }
    }

    /// Ends of rays into a part of a sphere, with varying ranges as on a rough surface.
    fn ends_of_rays(origin: Point, rays: usize, reach: f64, roughness: f64, opening: f64) -> Vec<RayEnd> {
        let ray = |k: usize| {
            let (azimuth, up) =
                (k as f64 * 2.399_963, opening * (2.0 * (k as f64 + 0.5) / rays as f64 - 1.0));
            let reach = reach * (1.0 + roughness * ((3.0 * azimuth).sin() + (7.0 * up).cos()));
            let flat = (1.0 - up * up).sqrt() * reach;
            let point =
                [origin[0] + flat * azimuth.cos(), origin[1] + flat * azimuth.sin(), origin[2] + up * reach];
            end(point, !k.is_multiple_of(11))
        };
        (0..rays).map(ray).collect()
    }

    /// Voxels that are hit, and voxels that are only passed.
    type Marks = [BTreeSet<VoxelIndex>; 2];

    fn walked(origin: &RayOrigin, ends: &[RayEnd]) -> Marks {
        let [mut hits, mut passed] = Marks::default();
        for &end in ends {
            SlabRay::new(origin, end).walk().for_each_before_end(|voxel| {
                passed.insert(voxel);
            });
            hits.extend(end.hit.map(|_| end.voxel));
        }
        let missed = passed.difference(&hits).copied().collect();
        [hits, missed]
    }

    fn collected(collector: &PerScanCollector) -> Marks {
        let mut marks = Marks::default();
        for (page, index) in collector.pages.pages().iter().zip(collector.pages.indices()) {
            for brick in page.bricks(*index) {
                for place in 0..512_usize {
                    let voxel = std::array::from_fn(|axis| {
                        let bit = |level: usize| (place >> (3 * level + axis) & 1) << level;
                        brick.index[axis] * BRICK_EDGE + (bit(0) | bit(1) | bit(2)) as i32
                    });
                    match (is_in_mask(&brick.hits, place), is_in_mask(&brick.passed, place)) {
                        (true, _) => marks[0].insert(voxel),
                        (false, true) => marks[1].insert(voxel),
                        (false, false) => false,
                    };
                }
            }
        }
        marks
    }

    #[test]
    fn rays_to_the_end_of_the_window_mark_all_voxels() {
        let origin = [12.3, -45.6, 7.75];
        let ends = ends_of_rays(origin, 80, 5_000.0, 0.25, 0.005);
        let origin = &RayOrigin::new(origin, origin.map(|x| x.floor() as i32));
        let mut collector = PerScanCollector::default();
        let far = 8_000.0;
        let bounds = (origin.point.map(|x| x - far), origin.point.map(|x| x + far));
        let [(low_x, high_x), (low_y, high_y)] = [0, 1].map(|k| (bounds.0[k], bounds.1[k]));
        let window = Window::around(origin.voxel, ([low_x, low_y, -50.0], [high_x, high_y, 50.0]));
        assert!(window.pages()[0] > 240 && window.pages()[1] > 240);
        collector.clear(window, &CollectorLimit::NONE);
        collector.take(origin, &ends, false, None);
        assert!(collector.far.is_empty());
        assert!(collected(&collector) == walked(origin, &ends));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn skipping_marked_prefixes_does_not_change_the_marks(
            origin in prop::array::uniform3(-100.0..100.0_f64),
            is_on_border in prop::array::uniform3(prop::bool::ANY),
            reach in 3.0..40.0_f64,
            roughness in prop::sample::select(vec![0.0, 0.1, 0.4]),
            opening in prop::sample::select(vec![1.0, 0.2]),
        ) {
            let origin: Point =
                std::array::from_fn(|k| if is_on_border[k] { origin[k].floor() } else { origin[k] });
            let ends = ends_of_rays(origin, 6000, reach, roughness, opening);
            let origin = &RayOrigin::new(origin, origin.map(|x| x.floor() as i32));
            let mut collector = PerScanCollector::default();
            let window = Window::around(origin.voxel, (
                origin.point.map(|x| x - 2.0 * reach),
                origin.point.map(|x| x + 2.0 * reach),
            ));
            collector.clear(window, &CollectorLimit::NONE);
            let mut shared = 0;
            for round in 0..8 {
                let part: Vec<RayEnd> = ends.iter().skip(round).step_by(8).copied().collect();
                shared += part
                    .iter()
                    .map(|end| SlabRay::new(origin, *end))
                    .filter(|ray| collector.prefixes.of(cell_of(&ray.slope()), ray.last_slab()) != Some(0))
                    .count();
                part.chunks(BATCH).for_each(|batch| collector.take(origin, batch, false, None));
                collector.extend_prefixes(origin, &[8, 4, 2, 1], None);
            }
            prop_assert_eq!(collected(&collector), walked(origin, &ends));
            prop_assert!(shared > 100, "only {} rays were spared something", shared);
        }
    }
}
