use super::ScanReport;
use super::head_start::HeadStarts;
use super::marked_page::{MarkedBrick, MarkedPage};
use super::page_choice::PageChoice;
use super::page_map::PageMap;
use super::ray_end::RayEnd;
use super::ray_origin::RayOrigin;
use super::slab_ray::SlabRay;
use super::tile_order::{brick_code, bricks_by_tile, in_order_of_tiles, part_in_tile};
use super::updates::{BrickUpdate, ScanUpdates, TileUpdates};
use super::window::{PAGE_EDGE, Window};
use crate::space::{
    BRICK_EDGE, BrickMask, Grid, MortonCode, TileIndex, VoxelIndex, VoxelKey, place_of_voxel, places,
};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Most rays that are taken at a time.
pub(super) const BATCH: usize = 256;

/// Collects what one scan says about voxels, each once: a hit over any miss, and of its hits the largest intensity.
#[derive(Clone, Debug, Default)]
pub(super) struct OnceCollector {
    pages: PageMap<MarkedPage>,
    head_starts: HeadStarts,
    /// Bricks outside the window, by index: a page for each would be large for the few voxels of a stray ray.
    far: FxHashMap<VoxelIndex, MarkedBrick>,
    /// The largest intensity of every hit voxel; empty for sensor models that need none.
    intensities: FxHashMap<VoxelIndex, f32>,
}

