use super::ScanReport;
use super::block_map::BlockMap;
use super::counted_brick::CountedBrick;
use super::slab_ray::SlabRay;
use super::tile_order::{brick_code, bricks_by_tile, in_order_of_tiles, part_in_tile};
use super::updates::{BrickRuns, Run, ScanUpdates, TileUpdates};
use super::window::Window;
use crate::space::{BrickMask, Grid, TileIndex, VoxelIndex, place_of_voxel};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Collects what consecutive rays of a scan say about voxels, where every ray counts.
///
/// A voxel's updates are kept as runs: so many misses, then a hit. That is their order, and all of it: what rays say
/// about other voxels in between makes no difference.
#[derive(Clone, Debug, Default)]
pub(super) struct EveryRayCollector {
    bricks: BlockMap<CountedBrick>,
    /// The runs that a hit has ended, in order.
    ended: Vec<(u32, Run)>,
}

impl EveryRayCollector {
    /// Forgets everything, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.bricks.clear(window);
        self.ended.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.bricks.bytes() + self.ended.capacity() * size_of::<(u32, Run)>()
    }

    /// A ray passes all voxels before its last. At most [`MAX_RAYS`](super::counted_brick::MAX_RAYS) of them.
    pub(super) fn pass(&mut self, ray: &SlabRay) {
        let mut far = Vec::new();
        ray.pass(&mut self.bricks, 0, false, |voxel| far.push(voxel));
        for voxel in far {
            let slot = self.bricks.slot_of(voxel);
            self.bricks.blocks_mut()[slot].passes[place_of_voxel(voxel)] += 1;
        }
    }

    /// A ray ends in a voxel, with an intensity if it matters.
    pub(super) fn hit(&mut self, voxel: VoxelIndex, intensity: f32) {
        let (slot, place) = (self.bricks.slot_of(voxel), place_of_voxel(voxel));
        let misses = std::mem::take(&mut self.bricks.blocks_mut()[slot].passes[place]);
        self.ended.push((slot as u32, Run { place: place as u16, misses, hit: Some(intensity) }));
    }

    /// The updates by tile, each brick cut at the borders of the tiles, and how many hits and misses they are.
    fn runs_by_tile(&mut self, grid: &Grid) -> Vec<(TileIndex, Vec<BrickRuns>)> {
        // Stable: a voxel's runs stay in order.
        self.ended.sort_by_key(|&(slot, run)| (slot, run.place));
        let this = &*self;
        let runs_of_tile = |(tile, slots): (TileIndex, Vec<u32>)| {
            let runs_of_brick = |slot: u32| {
                let index = this.bricks.indices()[slot as usize];
                let runs = this.runs_of_brick(slot, &part_in_tile(grid, tile, index));
                (!runs.is_empty()).then(|| BrickRuns { brick: brick_code(index), runs })
            };
            (tile, slots.into_iter().filter_map(runs_of_brick).collect())
        };
        bricks_by_tile(grid, this.bricks.indices()).into_par_iter().map(runs_of_tile).collect()
    }

    fn runs_of_brick(&self, slot: u32, part: &BrickMask) -> Box<[Run]> {
        let start = self.ended.partition_point(|&(other, _)| other < slot);
        let ended = self.ended[start..].iter().take_while(|&&(other, _)| other == slot);
        let mut ended = ended.map(|(_, run)| run).filter(|run| is_in(part, run.place)).peekable();
        let passes = &self.bricks.blocks()[slot as usize].passes;
        let mut runs = Vec::with_capacity(passes.iter().filter(|&&misses| misses > 0).count() + 8);
        // Most voxels were not passed: eight at a time are passed over.
        for (chunk, first) in passes.chunks_exact(8).zip((0..).step_by(8)) {
            if chunk.iter().fold(0, |any, misses| any | misses) == 0 {
                continue;
            }
            for (&misses, place) in chunk.iter().zip(first..) {
                if misses > 0 && is_in(part, place) {
                    runs.extend(std::iter::from_fn(|| ended.next_if(|run| run.place <= place)));
                    runs.push(Run { place, misses, hit: None });
                }
            }
        }
        runs.extend(ended);
        runs.into()
    }
}

fn is_in(mask: &BrickMask, place: u16) -> bool {
    mask[usize::from(place) / 64] >> (place % 64) & 1 == 1
}

/// The updates of several collectors, the first of which saw the first rays.
pub(super) fn updates_in_order(
    grid: &Grid,
    collectors: &mut [EveryRayCollector],
    mut report: ScanReport,
) -> ScanUpdates {
    let mut tiles: FxHashMap<TileIndex, Vec<BrickRuns>> = FxHashMap::default();
    for collector in collectors {
        for (tile, runs) in collector.runs_by_tile(grid) {
            for run in runs.iter().flat_map(|brick| &brick.runs) {
                report.misses += u64::from(run.misses);
                report.hits += u64::from(run.hit.is_some());
            }
            if !runs.is_empty() {
                tiles.entry(tile).or_default().extend(runs);
            }
        }
    }
    let in_order = |(tile, mut bricks): (TileIndex, Vec<BrickRuns>)| {
        // Stable: of the same brick, the runs of earlier rays come first.
        bricks.sort_by_key(|runs| runs.brick);
        (tile, TileUpdates::Runs(bricks))
    };
    in_order_of_tiles(grid, tiles.into_iter().map(in_order).collect(), report)
}
