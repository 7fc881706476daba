use super::ScanReport;
use super::updates::{BrickUpdate, OrderedUpdates, ScanUpdates, TileUpdates};
use crate::sensor::Observation;
use crate::space::{
    BRICK_EDGE, BrickCode, BrickMask, Grid, TileIndex, VoxelIndex, VoxelKey, mask_of_box, place_of_voxel,
    places,
};
use rustc_hash::FxHashMap;

/// Collects what one scan says about voxels, a mask a brick: hits and misses, each voxel once, a hit over any miss.
#[derive(Default)]
pub(super) struct MaskCollector {
    bricks: Vec<BrickMasks>,
    slots: FxHashMap<VoxelIndex, usize>,
    /// The largest intensity of each hit voxel, by slot and place; empty for sensor models that need none.
    intensities: FxHashMap<(usize, usize), f32>,
    /// Brick and slot of the last voxel: rays mostly stay in a brick.
    latest: Option<(VoxelIndex, usize)>,
}

struct BrickMasks {
    /// Index of the brick: its voxels' indices over 8.
    index: VoxelIndex,
    hits: BrickMask,
    misses: BrickMask,
}

impl MaskCollector {
    #[inline]
    pub(super) fn miss(&mut self, voxel: VoxelIndex) {
        let slot = self.slot_of(voxel);
        let place = place_of_voxel(voxel);
        self.bricks[slot].misses[place / 64] |= 1 << (place % 64);
    }

    pub(super) fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        let slot = self.slot_of(voxel);
        let place = place_of_voxel(voxel);
        self.bricks[slot].hits[place / 64] |= 1 << (place % 64);
        if let Some(intensity) = intensity {
            let largest = self.intensities.entry((slot, place)).or_insert(intensity);
            *largest = largest.max(intensity);
        }
    }

    #[inline]
    fn slot_of(&mut self, voxel: VoxelIndex) -> usize {
        let index = voxel.map(|k| k.div_euclid(BRICK_EDGE));
        match self.latest {
            Some((brick, slot)) if brick == index => slot,
            _ => {
                let slot = *self.slots.entry(index).or_insert_with(|| {
                    self.bricks.push(BrickMasks { index, hits: [0; 8], misses: [0; 8] });
                    self.bricks.len() - 1
                });
                self.latest = Some((index, slot));
                slot
            }
        }
    }

    /// The updates, each brick cut at the borders of the tiles.
    pub(super) fn into_updates(self, grid: &Grid, mut report: ScanReport) -> ScanUpdates {
        let mut tiles: FxHashMap<TileIndex, Vec<BrickUpdate>> = FxHashMap::default();
        for (slot, brick) in self.bricks.iter().enumerate() {
            let min = brick.index.map(|k| k * BRICK_EDGE);
            let misses: BrickMask = std::array::from_fn(|word| brick.misses[word] & !brick.hits[word]);
            for (tile, part) in tiles_of_brick(grid, min) {
                let hits = and(brick.hits, part);
                let misses = and(misses, part);
                if hits == [0; 8] && misses == [0; 8] {
                    continue;
                }
                let intensities =
                    places(hits).filter_map(|place| self.intensities.get(&(slot, place)).copied());
                let update = BrickUpdate {
                    brick: BrickCode::of_voxel(min),
                    hits,
                    misses,
                    intensities: intensities.collect(),
                };
                report.hits += ones(hits);
                report.misses += ones(misses);
                tiles.entry(tile).or_default().push(update);
            }
        }
        let in_order = |(tile, mut bricks): (TileIndex, Vec<BrickUpdate>)| {
            bricks.sort_unstable_by_key(|update| update.brick);
            (tile, TileUpdates::Once(bricks))
        };
        sorted(grid, tiles.into_iter().map(in_order).collect(), report)
    }
}