impl OnceCollector {
    /// Forgets everything, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window, choice: PageChoice<'_>) {
        self.pages.clear(window, choice);
        self.head_starts.clear();
        self.far.clear();
        self.intensities.clear();
    }

    /// Number of pages with marks.
    pub(super) fn pages(&self) -> usize {
        self.pages.pages().len()
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        let far_brick = size_of::<(VoxelIndex, MarkedBrick)>() + 1;
        self.pages.bytes()
            + self.head_starts.bytes()
            + self.far.capacity() * 8 / 7 * far_brick
            + self.intensities.capacity() * 8 / 7 * (size_of::<(VoxelIndex, f32)>() + 1)
    }

    /// Takes some rays from one origin, at most [`BATCH`]: their hits, and the voxels before their last.
    pub(super) fn take(&mut self, origin: &RayOrigin, ends: &[RayEnd], needs_intensity: bool) {
        for end in ends {
            if let Some(intensity) = end.hit {
                self.hit(end.voxel, needs_intensity.then_some(intensity));
            }
        }
        // The rays that are left to walk, without a branch: it would often be guessed wrong.
        let (mut left, mut count) = ([(0, 0); BATCH], 0);
        for (number, &end) in ends.iter().enumerate() {
            let slabs = self.head_starts.of(&SlabRay::new(origin, end));
            left[count % BATCH] = (number, slabs.unwrap_or(0));
            count += usize::from(slabs.is_some());
        }
        let Self { pages, far, .. } = self;
        let takes_far = pages.takes_far();
        for &(number, slabs) in &left[..count] {
            let end = ends[number];
            SlabRay::new(origin, end).pass(pages, slabs, end.hit.is_some(), |voxel| {
                if takes_far {
                    set(&mut far_brick(far, voxel).passed, voxel);
                }
            });
        }
    }

    /// Spares the rays to come what those so far have marked; see [`HeadStarts::extend`] for `edges`.
    pub(super) fn share(&mut self, origin: &RayOrigin, edges: &[usize]) {
        self.head_starts.extend(&self.pages, origin, edges);
    }

    fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        let is_looked_at = match self.pages.window().local(voxel) {
            Some(near) => {
                let page = self.pages.number_at(near);
                self.pages.pages_mut()[page].hit(voxel);
                !self.pages.is_scratch(page)
            }
            None if self.pages.takes_far() => {
                set(&mut far_brick(&mut self.far, voxel).hits, voxel);
                true
            }
            None => false,
        };
        if let Some(intensity) = intensity.filter(|_| is_looked_at) {
            keep_largest(&mut self.intensities, voxel, intensity);
        }
    }

    /// Forgets what is not looked at.
    pub(super) fn finish(&mut self) {
        self.pages.clear_scratch();
    }

    /// Adds what another collector with the same window has seen.
    pub(super) fn absorb(&mut self, other: &Self) {
        for (page, index) in other.pages.pages().iter().zip(other.pages.indices()) {
            let number = self.pages.number_of(index.map(|k| k * PAGE_EDGE as i32));
            self.pages.pages_mut()[number].absorb(page);
        }
        for (index, brick) in &other.far {
            let mine =
                self.far.entry(*index).or_insert(MarkedBrick { hits: [0; 8], passed: [0; 8], ..*brick });
            for word in 0..8 {
                mine.hits[word] |= brick.hits[word];
                mine.passed[word] |= brick.passed[word];
            }
        }
        for (&voxel, &intensity) in &other.intensities {
            keep_largest(&mut self.intensities, voxel, intensity);
        }
    }

    /// The updates, each brick cut at the borders of the tiles.
    pub(super) fn updates(&mut self, grid: &Grid, mut report: ScanReport) -> ScanUpdates {
        let pages = self.pages.pages().par_iter().zip(self.pages.indices());
        let mut bricks: Vec<MarkedBrick> = pages.flat_map_iter(|(page, index)| page.bricks(*index)).collect();
        bricks.extend(self.far.values());
        let indices: Vec<VoxelIndex> = bricks.iter().map(|brick| brick.index).collect();
        let this = &*self;
        let updates = bricks_by_tile(grid, &indices)
            .into_par_iter()
            .map(|(tile, numbers)| (tile, this.updates_of_tile(grid, tile, &bricks, &numbers)));
        let mut tiles: Vec<(TileIndex, Vec<BrickUpdate>)> = updates.collect();
        tiles.retain(|(_, bricks)| !bricks.is_empty());
        for brick in tiles.iter().flat_map(|(_, bricks)| bricks) {
            report.hits += ones(&brick.hits);
            report.misses += ones(&brick.misses);
        }
        let tiles = tiles.into_iter().map(|(tile, bricks)| (tile, TileUpdates::Once(bricks))).collect();
        in_order_of_tiles(grid, tiles, report)
    }

    fn updates_of_tile(
        &self,
        grid: &Grid,
        tile: TileIndex,
        bricks: &[MarkedBrick],
        numbers: &[u32],
    ) -> Vec<BrickUpdate> {
        let update = |&number: &u32| {
            let MarkedBrick { index, mut hits, passed: mut misses } = bricks[number as usize];
            let part = part_in_tile(grid, tile, index);
            for word in 0..8 {
                hits[word] &= part[word];
                misses[word] &= part[word] & !hits[word];
            }
            let is_empty = hits == [0; 8] && misses == [0; 8];
            let intensities = || self.intensities_of(index, &hits);
            (!is_empty).then(|| BrickUpdate {
                brick: brick_code(index),
                hits,
                misses,
                intensities: intensities(),
            })
        };
        numbers.iter().filter_map(update).collect()
    }

    /// The intensities of the given hits of a brick, in the order of the mask.
    fn intensities_of(&self, brick: VoxelIndex, hits: &BrickMask) -> Box<[f32]> {
        if self.intensities.is_empty() {
            return Box::default();
        }
        let intensity = |place| {
            let VoxelKey(local) = MortonCode(place as u64).to_key();
            let voxel = std::array::from_fn(|k| brick[k] * BRICK_EDGE + i32::from(local[k]));
            self.intensities.get(&voxel).copied().unwrap_or_default()
        };
        places(*hits).map(intensity).collect()
    }
}

fn keep_largest(intensities: &mut FxHashMap<VoxelIndex, f32>, voxel: VoxelIndex, intensity: f32) {
    let largest = intensities.entry(voxel).or_insert(intensity);
    if intensity.total_cmp(largest).is_gt() {
        *largest = intensity;
    }
}

fn far_brick(bricks: &mut FxHashMap<VoxelIndex, MarkedBrick>, voxel: VoxelIndex) -> &mut MarkedBrick {
    let index = voxel.map(|k| k.div_euclid(BRICK_EDGE));
    bricks.entry(index).or_insert(MarkedBrick { index, hits: [0; 8], passed: [0; 8] })
}

