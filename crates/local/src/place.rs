use voxtile::space::VoxelIndex;
pub(super) use voxtile::space::ones;

/// Returns the position (0 to 63) of a cell among the 4 x 4 x 4 cells of its parent, from the lowest two bits of each
/// index.
#[inline]
pub(super) fn place_of([x, y, z]: VoxelIndex) -> usize {
    (x & 3 | (y & 3) << 2 | (z & 3) << 4) as usize
}

/// Returns the cell at a position of its parent.
#[inline]
pub(super) fn cell_at(parent: VoxelIndex, place: usize) -> VoxelIndex {
    let place = place as i32;
    [parent[0] << 2 | place & 3, parent[1] << 2 | place >> 2 & 3, parent[2] << 2 | place >> 4]
}

/// Moves each position `p` of a mask to `p ^ flip`, where `flip` combines 3 (x), 12 (y) and 48 (z): mirrors the mask
/// along these axes.
#[inline]
pub(super) fn mirrored(mut mask: u64, flip: usize) -> u64 {
    let swap = |mask: u64, low: u64, by: u32| (mask >> by & low) | (mask & low) << by;
    if flip & 3 != 0 {
        mask = swap(swap(mask, 0x5555_5555_5555_5555, 1), 0x3333_3333_3333_3333, 2);
    }
    if flip & 12 != 0 {
        mask = swap(swap(mask, 0x0f0f_0f0f_0f0f_0f0f, 4), 0x00ff_00ff_00ff_00ff, 8);
    }
    if flip & 48 != 0 {
        mask = swap(mask, 0x0000_ffff_0000_ffff, 16).rotate_left(32);
    }
    mask
}

/// Returns the mask of a box, given by its first and last index (0 to 3) along each axis. The mask is empty if a first
/// index exceeds the last one.
#[inline]
pub(super) fn in_box(x: (usize, usize), y: (usize, usize), z: (usize, usize)) -> u64 {
    RANGES[0][x.0][x.1] & RANGES[1][y.0][y.1] & RANGES[2][z.0][z.1]
}

/// Masks by axis, first and last layer (inclusive).
static RANGES: [[[u64; 4]; 4]; 3] = ranges();

const fn ranges() -> [[[u64; 4]; 4]; 3] {
    let mut ranges = [[[0; 4]; 4]; 3];
    let mut case = 0;
    while case < 3 * 4 * 4 * 64 {
        let (axis, first, last, place) = (case >> 10, case >> 8 & 3, case >> 6 & 3, case & 63);
        let at = place >> (2 * axis) & 3;
        ranges[axis][first][last] |= ((first <= at && at <= last) as u64) << place;
        case += 1;
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrored_masks_and_box_masks_equal_naive_ones() {
        let mask = 0x0123_4567_89ab_cdef_u64 ^ 1 << 40;
        for flip in (0..8).map(|octant| (0..3).map(|k| ((octant >> k & 1) * 3) << (2 * k)).sum::<usize>()) {
            let naive = ones(mask).fold(0_u64, |moved, place| moved | 1 << (place ^ flip));
            assert_eq!(mirrored(mask, flip), naive, "{flip}");
        }
        let is_in = |(first, last): (usize, usize), at: i32| (first..=last).contains(&(at as usize));
        let ends = || (0..4).flat_map(|first| (0..4).map(move |last| (first, last)));
        for (x, y, z) in ends().flat_map(|x| ends().flat_map(move |y| ends().map(move |z| (x, y, z)))) {
            let inside = |place: &usize| {
                let [a, b, c] = cell_at([0; 3], *place);
                is_in(x, a) && is_in(y, b) && is_in(z, c)
            };
            let naive = (0..64).filter(inside).fold(0_u64, |mask, place| mask | 1 << place);
            assert_eq!(in_box(x, y, z), naive);
        }
    }
}
