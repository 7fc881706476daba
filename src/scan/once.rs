use super::ScanReport;
use super::marks::Marks;
use super::slab_walk::SlabRay;
use super::tile_order::in_order_of_tiles;
use super::updates::{BrickUpdate, ScanUpdates, TileUpdates};
use super::window::Window;
use crate::space::{
    BRICK_EDGE, BrickCode, BrickMask, Grid, TileIndex, VoxelIndex, mask_of_box, place_of_voxel, places,
};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Collects what one scan says about voxels, each once: a hit over any miss, and of its hits the largest intensity.
#[derive(Clone, Debug, Default)]
pub(super) struct OnceCollector {
    /// What lies in the window around the sensor; nearly everything.
    marks: Marks,
    /// What lies outside, by the index of the brick.
    far: FxHashMap<VoxelIndex, FarBrick>,
    /// The intensity of every hit; empty for sensor models that need none.
    intensities: Vec<HitIntensity>,
}

/// A brick outside the window.
#[derive(Clone, Copy, Debug, Default)]
struct FarBrick {
    hits: BrickMask,
    passed: BrickMask,
}

#[derive(Clone, Copy, Debug)]
struct HitIntensity {
    brick: VoxelIndex,
    place: u16,
    intensity: f32,
}

/// Where the marks of a brick are.
#[derive(Clone, Copy)]
enum Source {
    Window(usize),
    Far(FarBrick),
}

