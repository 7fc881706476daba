use super::tree::{NONE, Tree};
use voxtile::space::VoxelIndex;

/// Numbers of a node and of its neighbours, looked up or created once for all voxels that inflate there.
///
/// No node may be removed while this is in use.
#[derive(Clone, Debug)]
pub(super) struct NodesAround {
    center: VoxelIndex,
    /// 3 x 3 x 3 numbers; [`NONE`] where not looked up yet.
    numbers: [u32; 27],
}

impl Default for NodesAround {
    fn default() -> Self {
        Self { center: [0; 3], numbers: [NONE; 27] }
    }
}

impl NodesAround {
    /// Centers the cache at the node with this index.
    #[inline]
    pub(super) fn move_to(&mut self, center: VoxelIndex) {
        if self.center != center {
            *self = Self { center, numbers: [NONE; 27] };
        }
    }

    /// Returns the node with an index; creates it with the rule if it does not exist.
    #[inline]
    pub(super) fn make(&mut self, tree: &mut Tree, index: VoxelIndex, rule: u8) -> u32 {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| (index[k] - self.center[k] + 1) as u32);
        if x > 2 || y > 2 || z > 2 {
            // A stencil can reach beyond the direct neighbours.
            return tree.make_node(index, rule);
        }
        let number = &mut self.numbers[(x * 9 + y * 3 + z) as usize];
        if *number == NONE {
            *number = tree.make_node(index, rule);
        }
        *number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_near_and_far_are_those_of_the_tree() {
        let mut tree = Tree::default();
        let mut around = NodesAround::default();
        for center in [[0; 3], [-1, 4, -4], [-1, 3, -4], [0; 3]] {
            around.move_to(center);
            // Each node is requested twice: the first request creates it, the second finds it.
            for number in (0..125).chain(0..125) {
                let offset = [number % 5 - 2, number / 5 % 5 - 2, number / 25 - 2];
                let index: VoxelIndex = std::array::from_fn(|k| center[k] + offset[k]);
                let node = around.make(&mut tree, index, 0);
                assert_eq!(tree.node_at(index), Some(node), "{index:?} around {center:?}");
                assert_eq!(tree.node_index(node), index);
            }
        }
    }
}
