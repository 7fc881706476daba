use crate::octree::{BrickValues, NodeColour};
use crate::space::{BRICK_EDGE, BrickCode, MortonCode, VoxelBox, VoxelIndex, VoxelKey, place_of_voxel};
use std::ops::Range;

/// Shift of a map's voxels into an octree whose origin is another voxel of the map.
///
/// Indices are subtracted as integers, without rounding.
#[derive(Debug)]
pub(super) struct OctreeShift {
    /// The voxel of the map that has index 0 in the octree.
    origin: VoxelIndex,
    /// Offset within bricks: the position, in a brick of the octree, of the first voxel of a brick of the map.
    first: VoxelIndex,
    /// Parts of one brick of the map in each of the eight overlapping bricks of the octree, by position.
    shares: [Vec<(u16, f32, NodeColour)>; 8],
}

impl OctreeShift {
    pub(super) fn by(origin: VoxelIndex) -> Self {
        let first = origin.map(|index| index.wrapping_neg() & (BRICK_EDGE - 1));
        Self { origin, first, shares: Default::default() }
    }

    /// Converts a box of the map's voxels to indices of the octree. Values beyond `i32` are clamped, because no octree
    /// extends that far.
    pub(super) fn of_box(&self, voxels: &VoxelBox) -> VoxelBox {
        VoxelBox { min: self.of_voxel(voxels.min), end: self.of_voxel(voxels.end) }
    }

    /// Converts a voxel of the map to an index of the octree.
    pub(super) fn of_voxel(&self, voxel: VoxelIndex) -> VoxelIndex {
        std::array::from_fn(|axis| voxel[axis].saturating_sub(self.origin[axis]))
    }

    /// Adds the values of a brick of the map that are in a range of the octree's bricks. `visit` passes the brick's
    /// voxels as position, value and colour, ascending by position.
    pub(super) fn add_brick(
        &mut self,
        brick: BrickCode,
        wanted: &Range<BrickCode>,
        values: &mut BrickValues,
        visit: impl FnOnce(&mut dyn FnMut(usize, f32, NodeColour)),
    ) {
        let first = self.of_key(brick.voxel(0));
        if self.first == [0; 3] {
            let brick = first.brick();
            if wanted.contains(&brick) {
                values.begin(brick);
                visit(&mut |place, value, colour| values.add_coloured(place, value, colour));
                values.end();
            }
            return;
        }
        let bricks: [BrickCode; 8] = std::array::from_fn(|share| neighbour(first, share).brick());
        if !bricks.iter().any(|brick| wanted.contains(brick)) {
            return;
        }
        self.shares.iter_mut().for_each(Vec::clear);
        let (shares, first) = (&mut self.shares, self.first);
        visit(&mut |place, value, colour| {
            let local = local_of(place);
            let shifted: VoxelIndex = std::array::from_fn(|axis| local[axis] + first[axis]);
            let share: i32 = (0..3).map(|axis| (shifted[axis] / BRICK_EDGE) << axis).sum();
            shares[share as usize].push((place_of_voxel(shifted) as u16, value, colour));
        });
        for (share, brick) in self.shares.iter_mut().zip(bricks).filter(|(_, brick)| wanted.contains(brick)) {
            share.sort_unstable_by_key(|&(place, ..)| place);
            values.begin(brick);
            for &(place, value, colour) in share.iter() {
                values.add_coloured(place.into(), value, colour);
            }
            values.end();
        }
    }

    /// Converts a code of the map to one of the octree. Keys repeat every 65536 voxels, which does not affect their
    /// differences.
    fn of_key(&self, code: MortonCode) -> MortonCode {
        let VoxelKey(key) = code.to_key();
        VoxelKey(std::array::from_fn(|axis| key[axis].wrapping_sub(self.origin[axis] as u16))).morton()
    }
}

/// Returns the same voxel in the next brick along the axes whose bits are set in `share`.
fn neighbour(code: MortonCode, share: usize) -> MortonCode {
    let VoxelKey(key) = code.to_key();
    VoxelKey(std::array::from_fn(|axis| {
        key[axis].wrapping_add((share >> axis & 1) as u16 * BRICK_EDGE as u16)
    }))
    .morton()
}

/// Returns the voxel at a position of a brick, relative to the brick's first.
fn local_of(place: usize) -> VoxelIndex {
    MortonCode(place as u64).to_key().0.map(i32::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_are_moved_to_their_shifted_indices() {
        for origin in [[0; 3], [8, -16, 65536], [1, -2, 7], [-63_781_373, 5, 2_000_000_001]] {
            for corner in [[0; 3], [40, -48, 8]] {
                // Voxels close to the octree's origin, which is anywhere in the map.
                let first: VoxelIndex = std::array::from_fn(|k| (origin[k] + corner[k]) & !(BRICK_EDGE - 1));
                let mut shift = OctreeShift::by(origin);
                let mut values = BrickValues::default();
                let all = BrickCode(0)..BrickCode(BrickCode::END);
                shift.add_brick(BrickCode::of_voxel(first), &all, &mut values, |add| {
                    (0..512).for_each(|place| add(place, place as f32, NodeColour::NONE));
                });
                assert_eq!(values.len(), 512);
                let mut found: Vec<(MortonCode, f32)> = values.voxels().collect();
                found.sort_by(|a, b| a.1.total_cmp(&b.1));
                for (place, (code, _)) in found.into_iter().enumerate() {
                    let voxel: VoxelIndex =
                        std::array::from_fn(|k| first[k] + local_of(place)[k] - origin[k]);
                    assert_eq!(code, VoxelKey::from_index(voxel).morton(), "{origin:?} {voxel:?}");
                }
            }
        }
    }
}
