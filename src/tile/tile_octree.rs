use super::brick_octree::BrickOctree;
use super::cached_octree::CachedOctree;
use super::table::Table;
use super::voxel_cache::VoxelCacheCounts;
use crate::config::OctreeConfig;
use crate::octree::Octree;
use crate::scan::TileUpdates;
use crate::sensor::SensorModel;
use crate::space::{MortonCode, VoxelIndex, VoxelKey};
use std::borrow::Cow;

/// The octree of a tile, in the form that was chosen. Both forms give the same answers.
#[derive(Clone, Debug)]
pub(super) enum TileOctree {
    Bricks(BrickOctree),
    Cached(Box<CachedOctree>),
}

impl TileOctree {
    /// The octree of a table, up to date.
    pub(super) fn of_table(config: &OctreeConfig, table: &mut Table) -> Self {
        match config {
            OctreeConfig::Bricks => {
                let mut octree = BrickOctree::default();
                octree.sync(table);
                Self::Bricks(octree)
            }
            OctreeConfig::Cached(cache) => {
                Self::Cached(Box::new(CachedOctree::from_voxels(cache, table.iter())))
            }
        }
    }

    /// Applies updates to the table, and learns of them; `first` is the tile's lowest voxel.
    pub(super) fn apply(
        &mut self,
        table: &mut Table,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &TileUpdates,
    ) {
        match self {
            Self::Bricks(octree) => {
                octree.note_change();
                match updates {
                    TileUpdates::Once(bricks) => {
                        bricks.iter().for_each(|brick| table.update_brick(model, brick));
                    }
                    TileUpdates::Runs(bricks) => {
                        bricks.iter().for_each(|brick| table.update_runs(model, brick));
                    }
                    TileUpdates::Ordered(updates) => table.update_in_order(model, first, updates),
                }
            }
            Self::Cached(octree) => apply_cached(octree, table, model, first, updates),
        }
    }

    /// Largest log-odds of the voxels under the node at `depth` (1 to 16) that holds `code`; `None` if all are
    /// unknown.
    pub(super) fn max_under(&self, table: &Table, code: MortonCode, depth: u8) -> Option<f32> {
        match self {
            Self::Bricks(octree) => octree.max_under(table, code, depth),
            Self::Cached(octree) => octree.max_under(code, depth),
        }
    }

    /// Whether the octree has taken all updates.
    pub(super) fn is_synced(&self) -> bool {
        match self {
            Self::Bricks(octree) => octree.is_synced(),
            Self::Cached(octree) => octree.synced().is_some(),
        }
    }

    /// Lets the octree take what it has not taken yet.
    pub(super) fn sync(&mut self, table: &mut Table) {
        match self {
            Self::Bricks(octree) => octree.sync(table),
            Self::Cached(octree) => {
                octree.sync();
            }
        }
    }

    /// OctoMap's tree, up to date: borrowed where there is one, else made.
    pub(super) fn tree(&self, table: &Table) -> Cow<'_, Octree> {
        match self {
            Self::Bricks(_) => {
                let voxels = table.iter().map(|(code, evidence)| (code, evidence.log_odds as f32));
                Cow::Owned(Octree::from_sorted(voxels))
            }
            Self::Cached(octree) => match octree.synced() {
                Some(octree) => Cow::Borrowed(octree),
                None => Cow::Owned(octree.clone().into_octree()),
            },
        }
    }

    /// Nodes of the tree as of the last sync or eviction from the cache.
    pub(super) fn node_count(&self) -> u64 {
        match self {
            Self::Bricks(octree) => octree.node_count(),
            Self::Cached(octree) => octree.node_count(),
        }
    }

    /// Bytes of memory on the heap: of the tree, and of the cache.
    pub(super) fn bytes(&self) -> (usize, usize) {
        match self {
            Self::Bricks(octree) => (octree.bytes(), 0),
            Self::Cached(octree) => {
                let (tree, cache) = octree.bytes();
                (tree + size_of::<CachedOctree>(), cache)
            }
        }
    }

    /// What the voxel cache has seen, if there is one.
    pub(super) fn cache_counts(&self) -> VoxelCacheCounts {
        match self {
            Self::Bricks(_) => VoxelCacheCounts::default(),
            Self::Cached(octree) => octree.cache_counts(),
        }
    }
}

/// The cache sees every update, one by one.
fn apply_cached(
    octree: &mut CachedOctree,
    table: &mut Table,
    model: &SensorModel,
    first: VoxelIndex,
    updates: &TileUpdates,
) {
    match updates {
        TileUpdates::Once(bricks) => {
            for update in bricks {
                table.update_brick(model, update);
                for (code, evidence) in table.voxels_of_mask(update.brick, update.touched()) {
                    octree.put(code, evidence.log_odds);
                }
            }
        }
        TileUpdates::Runs(bricks) => {
            for update in bricks {
                table.update_runs(model, update);
                for run in &update.runs {
                    let code = update.brick.voxel(run.place.into());
                    if let Some(evidence) = table.get(code) {
                        octree.put(code, evidence.log_odds);
                    }
                }
            }
        }
        TileUpdates::Ordered(updates) => {
            for (offset, observation) in updates.iter() {
                let voxel = std::array::from_fn(|k| first[k].wrapping_add(offset[k]));
                let code = VoxelKey::from_index(voxel).morton();
                table.update(model, code, observation);
                if let Some(evidence) = table.get(code) {
                    octree.put(code, evidence.log_odds);
                }
            }
        }
    }
    octree.end_scan();
}
