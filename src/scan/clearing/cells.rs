//! Sets in Morton order, and their neighbors.
//!
//! A block is a set of 4 x 4 x 4 items in Morton order, one bit per item: the voxels of a word of a brick, or the cells
//! of 2 x 2 x 2 voxels of a whole brick. An octet is a set of 2 x 2 x 2 items.

use crate::space::BrickMask;

/// Items of a block whose index along each axis is 0, 1, 2 or 3.
const LAYERS: [[u64; 4]; 3] = layers();

const fn layers() -> [[u64; 4]; 3] {
    let mut layers = [[0; 4]; 3];
    let mut place = 0;
    while place < 64 {
        let mut axis = 0;
        while axis < 3 {
            let index = (place >> axis & 1) | (place >> (axis + 3) & 1) << 1;
            layers[axis][index] |= 1 << place;
            axis += 1;
        }
        place += 1;
    }
    layers
}

/// Returns the items whose lower neighbor along an axis is in the set. `lower` is the block below.
#[inline]
pub(super) fn above<const AXIS: usize>(block: u64, lower: u64) -> u64 {
    let [first, second, third, last] = LAYERS[AXIS];
    (block & (first | third)) << (1 << AXIS) | (block & second) << (7 << AXIS) | (lower & last) >> (9 << AXIS)
}

/// Returns the items whose upper neighbor along an axis is in the set. `upper` is the block above.
#[inline]
fn below<const AXIS: usize>(block: u64, upper: u64) -> u64 {
    let [first, second, third, last] = LAYERS[AXIS];
    (block & (second | last)) >> (1 << AXIS) | (block & third) >> (7 << AXIS) | (upper & first) << (9 << AXIS)
}

/// Returns the items of a block that are in the set with their two neighbors along an axis.
#[inline]
fn between<const AXIS: usize>(block: u64, lower: u64, upper: u64) -> u64 {
    above::<AXIS>(block, lower) & below::<AXIS>(block, upper)
}

/// Returns the items of a block that are in the set or have a neighbor along an axis that is.
#[inline]
pub(super) fn dilated_block<const AXIS: usize>(block: u64, lower: u64, upper: u64) -> u64 {
    block | above::<AXIS>(block, lower) | below::<AXIS>(block, upper)
}

/// Returns on which sides along each axis a block has items whose neighbors are in other blocks: below, above.
#[inline]
pub(super) fn sides_of(block: u64) -> [[bool; 2]; 3] {
    LAYERS.map(|[lower, _, _, upper]| [block & lower != 0, block & upper != 0])
}

/// Adds the items of a block whose lower neighbor along an axis is in the set. Takes and returns the block and the block
/// below.
#[inline]
pub(super) fn lower_step<const AXIS: usize>((block, lower): (u64, u64), _: i32) -> (u64, u64) {
    (block | above::<AXIS>(block, lower), lower | above::<AXIS>(lower, 0))
}

/// As [`lower_step`], with the upper neighbor and the block above.
#[inline]
pub(super) fn upper_step<const AXIS: usize>((block, upper): (u64, u64), _: i32) -> (u64, u64) {
    (block | below::<AXIS>(block, upper), upper | below::<AXIS>(upper, 0))
}

/// Returns the items of a block whose six neighbors are in the set, and which are in it themselves. `around` are the
/// blocks below and above along each axis.
#[inline]
pub(super) fn eroded_block(block: u64, around: &[[u64; 2]; 3]) -> u64 {
    let [[x0, x1], [y0, y1], [z0, z1]] = *around;
    block & between::<0>(block, x0, x1) & between::<1>(block, y0, y1) & between::<2>(block, z0, z1)
}

/// As [`eroded_block`], for octets.
#[inline]
pub(super) fn eroded_octet(octet: u8, around: &[[u8; 2]; 3]) -> u8 {
    const LOW: [u8; 3] = [0x55, 0x33, 0x0f];
    (0..3).fold(octet, |eroded, axis| {
        let ([lower, upper], low, step) = (around[axis], LOW[axis], 1 << axis);
        let above = (octet & low) << step | (lower & !low) >> step;
        let below = (octet & !low) >> step | (upper & low) << step;
        eroded & above & below
    })
}

/// Returns the voxels of a brick that are in the set with their two neighbors along an axis. `lower` and `upper` are
/// the bricks below and above.
#[inline]
pub(super) fn between_voxels<const AXIS: usize>(
    brick: &BrickMask,
    lower: &BrickMask,
    upper: &BrickMask,
) -> BrickMask {
    let mut found = [0; 8];
    for word in 0..8 {
        // Bit `AXIS` of a word's number is its position along the axis.
        let other = word ^ 1 << AXIS;
        let (lower, upper) =
            if word >> AXIS & 1 == 1 { (brick[other], upper[other]) } else { (lower[other], brick[other]) };
        found[word] = between::<AXIS>(brick[word], lower, upper);
    }
    found
}

/// Returns the voxels of a brick that are in the set or have a neighbor along an axis that is.
#[inline]
pub(super) fn dilated<const AXIS: usize>(
    brick: &BrickMask,
    lower: &BrickMask,
    upper: &BrickMask,
) -> BrickMask {
    let mut found = [0; 8];
    for word in 0..8 {
        let other = word ^ 1 << AXIS;
        let (lower, upper) =
            if word >> AXIS & 1 == 1 { (brick[other], upper[other]) } else { (lower[other], brick[other]) };
        found[word] = dilated_block::<AXIS>(brick[word], lower, upper);
    }
    found
}

