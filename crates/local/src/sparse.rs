use super::runs::Runs;

/// Map from 64 positions to numbers: 4 bytes per number, in a list as long as needed.
// Packed, so that a block fits into 32 bytes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(Rust, packed(4))]
pub(super) struct Sparse64 {
    pub(super) mask: u64,
    list: u32,
}

/// Storage of the lists of many [`Sparse64`] by capacity class: 1, 2, 4 ... 64, the smallest that suffices.
#[derive(Clone, Debug, Default)]
pub(super) struct IdLists {
    classes: [Runs<u32>; 7],
}

/// Returns the capacity class for this many numbers.
#[inline]
fn class_of(len: usize) -> usize {
    len.next_power_of_two().trailing_zeros() as usize
}

impl IdLists {
    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.classes.iter().map(Runs::bytes).sum()
    }

    #[inline]
    fn list(&self, class: usize, list: u32) -> &[u32] {
        self.classes[class].get(list, 1 << class)
    }

    #[inline]
    fn list_mut(&mut self, class: usize, list: u32) -> &mut [u32] {
        self.classes[class].get_mut(list, 1 << class)
    }

    /// Moves as much of a list as fits to another class; returns its number there.
    fn moved(&mut self, list: u32, from: usize, to: usize) -> u32 {
        let new = self.classes[to].take(1 << to);
        let len = 1 << from.min(to);
        let mut ids = [0; 64];
        ids[..len].copy_from_slice(&self.list(from, list)[..len]);
        self.list_mut(to, new)[..len].copy_from_slice(&ids[..len]);
        self.classes[from].give(list);
        new
    }
}

impl Sparse64 {
    #[inline]
    fn len(&self) -> usize {
        self.mask.count_ones() as usize
    }

    #[inline]
    fn rank(&self, place: usize) -> usize {
        (self.mask & ((1 << place) - 1)).count_ones() as usize
    }

    /// Returns the number at a position (0 to 63).
    #[inline]
    pub(super) fn get(&self, lists: &IdLists, place: usize) -> Option<u32> {
        let is_taken = self.mask >> place & 1 != 0;
        is_taken.then(|| lists.list(class_of(self.len()), self.list)[self.rank(place)])
    }

    /// Returns the numbers in the order of their positions.
    pub(super) fn ids<'a>(&self, lists: &'a IdLists) -> &'a [u32] {
        let len = self.len();
        if len == 0 { &[] } else { &lists.list(class_of(len), self.list)[..len] }
    }

    /// Inserts a number at a free position.
    pub(super) fn insert(&mut self, lists: &mut IdLists, place: usize, id: u32) {
        debug_assert!(self.mask >> place & 1 == 0);
        let len = self.len();
        let class = class_of(len + 1);
        if len == 0 {
            self.list = lists.classes[0].take(1);
        } else if class != class_of(len) {
            self.list = lists.moved(self.list, class - 1, class);
        }
        let rank = self.rank(place);
        let ids = lists.list_mut(class, self.list);
        ids.copy_within(rank..len, rank + 1);
        ids[rank] = id;
        self.mask |= 1 << place;
    }

    /// Removes and returns the number at a position.
    pub(super) fn remove(&mut self, lists: &mut IdLists, place: usize) -> u32 {
        debug_assert!(self.mask >> place & 1 != 0);
        let (len, rank) = (self.len(), self.rank(place));
        let class = class_of(len);
        let ids = lists.list_mut(class, self.list);
        let id = ids[rank];
        ids.copy_within(rank + 1..len, rank);
        self.mask &= !(1 << place);
        if len == 1 {
            lists.classes[0].give(self.list);
        } else if class_of(len - 1) != class {
            self.list = lists.moved(self.list, class, class - 1);
        }
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn sparse_maps_equal_tree_maps(steps in prop::collection::vec((0..3_usize, 0..64_usize), 0..400)) {
            let mut lists = IdLists::default();
            let mut sparse = [Sparse64::default(); 3];
            let mut naive: [BTreeMap<usize, u32>; 3] = Default::default();
            for (number, (which, place)) in steps.into_iter().enumerate() {
                match naive[which].remove(&place) {
                    Some(id) => prop_assert_eq!(sparse[which].remove(&mut lists, place), id),
                    None => {
                        sparse[which].insert(&mut lists, place, number as u32);
                        naive[which].insert(place, number as u32);
                    }
                }
                for (sparse, naive) in sparse.iter().zip(&naive) {
                    prop_assert!(sparse.ids(&lists).iter().eq(naive.values()));
                    prop_assert!((0..64).all(|k| sparse.get(&lists, k) == naive.get(&k).copied()));
                }
            }
        }
    }
}
