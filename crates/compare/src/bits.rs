use crate::blocks::Cube;
use voxtile::VoxelIndex;
use voxtile::space::{BRICK_VOXELS, BrickMask, ones, places};

/// A bit for each voxel of a box, in rows along x.
#[derive(Clone, Debug)]
pub(crate) struct Bits {
    cube: Cube,
    row_words: usize,
    /// Rows by z, then y. Bits beyond a row are 0.
    words: Vec<u64>,
}

/// Voxels of a row from `x` to `end`, at positions in the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) x: u16,
    /// One past the last voxel.
    pub(crate) end: u16,
    pub(crate) y: u16,
    pub(crate) z: u16,
}

/// Position within a brick of each voxel in Morton order.
pub(crate) static IN_BRICK: [[u8; 3]; BRICK_VOXELS] = positions();

const fn positions() -> [[u8; 3]; BRICK_VOXELS] {
    let mut all = [[0; 3]; BRICK_VOXELS];
    let mut place = 0;
    while place < BRICK_VOXELS {
        let mut axis = 0;
        while axis < 3 {
            let bits = [place >> axis & 1, place >> (axis + 3) & 1, place >> (axis + 6) & 1];
            all[place][axis] = (bits[0] | bits[1] << 1 | bits[2] << 2) as u8;
            axis += 1;
        }
        place += 1;
    }
    all
}

impl Bits {
    pub(crate) fn new(cube: Cube) -> Self {
        let row_words = cube.edge.div_ceil(64);
        Self { cube, row_words, words: vec![0; row_words * cube.edge * cube.edge] }
    }

    pub(crate) fn cube(&self) -> Cube {
        self.cube
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    pub(crate) fn count(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    pub(crate) fn contains(&self, [x, y, z]: [usize; 3]) -> bool {
        self.words[(z * self.cube.edge + y) * self.row_words + x / 64] >> (x % 64) & 1 == 1
    }

    /// Adds the voxel at a position.
    pub(crate) fn insert(&mut self, [x, y, z]: [usize; 3]) {
        self.words[(z * self.cube.edge + y) * self.row_words + x / 64] |= 1 << (x % 64);
    }

    /// Adds the voxels of a brick that are in the box.
    pub(crate) fn add_brick(&mut self, lowest: VoxelIndex, mask: &BrickMask) {
        let edge = self.cube.edge as i64;
        let from: [i64; 3] = std::array::from_fn(|k| i64::from(lowest[k]) - self.cube.min[k]);
        for place in places(*mask) {
            let [x, y, z] = std::array::from_fn(|k| from[k] + i64::from(IN_BRICK[place][k]));
            if [x, y, z].iter().all(|k| (0..edge).contains(k)) {
                self.insert([x as usize, y as usize, z as usize]);
            }
        }
    }

    /// Adds a box of voxels at positions from `min` to `end`.
    pub(crate) fn add_box(&mut self, min: [usize; 3], end: [usize; 3]) {
        for z in min[2]..end[2] {
            for y in min[1]..end[1] {
                for x in min[0]..end[0] {
                    self.insert([x, y, z]);
                }
            }
        }
    }

    /// Computes each word from those of other bits of the same box, given in order.
    pub(crate) fn combined<const N: usize>(others: [&Self; N], word: impl Fn([u64; N]) -> u64) -> Self {
        let first = others[0];
        let words = (0..first.words.len()).map(|k| word(others.map(|other| other.words[k]))).collect();
        Self { cube: first.cube, row_words: first.row_words, words }
    }

    /// All voxels within a number of voxels along each axis of these. Beyond the border of the box, no voxels are known.
    pub(crate) fn grown(&self, voxels: u32) -> Self {
        let mut grown = self.clone();
        if self.is_empty() {
            return grown;
        }
        for _ in 0..voxels {
            grown.grow_along_x();
            grown.grow_along(self.row_words * self.cube.edge, self.row_words);
            grown.grow_along(self.words.len(), self.row_words * self.cube.edge);
        }
        grown
    }

    /// These voxels, moved by one along an axis. The voxels at the border of the box that have no source are absent.
    pub(crate) fn moved(&self, axis: usize, is_up: bool) -> Self {
        let mut moved = Self::new(self.cube);
        let edge = self.cube.edge;
        let to = |k: usize| if is_up { k.checked_sub(1) } else { Some(k + 1).filter(|k| *k < edge) };
        for z in 0..edge {
            for y in 0..edge {
                let (Some(from_y), Some(from_z)) =
                    (if axis == 1 { to(y) } else { Some(y) }, if axis == 2 { to(z) } else { Some(z) })
                else {
                    continue;
                };
                let (row, from) = (self.row_at(y, z), self.row_at(from_y, from_z));
                moved.words[row..row + self.row_words]
                    .copy_from_slice(&self.words[from..from + self.row_words]);
            }
        }
        if axis == 0 {
            let last = self.last_word();
            for row in moved.words.chunks_exact_mut(self.row_words) {
                shift(row, is_up);
                row[row.len() - 1] &= last;
            }
        }
        moved
    }

    fn row_at(&self, y: usize, z: usize) -> usize {
        (z * self.cube.edge + y) * self.row_words
    }

    /// The valid bits of the last word of a row.
    fn last_word(&self) -> u64 {
        match self.cube.edge % 64 {
            0 => u64::MAX,
            bits => (1 << bits) - 1,
        }
    }

    fn grow_along_x(&mut self) {
        let last = self.last_word();
        let mut moved = vec![0; self.row_words];
        for row in self.words.chunks_exact_mut(self.row_words) {
            if row.iter().all(|word| *word == 0) {
                continue;
            }
            let own = row.to_vec();
            for is_up in [true, false] {
                moved.copy_from_slice(&own);
                shift(&mut moved, is_up);
                row.iter_mut().zip(&moved).for_each(|(word, moved)| *word |= moved);
            }
            row[self.row_words - 1] &= last;
        }
    }

    /// Grows by one along an axis whose neighbors are `stride` words apart, within each `chunk` of words.
    fn grow_along(&mut self, chunk: usize, stride: usize) {
        let mut own = Vec::with_capacity(chunk);
        for words in self.words.chunks_exact_mut(chunk) {
            own.clear();
            own.extend_from_slice(words);
            let below = own.iter();
            words[stride..].iter_mut().zip(below).for_each(|(word, below)| *word |= below);
            words.iter_mut().zip(&own[stride..]).for_each(|(word, above)| *word |= above);
        }
    }

    /// The runs of voxels, by z, then y, then x.
    pub(crate) fn runs(&self) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for (row, words) in self.words.chunks_exact(self.row_words).enumerate() {
            let (y, z) = ((row % self.cube.edge) as u16, (row / self.cube.edge) as u16);
            for (number, &word) in words.iter().enumerate() {
                for bit in ones(word) {
                    let x = (number * 64 + bit) as u16;
                    match runs.last_mut() {
                        Some(run) if run.end == x && (run.y, run.z) == (y, z) => run.end += 1,
                        _ => runs.push(Run { x, end: x + 1, y, z }),
                    }
                }
            }
        }
        runs
    }
}

/// Moves the bits of a row by one, towards higher or lower positions.
fn shift(row: &mut [u64], is_up: bool) {
    let mut carry = 0;
    let mut step = |word: &mut u64| {
        let (moved, next) = if is_up { (*word << 1, *word >> 63) } else { (*word >> 1, *word << 63) };
        (*word, carry) = (moved | carry, next);
    };
    match is_up {
        true => row.iter_mut().for_each(&mut step),
        false => row.iter_mut().rev().for_each(&mut step),
    }
}
