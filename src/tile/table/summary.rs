use crate::octree::BrickNodes;

/// Data of a brick that an octree needs, in eight bytes; recomputed after the brick has changed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Summary {
    /// Largest log-odds; an upper bound once the brick has changed.
    pub(crate) max: f32,
    /// Number of nodes of OctoMap's tree, including the brick's own at depth 13.
    pub(crate) nodes: u16,
    /// Whether the brick is one leaf: all 512 voxels are known and have the same value.
    pub(crate) is_leaf: bool,
    /// Whether the brick has changed since the summary was computed.
    pub(crate) is_stale: bool,
}

impl Summary {
    /// Summary of a brick without voxels.
    pub(crate) const EMPTY: Self = Self { max: f32::NEG_INFINITY, nodes: 0, is_leaf: false, is_stale: true };
    /// Summary of a brick with unknown content.
    pub(crate) const STALE: Self = Self { max: f32::INFINITY, ..Self::EMPTY };
}

impl Summary {
    /// Records a change of the brick, to log-odds of at most `bound`.
    #[inline]
    pub(crate) fn note_change(&mut self, bound: f32) {
        self.is_stale = true;
        self.max = larger(self.max, bound);
    }

    /// Log-odds above which a brick is marked in the directory: more than after any miss, less than the occupancy
    /// threshold of most maps.
    pub(crate) const MARKED_ABOVE: f32 = -0.05;

    /// Returns whether the log-odds of all unmarked bricks are below this threshold.
    #[inline]
    pub(crate) fn are_marks_for(threshold: f64) -> bool {
        threshold > f64::from(Self::MARKED_ABOVE.next_up())
    }

    /// Returns whether all log-odds are known to be below a threshold.
    #[inline]
    pub(crate) fn is_below(&self, threshold: f64) -> bool {
        // The next larger number, because the largest log-odds may have been rounded down.
        f64::from(self.max.next_up()) <= threshold
    }
}

impl From<(BrickNodes, f32)> for Summary {
    fn from((nodes, max): (BrickNodes, f32)) -> Self {
        let is_leaf = nodes.leaf.is_some();
        // A brick has at most 585 nodes.
        Self { max, nodes: nodes.node_count() as u16, is_leaf, is_stale: false }
    }
}

#[inline]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
