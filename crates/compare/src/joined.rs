use crate::blocks::{BLOCK_EDGE, BlockIndex, Cube};
use crate::components::{Components, Sums, order};
use crate::sets::Sets;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use voxtile::VoxelIndex;

/// Connected voxels across blocks.
///
/// Blocks arrive by x, then y, then z. Only the voxels at the borders of the last two layers of blocks are kept, and
/// the clusters that reach these: all others are complete.
pub(crate) struct Joined {
    min_voxels: u64,
    sets: Sets,
    /// By number in `sets`; empty unless it represents its set.
    clusters: Vec<Cluster>,
    /// Border voxels with their numbers in `sets`, by the x index of the block.
    borders: BTreeMap<i32, FxHashMap<VoxelIndex, u32>>,
    complete: Vec<Cluster>,
    /// Number of complete clusters with fewer voxels than the least, and of their voxels.
    small: [u64; 2],
}

/// Cluster of connected voxels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cluster {
    pub(crate) sums: Sums,
    /// Lowest voxels of its parts in blocks.
    pub(crate) parts: Vec<VoxelIndex>,
}

impl Joined {
    /// Creates the set of clusters that have at least some voxels.
    pub(crate) fn new(min_voxels: u64) -> Self {
        Self {
            min_voxels,
            sets: Sets::default(),
            clusters: Vec::new(),
            borders: BTreeMap::new(),
            complete: Vec::new(),
            small: [0; 2],
        }
    }

    /// Adds the parts of a block.
    pub(crate) fn add(&mut self, block: BlockIndex, parts: Vec<Sums>, border: &[(VoxelIndex, u32)]) {
        if self.borders.keys().next_back().is_some_and(|last| *last < block[0]) {
            self.complete_before(block[0]);
        }
        let first = self.sets.len() as u32;
        for sums in parts {
            self.sets.push();
            self.clusters.push(Cluster { parts: vec![sums.lowest], sums });
        }
        let cube = Cube::of_block(block);
        for &(voxel, part) in border {
            self.join_neighbors(cube, voxel, first + part);
        }
        let own = self.borders.entry(block[0]).or_default();
        own.extend(border.iter().map(|(voxel, part)| (*voxel, first + part)));
    }

    /// Unites a voxel with its neighbors in other blocks.
    fn join_neighbors(&mut self, own: Cube, voxel: VoxelIndex, number: u32) {
        for step in 0..27 {
            let steps = [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1];
            let near: [i64; 3] = std::array::from_fn(|k| i64::from(voxel[k]) + i64::from(steps[k]));
            let is_own = (0..3).all(|k| (0..own.edge as i64).contains(&(near[k] - own.min[k])));
            if is_own {
                continue;
            }
            let slab = near[0].div_euclid(BLOCK_EDGE) as i32;
            let Some(of_slab) = self.borders.get(&slab) else { continue };
            let other = of_slab.get(&near.map(|k| k as i32)).copied();
            if let Some(other) = other {
                self.unite(number, other);
            }
        }
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.sets.root(a), self.sets.root(b));
        if a == b {
            return;
        }
        self.sets.unite(a, b);
        let mut lost = std::mem::take(&mut self.clusters[a.max(b) as usize]);
        let kept = &mut self.clusters[a.min(b) as usize];
        kept.sums.add(&lost.sums);
        if kept.parts.len() < lost.parts.len() {
            std::mem::swap(&mut kept.parts, &mut lost.parts);
        }
        kept.parts.append(&mut lost.parts);
    }

    /// Forgets the borders that no block with this x index or a higher one touches, and completes the clusters that
    /// reach no other border.
    fn complete_before(&mut self, x: i32) {
        self.borders.retain(|slab, _| i64::from(*slab) >= i64::from(x) - 1);
        let mut sets = Sets::default();
        let mut clusters = Vec::new();
        // New numbers of the clusters that remain, by their old ones.
        let mut renumbered: FxHashMap<u32, u32> = FxHashMap::default();
        for number in self.borders.values_mut().flat_map(|of_slab| of_slab.values_mut()) {
            let root = self.sets.root(*number);
            *number = *renumbered.entry(root).or_insert_with(|| {
                clusters.push(std::mem::take(&mut self.clusters[root as usize]));
                sets.push()
            });
        }
        self.sets = sets;
        for cluster in std::mem::replace(&mut self.clusters, clusters) {
            self.complete(cluster);
        }
    }

    fn complete(&mut self, cluster: Cluster) {
        match cluster.sums.voxels {
            0 => {}
            voxels if voxels < self.min_voxels => {
                self.small[0] += 1;
                self.small[1] += voxels;
            }
            _ => self.complete.push(cluster),
        }
    }

    /// Returns the clusters, the largest first, and the numbers of the smaller clusters and of their voxels.
    pub(crate) fn finish(mut self) -> (Vec<Cluster>, [u64; 2]) {
        for cluster in std::mem::take(&mut self.clusters) {
            self.complete(cluster);
        }
        self.complete.sort_unstable_by_key(|cluster| {
            (std::cmp::Reverse(cluster.sums.voxels), order(cluster.sums.lowest))
        });
        (self.complete, self.small)
    }
}

/// Parts of a block and their voxels at its border.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct BlockParts {
    pub(crate) parts: Vec<Sums>,
    pub(crate) border: Vec<(VoxelIndex, u32)>,
}

impl BlockParts {
    pub(crate) fn of(components: Components, block: BlockIndex) -> Self {
        let border = components.border(Cube::of_block(block));
        Self { parts: components.parts, border }
    }

    pub(crate) fn join(self, block: BlockIndex, joined: &mut Joined) {
        joined.add(block, self.parts, &self.border);
    }
}
