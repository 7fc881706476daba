use crate::space::BrickMask;

/// Number of voxels of a cell: one word of a brick's mask.
pub(crate) const CELL_VOXELS: usize = 64;

/// Values for all voxels of a brick, in cells of 4 x 4 x 4. A cell takes memory once one of its voxels is set.
///
/// Smaller cells would save a third of the memory for a street, but each update would have to count bits.
#[derive(Clone, Debug)]
pub(crate) struct Cells<T> {
    /// Position in `cells` for each word of a mask, or [`ABSENT`].
    places: [u8; 8],
    cells: Vec<[T; CELL_VOXELS]>,
}

const ABSENT: u8 = u8::MAX;

impl<T: Copy> Cells<T> {
    pub(crate) const fn empty() -> Self {
        Self { places: [ABSENT; 8], cells: Vec::new() }
    }

    /// Creates cells for the nonzero words of a mask, in order, filled with `value`.
    pub(crate) fn of_words(mask: &BrickMask, value: T) -> Self {
        let mut places = [ABSENT; 8];
        let mut count = 0;
        for (place, _) in places.iter_mut().zip(mask).filter(|(_, word)| **word != 0) {
            *place = count;
            count += 1;
        }
        Self { places, cells: vec![[value; CELL_VOXELS]; count.into()] }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.cells.capacity() * size_of::<[T; CELL_VOXELS]>()
    }

    #[inline]
    pub(crate) fn cell(&self, word: usize) -> Option<&[T; CELL_VOXELS]> {
        self.cells.get(usize::from(self.places[word]))
    }

    #[inline]
    pub(crate) fn cell_mut(&mut self, word: usize) -> Option<&mut [T; CELL_VOXELS]> {
        self.cells.get_mut(usize::from(self.places[word]))
    }

    /// Creates the missing cells of the given words (bit `k` for word `k`), filled with `value`.
    pub(crate) fn make(&mut self, words: u8, value: T) {
        let missing = (0..8).fold(0, |missing, word| {
            missing | (words >> word & 1 & u8::from(self.places[word] == ABSENT)) << word
        });
        if missing == 0 {
            return;
        }
        // Reserve no spare space, because this happens at most eight times per brick.
        self.cells.reserve_exact(missing.count_ones() as usize);
        for word in (0..8).filter(|word| missing >> word & 1 == 1) {
            self.places[word] = self.cells.len() as u8;
            self.cells.push([value; CELL_VOXELS]);
        }
    }

    /// Visits the values of a mask whose cells exist, in Morton order, as position and value.
    #[inline]
    pub(crate) fn for_each(&self, mask: BrickMask, mut visit: impl FnMut(usize, T)) {
        for (word, mut bits) in mask.into_iter().enumerate() {
            let Some(cell) = self.cell(word) else { continue };
            while bits != 0 {
                let bit = bits.trailing_zeros() as usize;
                visit(CELL_VOXELS * word + bit, cell[bit]);
                bits &= bits - 1;
            }
        }
    }

    /// All cells, in no particular order.
    pub(crate) fn all(&self) -> &[[T; CELL_VOXELS]] {
        &self.cells
    }

    pub(crate) fn all_mut(&mut self) -> &mut [[T; CELL_VOXELS]] {
        &mut self.cells
    }

    /// Converts the values of all cells.
    pub(crate) fn map<U: Copy>(&self, value: impl Fn(T) -> U) -> Cells<U> {
        Cells { places: self.places, cells: self.cells.iter().map(|cell| cell.map(&value)).collect() }
    }
}
