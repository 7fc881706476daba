use crate::extent::Extent;
use voxtile::VoxelIndex;
use voxtile::space::{BrickMask, places};

/// Number of voxels of a brick up to which they are changed one by one.
const FEW_VOXELS: u32 = 24;

/// A bit for each voxel of a box, in rows along x.
#[derive(Clone, Debug)]
pub(crate) struct Bits {
    extent: Extent,
    words_per_row: usize,
    /// Rows by z, then y. Bits beyond the row are 0.
    words: Vec<u64>,
}

impl Bits {
    pub(crate) fn new(extent: Extent) -> Self {
        let words_per_row = Self::words_per_row(extent.size[0]);
        let words = vec![0; words_per_row * extent.size[1] * extent.size[2]];
        Self { extent, words_per_row, words }
    }

    pub(crate) fn words_per_row(edge: usize) -> usize {
        edge.div_ceil(64)
    }

    pub(crate) fn extent(&self) -> Extent {
        self.extent
    }

    pub(crate) fn clear(&mut self) {
        self.words.fill(0);
    }

    #[inline]
    pub(crate) fn row(&self, y: usize, z: usize) -> &[u64] {
        let first = (z * self.extent.size[1] + y) * self.words_per_row;
        &self.words[first..first + self.words_per_row]
    }

    /// Inverts the bit of a voxel; ignores voxels outside of the box.
    pub(crate) fn toggle(&mut self, voxel: VoxelIndex) {
        if let Some([x, y, z]) = self.extent.place_of(voxel) {
            self.words[(z * self.extent.size[1] + y) * self.words_per_row + x / 64] ^= 1 << (x % 64);
        }
    }

    /// Inverts the bits of a brick's voxels; ignores voxels outside of the box. Reports each changed row as (y, z).
    #[inline]
    pub(crate) fn toggle_brick(
        &mut self,
        lowest: VoxelIndex,
        mask: &BrickMask,
        mut changed: impl FnMut(usize, usize),
    ) {
        let Extent { min, size } = self.extent;
        if mask.iter().map(|word| word.count_ones()).sum::<u32>() <= FEW_VOXELS {
            return self.toggle_few(lowest, mask, changed);
        }
        let from: [i64; 3] = std::array::from_fn(|k| i64::from(lowest[k]) - min[k]);
        // Four octants along y and z, each with one or two words along x.
        for (quarter, [y4, z4]) in [[0, 0], [1, 0], [0, 1], [1, 1]].into_iter().enumerate() {
            let [low, high] = [mask[2 * quarter], mask[2 * quarter + 1]];
            if low | high == 0 {
                continue;
            }
            for (dz, dy) in [(0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2), (1, 3)]
                .into_iter()
                .chain([(2, 0), (2, 1), (2, 2), (2, 3), (3, 0), (3, 1), (3, 2), (3, 3)])
            {
                // Morton order within an octant: x, y, z, then the second bits of x, y, z.
                let shift = (dy & 1) << 1 | (dz & 1) << 2 | (dy >> 1) << 4 | (dz >> 1) << 5;
                let row_of = |word: u64| {
                    let word = word >> shift;
                    word & 3 | word >> 6 & 12
                };
                let bits = row_of(low) | row_of(high) << 4;
                let (y, z) = (from[1] + 4 * y4 + dy, from[2] + 4 * z4 + dz);
                let is_inside = (0..size[1] as i64).contains(&y) && (0..size[2] as i64).contains(&z);
                if bits != 0 && is_inside && self.toggle_row(from[0], bits, y as usize, z as usize) {
                    changed(y as usize, z as usize);
                }
            }
        }
    }

    /// As [`Bits::toggle_brick`], voxel by voxel.
    fn toggle_few(&mut self, lowest: VoxelIndex, mask: &BrickMask, mut changed: impl FnMut(usize, usize)) {
        for place in places(*mask) {
            let along =
                |k: usize| (place >> k & 1 | place >> (k + 3) << 1 & 2 | place >> (k + 6) << 2 & 4) as i32;
            let voxel = std::array::from_fn(|k| lowest[k].saturating_add(along(k)));
            if let Some([x, y, z]) = self.extent.place_of(voxel) {
                self.words[(z * self.extent.size[1] + y) * self.words_per_row + x / 64] ^= 1 << (x % 64);
                changed(y, z);
            }
        }
    }

