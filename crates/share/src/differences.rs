use super::set::{VoxelSet, position_of};
use super::set_range::{SetPosition, SetRange};
use std::collections::BTreeMap;
use voxtile::space::{BrickCode, BrickMask, Grid, MortonCode, TileIndex, VoxelIndex, add_to_mask};

/// A brick of a tile, in the order of a set.
pub(super) type BrickPlace = (TileIndex, BrickCode);

/// The voxels of a part of a set, as bricks: as many as come in a packet. None by default.
#[derive(Default)]
pub(super) struct Content(BTreeMap<BrickPlace, BrickMask>);

/// A brick that differs from a set.
pub(super) struct Difference {
    pub(super) place: BrickPlace,
    /// The right voxels.
    pub(super) after: BrickMask,
    /// The voxels that differ.
    pub(super) differing: BrickMask,
}

impl Content {
    /// The bricks of some voxels; `None` if one lies outside the range.
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

    /// The bricks of a range that differ from a set, from `first` on, in order, at most `most`.
    pub(super) fn differences(
        &self,
        set: &VoxelSet,
        from: BrickPlace,
        range: SetRange,
        most: usize,
    ) -> Vec<Difference> {
        let last = brick_at(range.last);
        if from > last {
            return Vec::new();
        }
        let mut theirs = self.0.range(from..=last).map(|(&place, &mask)| (place, mask)).peekable();
        let mut own = set.bricks_between(from, last).peekable();
        let mut found = Vec::new();
        while found.len() < most {
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

/// The brick that holds a position.
pub(super) fn brick_at(position: SetPosition) -> BrickPlace {
    (position.tile, MortonCode(position.code).brick())
}

/// The voxels of a brick that lie in a range.
fn mask_inside(range: SetRange, (tile, brick): BrickPlace) -> BrickMask {
    let contains = |place| range.contains(SetPosition { tile, code: brick.voxel(place).0 });
    if contains(0) && contains(511) {
        return [u64::MAX; 8];
    }
    let mut mask = [0; 8];
    (0..512).filter(|&place| contains(place)).for_each(|place| add_to_mask(&mut mask, place));
    mask
}