fn set(mask: &mut BrickMask, voxel: VoxelIndex) {
    let place = place_of_voxel(voxel);
    mask[place / 64] |= 1 << (place % 64);
}

fn ones(mask: &BrickMask) -> u64 {
    mask.iter().map(|word| u64::from(word.count_ones())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Point;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn end(point: Point, hit: bool) -> RayEnd {
        RayEnd { point, voxel: point.map(|x| x.floor() as i32), hit: hit.then_some(0.0) }
    }

    /// Ends of rays in all directions of a part of a sphere, near and far as over a rough surface.
    fn fan(origin: Point, rays: usize, reach: f64, roughness: f64, opening: f64) -> Vec<RayEnd> {
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

    fn collected(collector: &OnceCollector) -> Marks {
        let mut marks = Marks::default();
        for (page, index) in collector.pages.pages().iter().zip(collector.pages.indices()) {
            for brick in page.bricks(*index) {
                for place in 0..512_usize {
                    let voxel = std::array::from_fn(|axis| {
                        let bit = |level: usize| (place >> (3 * level + axis) & 1) << level;
                        brick.index[axis] * BRICK_EDGE + (bit(0) | bit(1) | bit(2)) as i32
                    });
                    let is_set = |mask: &BrickMask| mask[place / 64] >> (place % 64) & 1 != 0;
                    match (is_set(&brick.hits), is_set(&brick.passed)) {
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
    fn rays_to_the_far_end_of_the_window_leave_the_marks_of_whole_rays() {
        let origin = [12.3, -45.6, 7.75];
        let ends = fan(origin, 80, 5_000.0, 0.25, 0.005);
        let origin = &RayOrigin::new(origin, origin.map(|x| x.floor() as i32));
        let mut collector = OnceCollector::default();
        let far = 8_000.0;
        let bounds = (origin.point.map(|x| x - far), origin.point.map(|x| x + far));
        let [(low_x, high_x), (low_y, high_y)] = [0, 1].map(|k| (bounds.0[k], bounds.1[k]));
        let window = Window::around(origin.voxel, ([low_x, low_y, -50.0], [high_x, high_y, 50.0]));
        assert!(window.pages()[0] > 240 && window.pages()[1] > 240);
        collector.clear(window, PageChoice::All);
        collector.take(origin, &ends, false);
        assert!(collector.far.is_empty());
        assert!(collected(&collector) == walked(origin, &ends));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn rays_that_begin_after_what_is_shared_leave_the_marks_of_whole_rays(
            origin in prop::array::uniform3(-100.0..100.0_f64),
            is_on_border in prop::array::uniform3(prop::bool::ANY),
            reach in 3.0..40.0_f64,
            roughness in prop::sample::select(vec![0.0, 0.1, 0.4]),
            opening in prop::sample::select(vec![1.0, 0.2]),
        ) {
            let origin: Point =
                std::array::from_fn(|k| if is_on_border[k] { origin[k].floor() } else { origin[k] });
            let ends = fan(origin, 6000, reach, roughness, opening);
            let origin = &RayOrigin::new(origin, origin.map(|x| x.floor() as i32));
            let mut collector = OnceCollector::default();
            let window = Window::around(origin.voxel, (
                origin.point.map(|x| x - 2.0 * reach),
                origin.point.map(|x| x + 2.0 * reach),
            ));
            collector.clear(window, PageChoice::All);
            let mut shared = 0;
            for round in 0..8 {
                let part: Vec<RayEnd> = ends.iter().skip(round).step_by(8).copied().collect();
                shared += part
                    .iter()
                    .filter(|end| collector.head_starts.of(&SlabRay::new(origin, **end)) != Some(0))
                    .count();
                part.chunks(BATCH).for_each(|batch| collector.take(origin, batch, false));
                collector.share(origin, &[8, 4, 2, 1]);
            }
            prop_assert_eq!(collected(&collector), walked(origin, &ends));
            prop_assert!(shared > 100, "only {} rays were spared something", shared);
        }
    }
}
