use super::place::{cell_at, ones};
use super::view::{BlockView, LocalState, LocalView, NodeView, PageView};
use std::sync::Arc;
use voxtile::space::VoxelIndex;

/// A voxel that changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelChange {
    /// Index of the voxel.
    pub voxel: VoxelIndex,
    /// State before the change.
    pub before: LocalState,
    /// State after the change.
    pub after: LocalState,
}

impl LocalView {
    /// Returns the voxels that differ from an earlier view of the same map, in no particular order. Skips parts that
    /// both views share.
    pub fn changes_since(&self, earlier: &Self) -> Vec<VoxelChange> {
        let mut changes = Vec::new();
        for (index, page) in &self.pages {
            compare_pages(*index, earlier.pages.get(index), Some(page), &mut changes);
        }
        for (index, page) in earlier.pages.iter().filter(|(index, _)| !self.pages.contains_key(*index)) {
            compare_pages(*index, Some(page), None, &mut changes);
        }
        changes
    }
}

fn compare_pages(
    index: VoxelIndex,
    before: Option<&Arc<PageView>>,
    after: Option<&Arc<PageView>>,
    changes: &mut Vec<VoxelChange>,
) {
    if before.zip(after).is_some_and(|(before, after)| Arc::ptr_eq(before, after)) {
        return;
    }
    let mask = |page: Option<&Arc<PageView>>| page.map_or(0, |page| page.mask);
    for place in ones(mask(before) | mask(after)) {
        compare_nodes(cell_at(index, place), node_of(before, place), node_of(after, place), changes);
    }
}

fn node_of(page: Option<&Arc<PageView>>, place: usize) -> NodeView<'_> {
    page.and_then(|page| page.node(place)).unwrap_or_default()
}

fn compare_nodes(
    index: VoxelIndex,
    before: NodeView<'_>,
    after: NodeView<'_>,
    changes: &mut Vec<VoxelChange>,
) {
    for place in ones(before.mask | after.mask) {
        let block = |node: NodeView<'_>| node.block(place).copied().unwrap_or_default();
        compare_blocks(cell_at(index, place), block(before), block(after), changes);
    }
}

fn compare_blocks(index: VoxelIndex, before: BlockView, after: BlockView, changes: &mut Vec<VoxelChange>) {
    for place in ones((before.occupied ^ after.occupied) | (before.inflated ^ after.inflated)) {
        let (before, after) = (before.state(place), after.state(place));
        // The states may be equal, because only the inflation of an occupied voxel may have changed.
        if before != after {
            changes.push(VoxelChange { voxel: cell_at(index, place), before, after });
        }
    }
}