/// Returns the cells of 2 x 2 x 2 voxels with at least one voxel of a brick's set.
#[inline]
pub(super) fn cells_of(brick: &BrickMask) -> u64 {
    (0..8).fold(0, |cells, word| cells | u64::from(octets_of(brick[word])) << (8 * word))
}

/// Returns the octets of a block that have at least one item, as an octet.
#[inline]
pub(super) fn octets_of(block: u64) -> u8 {
    const ONES: u64 = 0x0101_0101_0101_0101;
    // The lowest bit of each byte: whether any bit of the byte is set.
    let mut any = block | block >> 4;
    any |= any >> 2;
    any = (any | any >> 1) & ONES;
    // Gathers these bits in the upper byte.
    (any.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u8
}

/// Returns the block with all items of these octets.
#[inline]
pub(super) fn block_of_octets(octets: u8) -> u64 {
    // Bit `k` to the lowest bit of byte `k`.
    let low = u64::from(octets & 0x7f) * 0x0408_1020_4081;
    let spread = low & 0x0001_0101_0101_0101 | u64::from(octets >> 7) << 56;
    spread * 0xff
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{is_in_mask, place_of_voxel};
    use proptest::prelude::*;

    fn place([x, y, z]: [i32; 3]) -> u32 {
        place_of_voxel([x, y, z]) as u32
    }

    /// Returns whether an item is in a row of sets along an axis: of the lower, the middle or the upper one.
    fn is_in(sets: [u64; 3], edge: i32, axis: usize, mut item: [i32; 3]) -> bool {
        let set = (item[axis].div_euclid(edge) + 1) as usize;
        item[axis] = item[axis].rem_euclid(edge);
        sets[set] >> place(item) & 1 == 1
    }

    proptest! {
        #[test]
        fn eroded_sets_are_those_with_all_six_neighbors(
            block: u64,
            around: [[u64; 2]; 3],
            dense in 0..3_u32,
        ) {
            // Random sets rarely have seven adjacent items.
            let fill = |set: u64| if dense > 0 { set | set.rotate_left(dense) | set.rotate_right(13) } else { set };
            let (block, around) = (fill(block), around.map(|pair| pair.map(fill)));
            let naive = |edge: i32, item: [i32; 3], block: u64, around: [[u64; 2]; 3]| {
                block >> place(item) & 1 == 1
                    && (0..3).all(|axis| {
                        [-1, 1].iter().all(|step| {
                            let mut next = item;
                            next[axis] += step;
                            is_in([around[axis][0], block, around[axis][1]], edge, axis, next)
                        })
                    })
            };
            let eroded = eroded_block(block, &around);
            let octet = eroded_octet(block as u8, &around.map(|pair| pair.map(|set| set as u8)));
            for x in 0..4 {
                for y in 0..4 {
                    for z in 0..4 {
                        let item = [x, y, z];
                        let is_in = eroded >> place(item) & 1 == 1;
                        prop_assert_eq!(is_in, naive(4, item, block, around));
                        if x < 2 && y < 2 && z < 2 {
                            prop_assert_eq!(octet >> place(item) & 1 == 1, naive(2, item, block, around));
                        }
                    }
                }
            }
        }

        #[test]
        fn sets_of_voxels_are_eroded_and_dilated_across_bricks(bricks: [[u64; 8]; 3]) {
            let [lower, middle, upper] = bricks;
            let found = [
                between_voxels::<0>(&middle, &lower, &upper),
                between_voxels::<1>(&middle, &lower, &upper),
                between_voxels::<2>(&middle, &lower, &upper),
            ];
            let wider = [
                dilated::<0>(&middle, &lower, &upper),
                dilated::<1>(&middle, &lower, &upper),
                dilated::<2>(&middle, &lower, &upper),
            ];
            for axis in 0..3 {
                for code in 0..512 {
                    let voxel = [code & 7, code >> 3 & 7, code >> 6];
                    let steps = |voxel: [i32; 3]| [-1, 1].into_iter().map(move |step| {
                        let mut next = voxel;
                        next[axis] += step;
                        let brick = (next[axis].div_euclid(8) + 1) as usize;
                        next[axis] = next[axis].rem_euclid(8);
                        is_in_mask(&bricks[brick], place_of_voxel(next))
                    });
                    let expected = steps(voxel).all(|is_in| is_in);
                    prop_assert_eq!(is_in_mask(&found[axis], place_of_voxel(voxel)), expected);
                    let any = is_in_mask(&middle, place_of_voxel(voxel)) || steps(voxel).any(|is_in| is_in);
                    prop_assert_eq!(is_in_mask(&wider[axis], place_of_voxel(voxel)), any);
                }
            }
        }

        #[test]
        fn octets_and_blocks_correspond(block: u64, octets: u8) {
            let bytes = block.to_le_bytes();
            let expected = (0..8).fold(0, |set, k| set | u8::from(bytes[k] != 0) << k);
            prop_assert_eq!(octets_of(block), expected);
            prop_assert_eq!(octets_of(block_of_octets(octets)), octets);
            prop_assert!(block_of_octets(octets).to_le_bytes().iter().all(|byte| [0, 0xff].contains(byte)));
        }
    }
}
