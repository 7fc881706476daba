/// Disjoint sets of numbers (union-find).
#[derive(Clone, Debug, Default)]
pub(crate) struct Sets {
    parents: Vec<u32>,
}

impl Sets {
    /// Adds a set with one new number, and returns the number.
    pub(crate) fn push(&mut self) -> u32 {
        let number = self.parents.len() as u32;
        self.parents.push(number);
        number
    }

    pub(crate) fn len(&self) -> usize {
        self.parents.len()
    }

    /// Returns the number that represents the set of a number.
    pub(crate) fn root(&mut self, number: u32) -> u32 {
        let mut root = number;
        while self.parents[root as usize] != root {
            root = self.parents[root as usize];
        }
        let mut at = number;
        while self.parents[at as usize] != root {
            at = std::mem::replace(&mut self.parents[at as usize], root);
        }
        root
    }

    /// Unites two sets; the lower root represents both.
    pub(crate) fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}