impl OnceCollector {
    /// Forgets everything, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.marks.clear(window);
        self.far.clear();
        self.intensities.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        let far_brick = size_of::<(VoxelIndex, FarBrick)>() + 1;
        self.marks.bytes()
            + self.far.capacity() * 8 / 7 * far_brick
            + self.intensities.capacity() * size_of::<HitIntensity>()
    }

    /// A ray passes all voxels before its last.
    pub(super) fn pass_along(&mut self, ray: &SlabRay) {
        if !ray.mark(&mut self.marks) {
            ray.walk().for_each_before_end(|voxel| self.pass(voxel));
        }
    }

    fn pass(&mut self, voxel: VoxelIndex) {
        if let Some(local) = self.marks.window().local(voxel) {
            self.marks.pass(local);
        } else {
            let place = place_of_voxel(voxel);
            self.far_brick(voxel).passed[place / 64] |= 1 << (place % 64);
        }
    }

    /// A ray ends in a voxel.
    pub(super) fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        let place = place_of_voxel(voxel);
        if let Some(local) = self.marks.window().local(voxel) {
            self.marks.hit(local);
        } else {
            self.far_brick(voxel).hits[place / 64] |= 1 << (place % 64);
        }
        if let Some(intensity) = intensity {
            let place = place as u16;
            self.intensities.push(HitIntensity { brick: brick_of(voxel), place, intensity });
        }
    }

    fn far_brick(&mut self, voxel: VoxelIndex) -> &mut FarBrick {
        self.far.entry(brick_of(voxel)).or_default()
    }

    /// Adds what another collector with the same window has seen.
    pub(super) fn absorb(&mut self, other: &Self) {
        self.marks.absorb(&other.marks);
        for (index, brick) in &other.far {
            let mine = self.far.entry(*index).or_default();
            add(&mut mine.hits, &brick.hits);
            add(&mut mine.passed, &brick.passed);
        }
        self.intensities.extend_from_slice(&other.intensities);
    }

    /// The updates, each brick cut at the borders of the tiles.
    pub(super) fn updates(&mut self, grid: &Grid, mut report: ScanReport) -> ScanUpdates {
        self.marks.finish();
        // The largest of a voxel comes first.
        self.intensities.sort_unstable_by(|a, b| {
            (a.brick, a.place).cmp(&(b.brick, b.place)).then(b.intensity.total_cmp(&a.intensity))
        });
        self.intensities.dedup_by_key(|hit| (hit.brick, hit.place));
        let tiles: Vec<_> = self.bricks_by_tile(grid).into_iter().collect();
        let this = &*self;
        let updates =
            tiles.into_par_iter().map(|(tile, bricks)| (tile, this.updates_of_tile(grid, tile, bricks)));
        let mut tiles: Vec<(TileIndex, Vec<BrickUpdate>)> = updates.collect();
        tiles.retain(|(_, bricks)| !bricks.is_empty());
        for brick in tiles.iter().flat_map(|(_, bricks)| bricks) {
            report.hits += ones(&brick.hits);
            report.misses += ones(&brick.misses);
        }
        let tiles = tiles.into_iter().map(|(tile, bricks)| (tile, TileUpdates::Once(bricks))).collect();
        in_order_of_tiles(grid, tiles, report)
    }

    /// For each tile the bricks that reach into it: index and marks.
    fn bricks_by_tile(&self, grid: &Grid) -> FxHashMap<TileIndex, Vec<(VoxelIndex, Source)>> {
        let near = self.marks.bricks().iter().enumerate().map(|(slot, index)| (*index, Source::Window(slot)));
        let far = self.far.iter().map(|(index, brick)| (*index, Source::Far(*brick)));
        let mut tiles: FxHashMap<TileIndex, Vec<_>> = FxHashMap::default();
        for (index, source) in near.chain(far) {
            for tile in tiles_of_brick(grid, index) {
                tiles.entry(tile).or_default().push((index, source));
            }
        }
        tiles
    }

    fn updates_of_tile(
        &self,
        grid: &Grid,
        tile: TileIndex,
        bricks: Vec<(VoxelIndex, Source)>,
    ) -> Vec<BrickUpdate> {
        let voxels = grid.voxels_of_tile(tile);
        let code = |index: VoxelIndex| BrickCode::of_voxel(index.map(|k| k * BRICK_EDGE));
        let mut coded: Vec<_> =
            bricks.into_iter().map(|(index, source)| (code(index), index, source)).collect();
        coded.sort_unstable_by_key(|&(code, ..)| code);
        let mut updates = Vec::with_capacity(coded.len());
        for (brick, index, source) in coded {
            let (mut hits, mut misses) = match source {
                Source::Window(slot) => self.marks.masks(slot),
                Source::Far(FarBrick { hits, passed }) => (hits, passed),
            };
            let min = index.map(|k| k * BRICK_EDGE);
            let local = |corner: VoxelIndex| std::array::from_fn(|k| corner[k].saturating_sub(min[k]));
            let part = mask_of_box(local(voxels.min), local(voxels.end));
            for word in 0..8 {
                hits[word] &= part[word];
                misses[word] &= part[word] & !hits[word];
            }
            if hits != [0; 8] || misses != [0; 8] {
                let intensities = self.intensities_of(index, &hits);
                updates.push(BrickUpdate { brick, hits, misses, intensities });
            }
        }
        updates
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

/// Index of the brick that holds a voxel: the voxel's index over 8.
fn brick_of(voxel: VoxelIndex) -> VoxelIndex {
    voxel.map(|k| k.div_euclid(BRICK_EDGE))
}

/// The tiles that a brick reaches into.
fn tiles_of_brick(grid: &Grid, brick: VoxelIndex) -> impl Iterator<Item = TileIndex> {
    let min = brick.map(|k| k * BRICK_EDGE);
    let first = grid.tile_of_voxel(min).to_array();
    let last = grid.tile_of_voxel(min.map(|k| k.saturating_add(BRICK_EDGE - 1))).to_array();
    (first[0]..=last[0]).flat_map(move |x| {
        (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| TileIndex::new(x, y, z)))
    })
}

fn add(mask: &mut BrickMask, other: &BrickMask) {
    mask.iter_mut().zip(other).for_each(|(word, other)| *word |= other);
}

fn ones(mask: &BrickMask) -> u64 {
    mask.iter().map(|word| u64::from(word.count_ones())).sum()
}
