use crate::space::BrickMask;

/// Voxels of one brick as slabs along an axis: word `k` holds the voxels whose index along the axis is `k` in the
/// brick. A voxel's bit in its word is the Morton code of its indices along the two other axes.
///
/// A ray whose longest part is along the axis meets at most three voxels of a slab, neighbours of each other: they
/// are marked by one operation on one word, and consecutive slabs do not wait for each other.
pub(super) type Slabs = [u64; 8];

/// The bit of a voxel in its slab: `b` and `c` are its indices along the other axes, the lower axis first.
#[inline]
pub(super) fn slab_bit(b: u32, c: u32) -> u64 {
    /// Bits of a number below 8, every second bit left free.
    const SPREAD: [u8; 8] = [0, 1, 4, 5, 16, 17, 20, 21];
    1 << (SPREAD[(b & 7) as usize] | SPREAD[(c & 7) as usize] << 1)
}

/// Adds the voxels of slabs along `AXIS` to a mask in Morton order.
///
/// A bit of a slab has the number `b0 c0 b1 c1 b2 c2` (lowest first), a place of a mask `x0 y0 z0 x1 y1 z1 x2 y2 z2`:
/// the slab's own index goes in between, bit by bit.
pub(super) fn add_slabs<const AXIS: usize>(slabs: &Slabs, mask: &mut BrickMask) {
    // Most bricks are met along one axis.
    if *slabs == [0; 8] {
        return;
    }
    for (slab, &word) in slabs.iter().enumerate() {
        let (low, middle, high) = (slab & 1, slab >> 1 & 1, slab >> 2);
        let shift = (low + 8 * middle) << AXIS;
        for quarter in 0..4 {
            let bits = (word >> (16 * quarter)) as u16;
            mask[between::<AXIS>(quarter, high)] |= spread::<AXIS>(bits) << shift;
        }
    }
}

/// Two bits of the other axes with a bit of the axis put where it belongs.
const fn between<const AXIS: usize>(others: usize, own: usize) -> usize {
    let below = others & ((1 << AXIS) - 1);
    below | own << AXIS | (others >> AXIS) << (AXIS + 1)
}

/// Sixteen bits with gaps for two bits of the axis: bits `0..4` of a byte of eight, bytes `0..4` of a word of eight.
fn spread<const AXIS: usize>(bits: u16) -> u64 {
    let mut bits = u64::from(bits);
    // A byte for every four bits.
    bits = (bits | bits << 8) & 0x00ff_00ff;
    bits = (bits | bits << 4) & 0x0f0f_0f0f;
    if AXIS < 2 {
        bits = (bits | bits << 2) & 0x3333_3333;
        bits = (bits | bits << 16) & 0x0000_ffff_0000_ffff;
    }
    if AXIS < 1 {
        bits = (bits | bits << 1) & 0x0000_5555_0000_5555;
        bits = (bits | bits << 8) & 0x00ff_00ff_00ff_00ff;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::place_of_voxel;

    fn check<const AXIS: usize>() {
        let [b, c] = [[1, 2], [0, 2], [0, 1]][AXIS];
        for place in 0..512 {
            let voxel = [place & 7, place >> 3 & 7, place >> 6];
            let mut slabs = [0; 8];
            slabs[voxel[AXIS] as usize] = slab_bit(voxel[b] as u32, voxel[c] as u32);
            let mut mask = [0; 8];
            add_slabs::<AXIS>(&slabs, &mut mask);
            let mut expected = [0; 8];
            let place = place_of_voxel(voxel);
            expected[place / 64] = 1 << (place % 64);
            assert_eq!(mask, expected, "axis {AXIS}, voxel {voxel:?}");
        }
        let mut full = [0; 8];
        add_slabs::<AXIS>(&[u64::MAX; 8], &mut full);
        assert_eq!(full, [u64::MAX; 8]);
    }

    #[test]
    fn every_voxel_of_a_slab_goes_to_its_place() {
        check::<0>();
        check::<1>();
        check::<2>();
    }
}
