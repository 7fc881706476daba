use super::octree_statistics::{OctreeTimes, Stopwatch};
use super::shared_tree::{Batch, SharedTree};
use super::voxel_cache::VoxelCache;
use crate::scan::TileUpdates;
use crate::sensor::SensorModel;
use crate::space::{MortonCode, VoxelIndex};
use crate::tile::table::Table;

/// Passes all updates of one scan from the table to the voxel cache, or to the tree if there is no cache: in order,
/// each with its resulting log-odds.
///
/// Updates are passed in chunks, so that timing each stage costs little.
pub(crate) struct UpdateStream<'a> {
    cache: Option<&'a mut VoxelCache>,
    tree: &'a SharedTree,
    chunk: Batch,
    watch: Stopwatch,
    /// Time spent in each stage.
    pub(crate) times: OctreeTimes,
    /// Number of updates written to the tree.
    pub(crate) written: usize,
}

/// Number of updates per chunk: 16 KiB.
const CHUNK: usize = 1024;

impl<'a> UpdateStream<'a> {
    pub(crate) fn into(cache: Option<&'a mut VoxelCache>, tree: &'a SharedTree) -> Self {
        let chunk = Vec::with_capacity(CHUNK);
        Self { cache, tree, chunk, watch: Stopwatch::start(), times: OctreeTimes::default(), written: 0 }
    }

    /// Applies updates to the table and passes them on; `first` is the tile's lowest voxel.
    pub(crate) fn apply(
        &mut self,
        table: &mut Table,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &TileUpdates,
    ) {
        match updates {
            TileUpdates::Masks(bricks) => {
                for update in bricks {
                    table.update_brick(model, update);
                    for (code, evidence) in table.voxels_of_mask(update.brick, update.touched()) {
                        self.push(code, evidence.log_odds);
                    }
                }
            }
            // Runs contain neither the order of rays nor intermediate log-odds, so a run is one update.
            TileUpdates::Runs(runs) => {
                for update in runs.bricks() {
                    table.update_runs_of_brick(model, update);
                    for run in update.iter() {
                        let code = update.brick.voxel(run.place.into());
                        if let Some(evidence) = table.get(code) {
                            self.push(code, evidence.log_odds);
                        }
                    }
                }
            }
            TileUpdates::Ordered(updates) => {
                table.update_in_order_with(model, first, updates, |code, log_odds| {
                    self.push(code, log_odds);
                });
            }
            TileUpdates::Packed(packed) => {
                packed.iter().for_each(|updates| self.apply(table, model, first, &updates));
            }
            TileUpdates::Layers(hits) => table.add_hits(first, hits),
            TileUpdates::WithLayers(updates, hits) => {
                self.apply(table, model, first, updates);
                table.add_hits(first, hits);
            }
        }
        self.pass_on();
    }

    fn push(&mut self, code: MortonCode, log_odds: f64) {
        self.chunk.push((code, log_odds as f32));
        if self.chunk.len() == CHUNK {
            self.pass_on();
        }
    }

    fn pass_on(&mut self) {
        self.times.table_update_ns += self.watch.lap_ns();
        match &mut self.cache {
            Some(cache) => {
                self.chunk.iter().for_each(|&(code, log_odds)| cache.put(code, log_odds));
                self.times.cache_insertion_ns += self.watch.lap_ns();
            }
            None => {
                self.tree.change(|tree| {
                    self.chunk.iter().for_each(|&(code, log_odds)| tree.set(code, log_odds));
                });
                self.written += self.chunk.len();
                self.times.octree_update_ns += self.watch.lap_ns();
            }
        }
        self.chunk.clear();
    }
}
