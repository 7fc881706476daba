use super::set::{VoxelSet, position_of};
use super::set_range::{SetPosition, SetRange};
use std::collections::BTreeMap;
use voxtile::space::{BrickCode, BrickMask, Grid, MortonCode, TileIndex, VoxelIndex, add_to_mask};

/// Tile and brick; sorts in the order of a set.
pub(super) type BrickPlace = (TileIndex, BrickCode);

/// Voxels of a content packet, as bricks. Empty by default.
#[derive(Default)]
pub(super) struct Content(BTreeMap<BrickPlace, BrickMask>);

/// Brick that differs between a content packet and a set.
pub(super) struct Difference {
    pub(super) place: BrickPlace,
    /// Voxels of the brick in the packet.
    pub(super) after: BrickMask,
    /// Voxels that differ.
    pub(super) differing: BrickMask,
}

impl Content {
    /// Groups voxels by brick. Returns `None` if a voxel is outside the range.
    pub(super) fn new(grid: &Grid, range: SetRange, voxels: &[VoxelIndex]) -> Option<Self> {
        let mut bricks = BTreeMap::new();
        for &voxel in voxels {
            let position = position_of(grid, voxel);
            if !range.contains(position) {
                return None;
            }
            let code = MortonCode(position.code);
            let mask: &mut BrickMask = bricks.entry((position.tile, code.brick())).or_default();
            mask[code.place_in_brick() / 64] |= 1 << (code.place_in_brick() % 64);
        }
        Some(Self(bricks))
    }

    /// Returns the bricks of a range that differ from a set, in order, starting at `from`: at most `limit`.
    pub(super) fn differences(
        &self,
        set: &VoxelSet,
        from: BrickPlace,
        range: SetRange,
        limit: usize,
    ) -> Vec<Difference> {
        let last = brick_at(range.last);
        if from > last {
            return Vec::new();
        }
        let mut theirs = self.0.range(from..=last).map(|(&place, &mask)| (place, mask)).peekable();
        let mut own = set.bricks_between(from, last).peekable();
        let mut found = Vec::new();
        while found.len() < limit {
            let places =
                own.peek().map(|(place, _)| *place).into_iter().chain(theirs.peek().map(|next| next.0));
            let Some(place) = places.min() else { break };
            let before = own.next_if(|next| next.0 == place).map_or([0; 8], |(_, mask)| mask);
            let after = theirs.next_if(|next| next.0 == place).map_or([0; 8], |(_, mask)| mask);
            let inside = mask_inside(range, place);
            let differing: BrickMask = std::array::from_fn(|k| (before[k] ^ after[k]) & inside[k]);
            if differing != [0; 8] {
                found.push(Difference { place, after, differing });
            }
        }
        found
    }
}

/// Returns the brick of a position.
pub(super) fn brick_at(position: SetPosition) -> BrickPlace {
    (position.tile, MortonCode(position.code).brick())
}

/// Returns the mask of a brick's voxels in a range.
fn mask_inside(range: SetRange, (tile, brick): BrickPlace) -> BrickMask {
    let contains = |place| range.contains(SetPosition { tile, code: brick.voxel(place).0 });
    if contains(0) && contains(511) {
        return [u64::MAX; 8];
    }
    let mut mask = [0; 8];
    (0..512).filter(|&place| contains(place)).for_each(|place| add_to_mask(&mut mask, place));
    mask
}
