use super::ScanReport;
use super::brick_map::BrickMap;
use super::marked_brick::MarkedBrick;
use super::slab_walk::SlabRay;
use super::tile_order::{brick_code, bricks_by_tile, in_order_of_tiles, part_in_tile};
use super::updates::{BrickUpdate, ScanUpdates, TileUpdates};
use super::window::Window;
use crate::space::{BrickMask, Grid, TileIndex, VoxelIndex, place_of_voxel, places};
use rayon::prelude::*;

/// Collects what one scan says about voxels, each once: a hit over any miss, and of its hits the largest intensity.
#[derive(Clone, Debug, Default)]
pub(super) struct OnceCollector {
    bricks: BrickMap<MarkedBrick>,
    /// The intensity of every hit; empty for sensor models that need none.
    intensities: Vec<HitIntensity>,
}

#[derive(Clone, Copy, Debug)]
struct HitIntensity {
    slot: u32,
    place: u16,
    intensity: f32,
}

impl OnceCollector {
    /// Forgets everything, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.bricks.clear(window);
        self.intensities.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.bricks.bytes() + self.intensities.capacity() * size_of::<HitIntensity>()
    }

    /// A ray passes all voxels before its last.
    pub(super) fn pass(&mut self, ray: &SlabRay) {
        ray.pass(&mut self.bricks);
    }

    /// A ray ends in a voxel.
    pub(super) fn hit(&mut self, voxel: VoxelIndex, intensity: Option<f32>) {
        let (slot, place) = (self.bricks.slot_of(voxel), place_of_voxel(voxel));
        self.bricks.bricks_mut()[slot].hits[place / 64] |= 1 << (place % 64);
        if let Some(intensity) = intensity {
            self.intensities.push(HitIntensity { slot: slot as u32, place: place as u16, intensity });
        }
    }

    /// Adds what another collector with the same window has seen.
    pub(super) fn absorb(&mut self, other: &Self) {
        let mut slots = Vec::with_capacity(other.bricks.bricks().len());
        for (brick, index) in other.bricks.bricks().iter().zip(other.bricks.indices()) {
            let slot = self.bricks.slot_of(index.map(|k| k * 8));
            self.bricks.bricks_mut()[slot].absorb(brick);
            slots.push(slot as u32);
        }
        let renumbered =
            other.intensities.iter().map(|hit| HitIntensity { slot: slots[hit.slot as usize], ..*hit });
        self.intensities.extend(renumbered);
    }

    /// The updates, each brick cut at the borders of the tiles.
    pub(super) fn updates(&mut self, grid: &Grid, mut report: ScanReport) -> ScanUpdates {
        self.bricks.bricks_mut().par_iter_mut().with_min_len(1024).for_each(MarkedBrick::finish);
        // The largest of a voxel comes first.
        self.intensities.sort_unstable_by(|a, b| {
            (a.slot, a.place).cmp(&(b.slot, b.place)).then(b.intensity.total_cmp(&a.intensity))
        });
        self.intensities.dedup_by_key(|hit| (hit.slot, hit.place));
        let this = &*self;
        let updates = bricks_by_tile(grid, this.bricks.indices())
            .into_par_iter()
            .map(|(tile, slots)| (tile, this.updates_of_tile(grid, tile, &slots)));
        let mut tiles: Vec<(TileIndex, Vec<BrickUpdate>)> = updates.collect();
        tiles.retain(|(_, bricks)| !bricks.is_empty());
        for brick in tiles.iter().flat_map(|(_, bricks)| bricks) {
            report.hits += ones(&brick.hits);
            report.misses += ones(&brick.misses);
        }
        let tiles = tiles.into_iter().map(|(tile, bricks)| (tile, TileUpdates::Once(bricks))).collect();
        in_order_of_tiles(grid, tiles, report)
    }

    fn updates_of_tile(&self, grid: &Grid, tile: TileIndex, slots: &[u32]) -> Vec<BrickUpdate> {
        let update = |&slot: &u32| {
            let index = self.bricks.indices()[slot as usize];
            let brick = &self.bricks.bricks()[slot as usize];
            let (mut hits, mut misses) = (brick.hits, brick.passed());
            let part = part_in_tile(grid, tile, index);
            for word in 0..8 {
                hits[word] &= part[word];
                misses[word] &= part[word] & !hits[word];
            }
            let is_empty = hits == [0; 8] && misses == [0; 8];
            let intensities = || self.intensities_of(slot, &hits);
            (!is_empty).then(|| BrickUpdate {
                brick: brick_code(index),
                hits,
                misses,
                intensities: intensities(),
            })
        };
        slots.iter().filter_map(update).collect()
    }

    /// The intensities of the given hits of a brick, in the order of the mask.
    fn intensities_of(&self, slot: u32, hits: &BrickMask) -> Box<[f32]> {
        if self.intensities.is_empty() {
            return Box::default();
        }
        let start = self.intensities.partition_point(|hit| hit.slot < slot);
        let of_brick = self.intensities[start..].iter().take_while(|hit| hit.slot == slot);
        let mut wanted = places(*hits).peekable();
        of_brick
            .filter(|hit| wanted.next_if_eq(&usize::from(hit.place)).is_some())
            .map(|hit| hit.intensity)
            .collect()
    }
}

fn ones(mask: &BrickMask) -> u64 {
    mask.iter().map(|word| u64::from(word.count_ones())).sum()
}
