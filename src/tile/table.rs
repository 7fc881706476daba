use super::brick::Brick;
use crate::sensor::Evidence;
use crate::space::{BrickCode, BrickMask, MortonCode};
use rustc_hash::FxHashMap;

/// The exact evidence of every observed voxel of a tile: the truth, from which all else is derived.
///
/// Laid out in bricks of 8 x 8 x 8 voxels: about 12 bytes an observed voxel and 150 a brick.
#[derive(Clone, Debug, Default)]
pub struct Table {
    bricks: FxHashMap<BrickCode, Brick>,
    len: usize,
    /// Bytes of the bricks' arrays; the hash map's own are added in [`Table::bytes`].
    brick_bytes: usize,
}

impl Table {
    /// Number of observed voxels.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no voxel was observed.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        // A slot of the hash map and its control byte; the map fills up to 7 of 8 slots.
        let slot = size_of::<(BrickCode, Brick)>() + 1;
        self.bricks.capacity() * 8 / 7 * slot + self.brick_bytes
    }

    /// The evidence of a voxel; `None` if it was never observed.
    pub fn get(&self, code: MortonCode) -> Option<Evidence> {
        self.bricks.get(&code.brick())?.get(code.place_in_brick())
    }

    /// Whether any voxel of a brick was observed.
    pub fn has_brick(&self, brick: BrickCode) -> bool {
        self.bricks.contains_key(&brick)
    }

    /// Replaces the evidence of the voxels of `touched`, in Morton order, by what `update` makes of a voxel's
    /// place in the brick and its evidence so far.
    pub fn update_brick(
        &mut self,
        brick: BrickCode,
        touched: BrickMask,
        update: impl FnMut(usize, Option<Evidence>) -> Evidence,
    ) {
        let brick = self.bricks.entry(brick).or_default();
        let (len, bytes) = (brick.len(), brick.heap_bytes());
        brick.update(touched, update);
        self.len += brick.len() - len;
        self.brick_bytes += brick.heap_bytes() - bytes;
    }

    /// Replaces the evidence of one voxel.
    pub fn update(&mut self, code: MortonCode, mut update: impl FnMut(Option<Evidence>) -> Evidence) {
        let place = code.place_in_brick();
        let mut touched = [0; 8];
        touched[place / 64] = 1 << (place % 64);
        self.update_brick(code.brick(), touched, |_, before| update(before));
    }

    /// The bricks that hold an observed voxel, in Morton order.
    pub fn bricks(&self) -> impl Iterator<Item = BrickCode> {
        let mut codes: Vec<BrickCode> = self.bricks.keys().copied().collect();
        codes.sort_unstable();
        codes.into_iter()
    }

    /// The observed voxels of one brick, in Morton order.
    pub fn voxels_of_brick(&self, brick: BrickCode) -> impl Iterator<Item = (MortonCode, Evidence)> {
        let voxels = self.bricks.get(&brick).map(Brick::iter).into_iter().flatten();
        voxels.map(move |(place, evidence)| (brick.voxel(place), evidence))
    }

    /// The observed voxels in Morton order.
    pub fn iter(&self) -> impl Iterator<Item = (MortonCode, Evidence)> {
        self.bricks().flat_map(|brick| self.voxels_of_brick(brick))
    }
}