/// Collects updates of voxels in the order in which they count, a list a tile.
pub(super) struct OrderedCollector<'a> {
    grid: &'a Grid,
    keep_intensities: bool,
    lists: Vec<(TileIndex, VoxelIndex, OrderedUpdates)>,
    slots: FxHashMap<TileIndex, usize>,
    /// The slot of the last update: rays mostly stay in a tile.
    latest: usize,
    hits: u64,
    misses: u64,
}

impl<'a> OrderedCollector<'a> {
    pub(super) fn new(grid: &'a Grid, keep_intensities: bool) -> Self {
        let (lists, slots) = Default::default();
        Self { grid, keep_intensities, lists, slots, latest: 0, hits: 0, misses: 0 }
    }

    pub(super) fn push(&mut self, voxel: VoxelIndex, observation: Observation) {
        match observation {
            Observation::Hit(_) => self.hits += 1,
            Observation::Miss => self.misses += 1,
        }
        let offset_in =
            |min: VoxelIndex| -> VoxelIndex { std::array::from_fn(|k| voxel[k].wrapping_sub(min[k])) };
        let edge = self.grid.voxels_per_tile_edge();
        let in_latest = |(_, min, _): &&mut (_, VoxelIndex, _)| {
            (0..3).all(|k| min[k] <= voxel[k] && i64::from(voxel[k]) - i64::from(min[k]) < i64::from(edge))
        };
        if let Some((_, min, updates)) = self.lists.get_mut(self.latest).filter(in_latest) {
            updates.push(offset_in(*min), observation, self.keep_intensities);
            return;
        }
        let tile = self.grid.tile_of_voxel(voxel);
        self.latest = *self.slots.entry(tile).or_insert_with(|| {
            let min = self.grid.voxels_of_tile(tile).min;
            self.lists.push((tile, min, OrderedUpdates::default()));
            self.lists.len() - 1
        });
        let (_, min, updates) = &mut self.lists[self.latest];
        updates.push(offset_in(*min), observation, self.keep_intensities);
    }

    pub(super) fn into_updates(self, mut report: ScanReport) -> ScanUpdates {
        report.hits += self.hits;
        report.misses += self.misses;
        let tiles =
            self.lists.into_iter().map(|(tile, _, updates)| (tile, TileUpdates::Ordered(updates))).collect();
        sorted(self.grid, tiles, report)
    }
}

/// In Morton order of the tiles' lowest voxels; far apart, where the codes repeat, by index.
fn sorted(grid: &Grid, mut tiles: Vec<(TileIndex, TileUpdates)>, mut report: ScanReport) -> ScanUpdates {
    tiles.sort_by_cached_key(|(tile, _)| {
        (VoxelKey::from_index(grid.voxels_of_tile(*tile).min).morton(), *tile)
    });
    report.tiles_touched = tiles.len() as u64;
    ScanUpdates { tiles, report }
}

/// The tiles that a brick reaches into, and which of its places lie in each.
fn tiles_of_brick(grid: &Grid, min: VoxelIndex) -> impl Iterator<Item = (TileIndex, BrickMask)> {
    let first = grid.tile_of_voxel(min).to_array();
    let last = grid.tile_of_voxel(min.map(|k| k.saturating_add(BRICK_EDGE - 1))).to_array();
    let whole = first == last;
    let grid = *grid;
    let tiles = (first[0]..=last[0]).flat_map(move |x| {
        (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| TileIndex::new(x, y, z)))
    });
    tiles.map(move |tile| {
        if whole {
            return (tile, [u64::MAX; 8]);
        }
        let voxels = grid.voxels_of_tile(tile);
        let local = |corner: VoxelIndex| std::array::from_fn(|k| corner[k].saturating_sub(min[k]));
        (tile, mask_of_box(local(voxels.min), local(voxels.end)))
    })
}

fn and(a: BrickMask, b: BrickMask) -> BrickMask {
    std::array::from_fn(|word| a[word] & b[word])
}

fn ones(mask: BrickMask) -> u64 {
    mask.iter().map(|word| u64::from(word.count_ones())).sum()
}
