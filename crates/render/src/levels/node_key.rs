use std::fmt;
use std::str::FromStr;

/// Level of a node and its index in this level. A node of level `n` has voxels of `2^n` times the map's resolution. Its
/// eight children are in level `n - 1`, at twice its index and the next one along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeKey {
    /// Level; 0 has the map's resolution.
    pub level: u8,
    /// Index along x, y and z.
    pub index: [i32; 3],
}

/// Highest level, where all indices are 0 or -1.
pub(super) const MAX_LEVEL: u8 = 42;

impl NodeKey {
    /// Returns the node of the next coarser level that covers this one.
    pub(super) fn parent(self) -> Self {
        Self { level: self.level + 1, index: self.index.map(|k| k >> 1) }
    }

    /// Returns the eight nodes of the next finer level, x fastest; none at level 0.
    pub(super) fn children(self) -> impl Iterator<Item = Self> {
        let numbers = if self.level == 0 { 0..0 } else { 0..8 };
        numbers.filter_map(move |number| {
            let index = [0, 1, 2].map(|k| Some(self.index[k].checked_mul(2)? + (number >> k & 1)));
            let [Some(x), Some(y), Some(z)] = index else { return None };
            Some(Self { level: self.level - 1, index: [x, y, z] })
        })
    }
}

/// Formats as `L/X/Y/Z`, as in URLs and paths.
impl fmt::Display for NodeKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.index;
        write!(f, "{}/{x}/{y}/{z}", self.level)
    }
}

impl FromStr for NodeKey {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let mut parts = text.split('/');
        let mut next = || parts.next().ok_or(());
        let level = next()?.parse().map_err(|_| ())?;
        let mut index = [0; 3];
        for k in &mut index {
            *k = next()?.parse().map_err(|_| ())?;
        }
        let key = Self { level, index };
        // Accept only the canonical text of a node: no plus sign, leading zero or `-0`.
        if parts.next().is_some() || level > MAX_LEVEL || key.to_string() != text { Err(()) } else { Ok(key) }
    }
}
