use super::brick_octree::BrickOctree;
use crate::octree::Octree;
use crate::scan::TileUpdates;
use crate::sensor::SensorModel;
use crate::space::{MortonCode, VoxelIndex};
use crate::tile::octocache::{PointerOctree, VoxelCacheCounts};
use crate::tile::table::Table;

/// Octree of a tile in the configured form. Both forms give the same answers.
#[derive(Clone, Debug)]
pub(crate) enum TileOctree {
    Bricks(BrickOctree),
    Pointers(Box<PointerOctree>),
}

impl TileOctree {
    /// Applies updates to the table and to the octree; `first` is the tile's lowest voxel.
    pub(crate) fn apply(
        &mut self,
        table: &mut Table,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &TileUpdates,
    ) {
        match self {
            Self::Bricks(octree) => {
                octree.note_change();
                table.apply(model, first, updates);
            }
            Self::Pointers(octree) => octree.apply(table, model, first, updates),
        }
    }

    /// Returns the largest log-odds of the voxels under the node at `depth` (1 to 16) that contains `code`; `None` if
    /// all are unknown.
    pub(crate) fn max_under(&self, table: &Table, code: MortonCode, depth: u8) -> Option<f32> {
        match self {
            Self::Bricks(octree) => octree.max_under(table, code, depth),
            Self::Pointers(octree) => octree.max_under(table, code, depth),
        }
    }

    /// Returns whether the octree contains all updates.
    pub(crate) fn is_synced(&self) -> bool {
        match self {
            Self::Bricks(octree) => octree.is_synced(),
            Self::Pointers(octree) => octree.is_synced(),
        }
    }

    /// Updates the octree.
    pub(crate) fn sync(&mut self, table: &mut Table) {
        match self {
            Self::Bricks(octree) => octree.sync(table),
            Self::Pointers(octree) => octree.sync(table),
        }
    }

    /// Returns OctoMap's tree, up to date.
    pub(crate) fn tree(&self, table: &Table) -> Octree {
        match self {
            Self::Bricks(_) => {
                let voxels = table.iter().map(|(code, evidence)| (code, evidence.log_odds as f32));
                Octree::from_sorted(voxels)
            }
            Self::Pointers(octree) => octree.tree(table),
        }
    }

    /// Number of nodes of the tree as of the last sync or eviction from the cache.
    pub(crate) fn node_count(&self) -> u64 {
        match self {
            Self::Bricks(octree) => octree.node_count(),
            Self::Pointers(octree) => octree.node_count(),
        }
    }

    /// Bytes of memory on the heap: of the tree, and of the cache.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        match self {
            Self::Bricks(octree) => (octree.bytes(), 0),
            Self::Pointers(octree) => {
                let (tree, cache) = octree.bytes();
                (tree + size_of::<PointerOctree>(), cache)
            }
        }
    }

    /// Counts of the voxel cache; zero without a cache.
    pub(crate) fn cache_counts(&self) -> VoxelCacheCounts {
        match self {
            Self::Bricks(_) => VoxelCacheCounts::default(),
            Self::Pointers(octree) => octree.cache_counts(),
        }
    }
}
