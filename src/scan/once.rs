use super::ScanReport;
use super::block_map::BlockMap;
use super::marked_page::{MarkedBrick, MarkedPage};
use super::slab_ray::SlabRay;
use super::tile_order::{brick_code, bricks_by_tile, in_order_of_tiles, part_in_tile};
use super::updates::{BrickUpdate, ScanUpdates, TileUpdates};
use super::window::{PAGE_EDGE, Window};
use crate::space::{BRICK_EDGE, BrickMask, Grid, TileIndex, VoxelIndex, place_of_voxel, places};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Collects what one scan says about voxels, each once: a hit over any miss, and of its hits the largest intensity.
#[derive(Clone, Debug, Default)]
pub(super) struct OnceCollector {
    pages: BlockMap<MarkedPage>,
    /// Bricks outside the window, by index: a page for each would be large for the few voxels of a stray ray.
    far: FxHashMap<VoxelIndex, MarkedBrick>,
    /// The intensity of every hit; empty for sensor models that need none.
    intensities: Vec<HitIntensity>,
}

#[derive(Clone, Copy, Debug)]
struct HitIntensity {
    brick: VoxelIndex,
    place: u16,
    intensity: f32,
}

impl OnceCollector {
    /// Forgets everything, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.pages.clear(window);
        self.far.clear();
        self.intensities.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        let far_brick = size_of::<(VoxelIndex, MarkedBrick)>() + 1;
        self.pages.bytes()
            + self.far.capacity() * 8 / 7 * far_brick
            + self.intensities.capacity() * size_of::<HitIntensity>()
    }

    /// A ray passes all voxels before its last.
    pub(super) fn pass(&mut self, ray: &SlabRay) {
        let Self { pages, far, .. } = self;
        ray.pass(pages, |voxel| set(&mut far_brick(far, voxel).passed, voxel));
    }

    /// A ray ends in a voxel.
    pub(super) fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        match self.pages.window().local(voxel) {
            Some(near) => self.pages.at(near).hit(voxel),
            None => set(&mut far_brick(&mut self.far, voxel).hits, voxel),
        }
        if let Some(intensity) = intensity {
            let brick = voxel.map(|k| k.div_euclid(BRICK_EDGE));
            self.intensities.push(HitIntensity { brick, place: place_of_voxel(voxel) as u16, intensity });
        }
    }

    /// Adds what another collector with the same window has seen.
    pub(super) fn absorb(&mut self, other: &Self) {
        for (page, index) in other.pages.blocks().iter().zip(other.pages.indices()) {
            let slot = self.pages.slot_of(index.map(|k| k * PAGE_EDGE as i32));
            self.pages.blocks_mut()[slot].absorb(page);
        }
        for (index, brick) in &other.far {
            let mine =
                self.far.entry(*index).or_insert(MarkedBrick { hits: [0; 8], passed: [0; 8], ..*brick });
            for word in 0..8 {
                mine.hits[word] |= brick.hits[word];
                mine.passed[word] |= brick.passed[word];
            }
        }
        self.intensities.extend_from_slice(&other.intensities);
    }

    /// The updates, each brick cut at the borders of the tiles.
    pub(super) fn updates(&mut self, grid: &Grid, mut report: ScanReport) -> ScanUpdates {
        let pages = self.pages.blocks().par_iter().zip(self.pages.indices());
        let mut bricks: Vec<MarkedBrick> = pages.flat_map_iter(|(page, index)| page.bricks(*index)).collect();
        bricks.extend(self.far.values());
        let indices: Vec<VoxelIndex> = bricks.iter().map(|brick| brick.index).collect();
        // The largest of a voxel comes first.
        self.intensities.sort_unstable_by(|a, b| {
            (a.brick, a.place).cmp(&(b.brick, b.place)).then(b.intensity.total_cmp(&a.intensity))
        });
        self.intensities.dedup_by_key(|hit| (hit.brick, hit.place));
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
        let start = self.intensities.partition_point(|hit| hit.brick < brick);
        let of_brick = self.intensities[start..].iter().take_while(|hit| hit.brick == brick);
        let mut wanted = places(*hits).peekable();
        of_brick
            .filter(|hit| wanted.next_if_eq(&usize::from(hit.place)).is_some())
            .map(|hit| hit.intensity)
            .collect()
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