    /// Inverts up to eight bits from position `x` on; returns whether any is inside of the box.
    #[inline]
    fn toggle_row(&mut self, x: i64, bits: u64, y: usize, z: usize) -> bool {
        let end = self.extent.size[0] as i64;
        // Bits before the row are shifted out, those after it are masked.
        let (x, bits) = if x < 0 { (0, bits.checked_shr((-x) as u32).unwrap_or(0)) } else { (x, bits) };
        let bits = match end - x {
            left if left <= 0 => 0,
            left if left < 8 => bits & ((1 << left) - 1),
            _ => bits,
        };
        if bits == 0 {
            return false;
        }
        let (word, shift) = (x as usize / 64, x as usize % 64);
        let first = (z * self.extent.size[1] + y) * self.words_per_row;
        self.words[first + word] ^= bits << shift;
        if shift > 56 && bits >> (64 - shift) != 0 {
            self.words[first + word + 1] ^= bits >> (64 - shift);
        }
        true
    }

    /// Bytes of memory for a box.
    pub(crate) fn bytes_of(size: [usize; 3]) -> usize {
        8 * Self::words_per_row(size[0]) * size[1] * size[2]
    }
}

/// Returns a bit of a row.
#[cfg(test)]
pub(crate) fn bit(row: &[u64], x: usize) -> bool {
    row[x / 64] >> (x % 64) & 1 == 1
}

/// Returns 32 bits of a row from position `x` on; bits beyond the row are 0.
#[inline]
pub(crate) fn bits_from(row: &[u64], x: usize) -> u32 {
    let (word, shift) = (x / 64, x % 64);
    let low = row.get(word).map_or(0, |word| word >> shift);
    let high = if shift > 32 { row.get(word + 1).map_or(0, |word| word << (64 - shift)) } else { 0 };
    (low | high) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use testkit::random_scans::Random;
    use voxtile::space::{add_to_mask, place_of_voxel};

    #[test]
    fn toggled_bricks_equal_toggled_voxels() {
        let mut random = Random(1);
        for _ in 0..200 {
            let size = [1, 1, 1].map(|_| 1 + random.below(90) as usize);
            let min = [0; 3].map(|_| random.below(40) as i64 - 20);
            let extent = Extent { min, size };
            let (mut by_brick, mut by_voxel) = (Bits::new(extent), Bits::new(extent));
            let mut rows = BTreeSet::new();
            for _ in 0..20 {
                let lowest = [0, 1, 2]
                    .map(|k| 8 * ((min[k] as i32 + random.below(size[k] as u64 + 16) as i32 - 8) / 8));
                let mut mask = [0; 8];
                let most = [20, 90][random.below(2) as usize];
                for _ in 0..random.below(most) {
                    let voxel = lowest.map(|k| k + random.below(8) as i32);
                    let before = mask;
                    add_to_mask(&mut mask, place_of_voxel(voxel));
                    if before != mask {
                        by_voxel.toggle(voxel);
                    }
                }
                by_brick.toggle_brick(lowest, &mask, |y, z| {
                    rows.insert((y, z));
                });
            }
            assert_eq!(by_brick.words, by_voxel.words);
            for z in 0..size[2] {
                for y in 0..size[1] {
                    assert!(rows.contains(&(y, z)) || by_brick.row(y, z).iter().all(|word| *word == 0));
                }
            }
        }
    }

    #[test]
    fn bits_of_a_row_are_read_at_any_position() {
        let row = [0x0123_4567_89ab_cdef, 0xfedc_ba98_7654_3210];
        for x in 0..128 {
            let expected =
                (0..32).filter(|k| x + k < 128 && bit(&row, x + k)).fold(0, |bits, k| bits | 1_u32 << k);
            assert_eq!(bits_from(&row, x), expected, "{x}");
        }
        assert_eq!(bits_from(&row, 128), 0);
    }
}
