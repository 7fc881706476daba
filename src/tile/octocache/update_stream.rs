use super::octree_statistics::{OctreeTimes, Stopwatch};
use super::shared_tree::{Batch, SharedTree};
use super::voxel_cache::VoxelCache;
use crate::scan::TileUpdates;
use crate::sensor::SensorModel;
use crate::space::{MortonCode, VoxelIndex};
use crate::tile::table::Table;

/// The updates of one scan on their way from the table to the voxel cache, or to the tree where there is no cache:
/// every single one, in order, each with the log-odds that it led to.
///
/// They go in portions, so that each stage can be measured without that taking time.
pub(crate) struct UpdateStream<'a> {
    cache: Option<&'a mut VoxelCache>,
    tree: &'a SharedTree,
    portion: Batch,
    watch: Stopwatch,
    /// Time spent in each stage.
    pub(crate) times: OctreeTimes,
    /// Updates written to the tree.
    pub(crate) written: usize,
}

/// Updates at a time: 16 KiB.
const PORTION: usize = 1024;

impl<'a> UpdateStream<'a> {
    pub(crate) fn into(cache: Option<&'a mut VoxelCache>, tree: &'a SharedTree) -> Self {
        let portion = Vec::with_capacity(PORTION);
        Self { cache, tree, portion, watch: Stopwatch::start(), times: OctreeTimes::default(), written: 0 }
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
            TileUpdates::Once(bricks) => {
                for update in bricks {
                    table.update_brick(model, update);
                    for (code, evidence) in table.voxels_of_mask(update.brick, update.touched()) {
                        self.push(code, evidence.log_odds);
                    }
                }
            }
            // The order of rays is lost here, and with it what a voxel was in between: a run is one update.
            TileUpdates::Runs(bricks) => {
                for update in bricks {
                    table.update_runs(model, std::slice::from_ref(update));
                    for run in &update.runs {
                        let code = update.brick.voxel(run.place.into());
                        if let Some(evidence) = table.get(code) {
                            self.push(code, evidence.log_odds);
                        }
                    }
                }
            }
            TileUpdates::Ordered(updates) => {
                table.update_in_order_and_tell(model, first, updates, |code, log_odds| {
                    self.push(code, log_odds);
                });
            }
            TileUpdates::Packed(packed) => {
                packed.iter().for_each(|updates| self.apply(table, model, first, &updates));
            }
        }
        self.pass_on();
    }

    fn push(&mut self, code: MortonCode, log_odds: f64) {
        self.portion.push((code, log_odds as f32));
        if self.portion.len() == PORTION {
            self.pass_on();
        }
    }

    fn pass_on(&mut self) {
        self.times.table_update_ns += self.watch.lap_ns();
        match &mut self.cache {
            Some(cache) => {
                self.portion.iter().for_each(|&(code, log_odds)| cache.put(code, log_odds));
                self.times.cache_insertion_ns += self.watch.lap_ns();
            }
            None => {
                self.tree.change(|tree| {
                    self.portion.iter().for_each(|&(code, log_odds)| tree.set(code, log_odds));
                });
                self.written += self.portion.len();
                self.times.octree_update_ns += self.watch.lap_ns();
            }
        }
        self.portion.clear();
    }
}
