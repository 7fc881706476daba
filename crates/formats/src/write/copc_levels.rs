/// Voxels along the edge of a node at its level of detail, as a power of two: 64.
const NODE_BITS: u32 = 6;

/// Octree around voxels that assigns each voxel to a level of detail.
///
/// Each level divides space into cells. In Morton order, the first voxel of a cell represents this cell. A voxel
/// belongs to the coarsest level at which it is the first of a cell. So each voxel is in exactly one node, and the
/// coarser levels alone give a thinned version of all voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// Edge of the octree, as a power of two of voxels.
    bits: u32,
}

/// Key of a node: its level and its index along x, y and z.
pub(super) type NodeKey = (u8, [u32; 3]);

impl Levels {
    /// Creates an octree for this many voxels along the longest side, at most 2^32.
    pub(super) fn around(voxels: u64) -> Self {
        let bits = (NODE_BITS..32).find(|&bits| 1 << bits >= voxels).unwrap_or(32);
        Self { bits }
    }

    /// Returns the edge of the octree in voxels.
    pub(super) fn edge_voxels(&self) -> f64 {
        f64::from(self.bits).exp2()
    }

    /// Returns the distance between voxels at the coarsest level, in voxels.
    pub(super) fn spacing_voxels(&self) -> f64 {
        f64::from(self.bits - NODE_BITS).exp2()
    }

    /// Returns the level of a voxel, given the previous voxel in Morton order.
    pub(super) fn level(&self, before: Option<u128>, code: u128) -> u8 {
        let Some(before) = before else {
            return 0;
        };
        let differ = before ^ code;
        // Depth down to which both voxels are in the same cell.
        let shared = self.bits - (128 - differ.leading_zeros()).div_ceil(3).min(self.bits);
        // One level deeper, they are in different cells. The cells of a node are smaller than the node by a factor of
        // 2^`NODE_BITS`.
        (shared + 1).saturating_sub(NODE_BITS).min(self.bits - NODE_BITS) as u8
    }

    /// Returns the node of a voxel at a level.
    pub(super) fn node(&self, level: u8, code: u128) -> NodeKey {
        let shift = self.bits.saturating_sub(u32::from(level));
        (level, indices(code).map(|index| index.checked_shr(shift).unwrap_or(0)))
    }
}

/// Interleaves the bits of three numbers, x lowest.
pub(super) fn morton(index: [u32; 3]) -> u128 {
    let mut code = 0;
    for bit in 0..32 {
        for (k, number) in index.iter().enumerate() {
            code |= u128::from(number >> bit & 1) << (3 * bit + k);
        }
    }
    code
}

/// Splits a Morton code into its three numbers.
fn indices(code: u128) -> [u32; 3] {
    let number =
        |k: usize| (0..32).fold(0, |number, bit| number | ((code >> (3 * bit + k) & 1) as u32) << bit);
    std::array::from_fn(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn codes_round_trip() {
        for index in [[0, 0, 0], [1, 2, 3], [u32::MAX, 0, u32::MAX], [1 << 31, 77, 12345678]] {
            assert_eq!(indices(morton(index)), index);
        }
    }

    #[test]
    fn every_level_has_one_voxel_per_cell() {
        // A floor and a wall of 256 voxels, in Morton order: levels 0, 1 and 2.
        let levels = Levels::around(256);
        let mut codes: Vec<u128> = (0..256 * 256)
            .flat_map(|n: u32| [morton([n % 256, n / 256, 3]), morton([9, n % 256, n / 256])])
            .collect();
        codes.sort_unstable();
        codes.dedup();
        let mut before = None;
        let mut seen: HashMap<(u8, [u32; 3]), u8> = HashMap::new();
        let mut counts = [0; 3];
        for &code in &codes {
            let level = levels.level(before, code);
            before = Some(code);
            counts[usize::from(level)] += 1;
            // The voxel is the first of its cell at its own level and at all finer levels.
            for depth in level..3 {
                let cell = indices(code).map(|k| k >> (2 - depth));
                if depth == level {
                    assert!(seen.insert((depth, cell), level).is_none(), "{cell:?} twice at {level}");
                }
            }
        }
        assert_eq!(counts.iter().sum::<usize>(), codes.len());
        // The coarsest level has a voxel for every nonempty cell of 4 voxels.
        let cells: std::collections::HashSet<_> =
            codes.iter().map(|&code| indices(code).map(|k| k >> 2)).collect();
        assert_eq!(counts[0], cells.len());
        let finer: std::collections::HashSet<_> =
            codes.iter().map(|&code| indices(code).map(|k| k >> 1)).collect();
        assert_eq!(counts[0] + counts[1], finer.len());
    }
}
