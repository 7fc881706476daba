use super::hash_table_bytes;
use rustc_hash::FxHashMap;
use std::hint::select_unpredictable;

/// Map from cells of an integer grid, such as tiles, to numbers.
///
/// The grid is wrapped around a torus whose sizes are powers of two, just large enough to separate the current cells.
/// Cells that are close together never share a slot, and a look-up is one comparison without an unpredictable branch. A
/// cell that would need too large a torus is stored in a hash map.
#[derive(Clone, Debug)]
pub struct Torus {
    /// Size of the torus minus one, for each axis.
    masks: [u32; 3],
    /// Slots between neighbors along y and z.
    strides: [usize; 2],
    slots: Vec<Slot>,
    far: FxHashMap<Cell, u32>,
    /// Number of cells.
    len: usize,
}

/// Index along x, y and z.
type Cell = [i32; 3];

#[derive(Clone, Copy, Debug)]
struct Slot {
    cell: Cell,
    number: u32,
}

impl Torus {
    /// Number of an absent cell; numbers start at 1.
    pub const NONE: u32 = 0;

    /// Maximum number of slots for few cells.
    const MIN_SLOTS: usize = 64;
    /// Maximum number of slots per cell, if this allows more than [`Self::MIN_SLOTS`].
    const MAX_SLOTS_A_CELL: usize = 16;

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.slots.capacity() * size_of::<Slot>() + hash_table_bytes::<(Cell, u32)>(self.far.capacity())
    }

    /// The number of a cell, or [`Torus::NONE`].
    #[inline(always)]
    pub fn get(&self, cell: Cell) -> u32 {
        let slot = &self.slots[self.slot_of(cell)];
        if !self.far.is_empty() && slot.cell != cell {
            return self.get_far(cell);
        }
        let differ = (0..3).fold(0, |differ, k| differ | (slot.cell[k] ^ cell[k]));
        select_unpredictable(differ == 0, slot.number, Self::NONE)
    }

    /// Separate, so that the caller is small enough to be inlined.
    #[cold]
    #[inline(never)]
    fn get_far(&self, cell: Cell) -> u32 {
        self.far.get(&cell).copied().unwrap_or(Self::NONE)
    }

    /// Sets the number of a cell, from 1.
    pub fn insert(&mut self, cell: Cell, number: u32) {
        self.len += usize::from(self.get(cell) == Self::NONE);
        if self.put(cell, number) {
            return;
        }
        let occupant = self.slots[self.slot_of(cell)].cell;
        if let Some((axis, bits)) = self.bits_to_part(cell, occupant) {
            self.enlarge(axis, bits);
        }
        if !self.put(cell, number) {
            self.far.insert(cell, number);
        }
    }

    /// Puts a cell into its slot; returns `false` if another cell is there.
    fn put(&mut self, cell: Cell, number: u32) -> bool {
        let at = self.slot_of(cell);
        let slot = &mut self.slots[at];
        let is_free = slot.number == Self::NONE || slot.cell == cell;
        if is_free {
            *slot = Slot { cell, number };
        }
        is_free
    }

    /// Returns how to separate two cells that share a slot: the axis, and the number of bits to add. `None` if that
    /// takes too many slots.
    fn bits_to_part(&self, a: Cell, b: Cell) -> Option<(usize, u32)> {
        let bits_along = |axis: usize| {
            let differ = (a[axis] ^ b[axis]) as u32;
            let bits = differ.trailing_zeros() + 1 - self.masks[axis].trailing_ones();
            (differ != 0).then_some((axis, bits))
        };
        let (axis, bits) = (0..3).filter_map(bits_along).min_by_key(|&(_, bits)| bits)?;
        let most = (Self::MAX_SLOTS_A_CELL * self.len).max(Self::MIN_SLOTS);
        // The shift cannot overflow in 128 bits, because `bits` is at most 32.
        ((self.slots.len() as u128) << bits <= most as u128).then_some((axis, bits))
    }

    /// Enlarges the torus along an axis, and moves cells from the hash map that now fit.
    fn enlarge(&mut self, axis: usize, bits: u32) {
        self.masks[axis] = ((self.masks[axis] + 1) << bits) - 1;
        self.strides = strides(self.masks);
        let slots = vec![EMPTY; self.slots.len() << bits];
        // `put` succeeds, because cells with separate slots also have separate slots in a larger torus.
        for slot in std::mem::replace(&mut self.slots, slots) {
            if slot.number != Self::NONE {
                self.put(slot.cell, slot.number);
            }
        }
        let mut far = std::mem::take(&mut self.far);
        far.retain(|&cell, &mut number| !self.put(cell, number));
        self.far = far;
    }

    #[inline(always)]
    fn slot_of(&self, cell: Cell) -> usize {
        let part = |k: usize| (cell[k] as u32 & self.masks[k]) as usize;
        part(0) + part(1) * self.strides[0] + part(2) * self.strides[1]
    }
}

impl Default for Torus {
    fn default() -> Self {
        Self { masks: [0; 3], strides: [1; 2], slots: vec![EMPTY], far: FxHashMap::default(), len: 0 }
    }
}

const EMPTY: Slot = Slot { cell: [0; 3], number: Torus::NONE };

fn strides(masks: [u32; 3]) -> [usize; 2] {
    let [x, y, _] = masks.map(|mask| mask as usize + 1);
    [x, x * y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashMap;

    /// Cells that are close together, along a line, and anywhere.
    fn any_cell() -> impl Strategy<Value = Cell> {
        prop_oneof![
            3 => prop::array::uniform3(-6..6_i32),
            1 => (-200..200_i32).prop_map(|x| [x, 2 * x, 0]),
            1 => (0..31_u32, any::<bool>()).prop_map(|(bit, down)| [if down { -1 << bit } else { 1 << bit }, 0, 0]),
            1 => any::<Cell>(),
        ]
    }

    proptest! {
        #[test]
        fn it_equals_a_hash_map(cells in prop::collection::vec((any_cell(), 1..1000_u32), 0..300)) {
            let mut torus = Torus::default();
            let mut naive = HashMap::new();
            for &(cell, number) in &cells {
                torus.insert(cell, number);
                naive.insert(cell, number);
                prop_assert_eq!(torus.get(cell), number);
            }
            prop_assert_eq!(torus.len(), naive.len());
            prop_assert!(torus.slots.len() <= 64.max(16 * naive.len()));
            for (&cell, &number) in &naive {
                prop_assert_eq!(torus.get(cell), number);
                for axis in 0..3 {
                    let mut neighbor = cell;
                    neighbor[axis] = neighbor[axis].wrapping_add(1);
                    prop_assert_eq!(torus.get(neighbor), naive.get(&neighbor).copied().unwrap_or(Torus::NONE));
                }
            }
        }
    }

    #[test]
    fn adjacent_cells_need_no_hash_map() {
        let mut torus = Torus::default();
        let cells = (-40..60).flat_map(|x| (10..70).flat_map(move |y| [-1, 0].map(|z| [x, y, z])));
        cells.enumerate().for_each(|(number, cell)| torus.insert(cell, number as u32 + 1));
        assert!(torus.far.is_empty());
        assert_eq!((torus.len(), torus.slots.len()), (12_000, 128 * 64 * 2));
        torus.insert([1 << 20, 10, 0], 7);
        assert_eq!((torus.far.len(), torus.slots.len()), (1, 128 * 64 * 2));
        assert_eq!((torus.get([1 << 20, 10, 0]), torus.get([1 << 20, 10, 1])), (7, Torus::NONE));
    }
}
