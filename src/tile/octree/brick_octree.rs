use crate::space::{BrickCode, MortonCode};
use crate::tile::table::{Table, larger};

/// OctoMap's octree as a view of a table's bricks.
///
/// From depth 13 (a brick) on, a node is a run of a brick's voxels. The nodes above are stored here, level by level.
/// [`BrickOctree::sync`] updates them; until then queries read the bricks.
#[derive(Clone, Debug, Default)]
pub(crate) struct BrickOctree {
    /// The nodes of depth 12, then those of depth 11 and so on up to the root, each level in Morton order.
    nodes: Vec<Node>,
    /// End of each level, depth 12 first.
    ends: [u32; LEVELS],
    node_count: u64,
    is_synced: bool,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Upper bits of its voxels' codes: three per level.
    prefix: u64,
    max: f32,
    /// Number of children that are leaves and have the value of the first child.
    like_first: u8,
}

const BRICK_DEPTH: u8 = 13;

const LEVELS: usize = BRICK_DEPTH as usize;

impl BrickOctree {
    /// Returns whether the table is unchanged since the last [`sync`](Self::sync).
    pub(crate) fn is_synced(&self) -> bool {
        self.is_synced
    }

    pub(crate) fn note_change(&mut self) {
        self.is_synced = false;
    }

    /// Number of nodes of OctoMap's pruned tree, as of the last [`sync`](Self::sync).
    pub(crate) fn node_count(&self) -> u64 {
        self.node_count
    }

    pub(crate) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }

    /// Updates the summaries of changed bricks and the nodes above the bricks.
    pub(crate) fn sync(&mut self, table: &mut Table) {
        if self.is_synced {
            return;
        }
        table.sum_up();
        self.nodes.clear();
        self.node_count = 0;
        for (brick, summary) in table.summaries() {
            self.node_count += u64::from(summary.nodes);
            self.add_child(0, brick.0, summary.max, summary.is_leaf);
        }
        for level in 0..LEVELS {
            let begin = self.begin(level);
            self.ends[level] = self.nodes.len() as u32;
            for number in begin..self.nodes.len() {
                let Node { prefix, max, like_first } = self.nodes[number];
                let is_leaf = like_first == 8;
                // The children of a leaf do not count as nodes.
                self.node_count += 1;
                self.node_count -= if is_leaf { 8 } else { 0 };
                if level + 1 < LEVELS {
                    self.add_child(self.ends[level] as usize, prefix, max, is_leaf);
                }
            }
        }
        self.is_synced = true;
    }

    /// Adds a child to its parent: the last node of the level that starts at `begin`, or a new one.
    fn add_child(&mut self, begin: usize, child: u64, max: f32, is_leaf: bool) {
        match self.nodes[begin..].last_mut() {
            Some(parent) if parent.prefix == child >> 3 => {
                let is_like_first = is_leaf && max.to_bits() == parent.max.to_bits();
                parent.like_first += u8::from(is_like_first);
                parent.max = larger(parent.max, max);
            }
            _ => self.nodes.push(Node { prefix: child >> 3, max, like_first: is_leaf.into() }),
        }
    }

    /// Returns the largest log-odds under the node at `depth` (1 to 16) that contains `code`; `None` if all are
    /// unknown.
    pub(crate) fn max_under(&self, table: &Table, code: MortonCode, depth: u8) -> Option<f32> {
        if self.is_synced && depth < BRICK_DEPTH {
            let level = usize::from(BRICK_DEPTH - 1 - depth);
            let nodes = &self.nodes[self.begin(level)..self.ends[level] as usize];
            let prefix = code.0 / MortonCode::span(depth);
            let found = nodes.binary_search_by_key(&prefix, |node| node.prefix);
            return found.ok().map(|number| nodes[number].max);
        }
        max_in_table(table, code, depth)
    }

    fn begin(&self, level: usize) -> usize {
        if level == 0 { 0 } else { self.ends[level - 1] as usize }
    }
}

/// Returns the largest log-odds of a table's voxels under the node at `depth` (1 to 16) that contains `code`, computed
/// from the voxels; `None` if all are unknown.
pub(crate) fn max_in_table(table: &Table, code: MortonCode, depth: u8) -> Option<f32> {
    if depth >= BRICK_DEPTH {
        return table.max_under(code, depth);
    }
    let first = code.ancestor(depth).brick().0;
    let bricks = first..first + MortonCode::span(depth) / MortonCode::span(BRICK_DEPTH);
    table.max_of_bricks(BrickCode(bricks.start)..BrickCode(bricks.end))
}
