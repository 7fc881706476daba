/// Which of 64 places are taken, and the number that each holds: 4 bytes a number, in a list as long as needed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sparse64 {
    pub(super) mask: u64,
    start: u32,
    class: u8,
}

/// The lists of many [`Sparse64`], by capacity: 1, 2, 4 ... 64.
#[derive(Clone, Debug, Default)]
pub(super) struct IdLists {
    classes: [Class; 7],
}

#[derive(Clone, Debug, Default)]
struct Class {
    ids: Vec<u32>,
    free: Vec<u32>,
}

impl IdLists {
    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.classes
            .iter()
            .map(|class| (class.ids.capacity() + class.free.capacity()) * size_of::<u32>())
            .sum()
    }

    fn take(&mut self, class: u8) -> u32 {
        let Class { ids, free } = &mut self.classes[usize::from(class)];
        free.pop().unwrap_or_else(|| {
            let start = ids.len();
            // Doubling would leave a third of it empty on average.
            if ids.capacity() < start + (1 << class) {
                ids.reserve_exact(start / 8 + 1024);
            }
            ids.resize(start + (1 << class), 0);
            start as u32
        })
    }

    /// Moves a list of `len` numbers to another class.
    fn resize(&mut self, list: &mut Sparse64, len: usize, class: u8) {
        let start = self.take(class);
        for k in 0..len {
            let id = self.classes[usize::from(list.class)].ids[list.start as usize + k];
            self.classes[usize::from(class)].ids[start as usize + k] = id;
        }
        self.classes[usize::from(list.class)].free.push(list.start);
        (list.start, list.class) = (start, class);
    }
}

impl Sparse64 {
    #[inline]
    fn rank(&self, place: usize) -> usize {
        (self.mask & ((1 << place) - 1)).count_ones() as usize
    }

    /// The number at a place (0 to 63).
    #[inline]
    pub(super) fn get(&self, lists: &IdLists, place: usize) -> Option<u32> {
        let is_taken = self.mask >> place & 1 != 0;
        is_taken.then(|| lists.classes[usize::from(self.class)].ids[self.start as usize + self.rank(place)])
    }

    /// The numbers, by place.
    pub(super) fn ids<'a>(&self, lists: &'a IdLists) -> &'a [u32] {
        if self.mask == 0 {
            return &[];
        }
        &lists.classes[usize::from(self.class)].ids[self.start as usize..][..self.mask.count_ones() as usize]
    }

    /// Puts a number at a place that is not taken.
    pub(super) fn insert(&mut self, lists: &mut IdLists, place: usize, id: u32) {
        debug_assert!(self.mask >> place & 1 == 0);
        let len = self.mask.count_ones() as usize;
        if len == 0 {
            (self.start, self.class) = (lists.take(0), 0);
        } else if len == 1 << self.class {
            lists.resize(self, len, self.class + 1);
        }
        let (start, rank) = (self.start as usize, self.rank(place));
        let ids = &mut lists.classes[usize::from(self.class)].ids;
        ids.copy_within(start + rank..start + len, start + rank + 1);
        ids[start + rank] = id;
        self.mask |= 1 << place;
    }

    /// Takes the number at a place that is taken away.
    pub(super) fn remove(&mut self, lists: &mut IdLists, place: usize) -> u32 {
        debug_assert!(self.mask >> place & 1 != 0);
        let len = self.mask.count_ones() as usize;
        let (start, rank) = (self.start as usize, self.rank(place));
        let ids = &mut lists.classes[usize::from(self.class)].ids;
        let id = ids[start + rank];
        ids.copy_within(start + rank + 1..start + len, start + rank);
        self.mask &= !(1 << place);
        if len == 1 {
            lists.classes[usize::from(self.class)].free.push(self.start);
        } else if self.class > 0 && len - 1 == 1 << (self.class - 1) {
            lists.resize(self, len - 1, self.class - 1);
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
        fn lists_are_what_a_tree_map_is(steps in prop::collection::vec((0..3_usize, 0..64_usize), 0..400)) {
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
