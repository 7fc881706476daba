use crate::blocks::BlockIndex;
use crate::change::{Change, ChangeKind, Clusters, Comparison, EpochCounts};
use crate::compare::{BlockResult, Comparer, KINDS};
use crate::components::order;
use crate::joined::Joined;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use voxtile::Grid;
use voxtile::mapper::MapView;

/// Results of blocks, collected in the order of these.
pub(crate) struct Collected {
    grid: Grid,
    tolerance_voxels: u32,
    min_voxels: u64,
    certain_log_odds: f64,
    counts: [EpochCounts; 2],
    /// By [`KINDS`].
    joined: [Joined; 2],
}

impl Collected {
    pub(crate) fn new<A: MapView, B: MapView>(comparer: &Comparer<'_, A, B>) -> Self {
        let min_voxels = comparer.options.min_voxels.max(1);
        Self {
            grid: *comparer.grid(),
            tolerance_voxels: comparer.tolerance_voxels,
            min_voxels,
            certain_log_odds: comparer.certain_log_odds,
            counts: comparer.counts(),
            joined: KINDS.map(|_| Joined::new(min_voxels)),
        }
    }

    pub(crate) fn take(&mut self, block: BlockIndex, result: BlockResult) {
        for (all, of_block) in self.counts.iter_mut().zip(result.counts) {
            *all += of_block;
        }
        for (joined, parts) in self.joined.iter_mut().zip(result.parts) {
            parts.join(block, joined);
        }
    }

    pub(crate) fn finish(self) -> Comparison {
        let [vanished, appeared] = self.joined.map(Joined::finish);
        let clusters = [&vanished, &appeared]
            .map(|(listed, small)| Clusters::new(listed.iter().map(|cluster| &cluster.sums), *small));
        let mut all: Vec<_> = vanished.0.into_iter().map(|cluster| (ChangeKind::Vanished, cluster)).collect();
        all.extend(appeared.0.into_iter().map(|cluster| (ChangeKind::Appeared, cluster)));
        all.sort_unstable_by_key(|(_, cluster)| (Reverse(cluster.sums.voxels), order(cluster.sums.lowest)));
        let mut change_of_part = FxHashMap::default();
        let mut changes = Vec::with_capacity(all.len());
        for ((kind, cluster), number) in all.into_iter().zip(1..) {
            change_of_part.extend(cluster.parts.into_iter().map(|lowest| (lowest, number)));
            changes.push(Change::of(number, kind, &cluster.sums, &self.grid));
        }
        Comparison {
            tolerance_voxels: self.tolerance_voxels,
            min_voxels: self.min_voxels,
            certain_log_odds: self.certain_log_odds,
            before: self.counts[0],
            after: self.counts[1],
            vanished: clusters[0],
            appeared: clusters[1],
            changes,
            change_of_part,
        }
    }
}
