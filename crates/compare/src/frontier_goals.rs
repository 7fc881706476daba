use crate::blocks::{BLOCK_EDGE, BlockIndex};
use crate::components::{Components, order};
use crate::frontier_search::FrontierSearch;
use crate::joined::Cluster;
use rustc_hash::FxHashMap;
use voxtile::mapper::MapView;
use voxtile::{Result, VoxelIndex};

/// A voxel of a cluster, with its squared distance from the mean in voxels.
type Candidate = (f64, VoxelIndex);

/// Finds the voxel of each cluster that is nearest to its mean, in a second pass over the blocks of the clusters. Of
/// equally near ones it is the lowest by z, then y, then x.
///
/// # Errors
///
/// A tile that cannot be read, or a request to stop.
pub(crate) fn nearest_to_means<V: MapView>(
    search: &mut FrontierSearch<'_, V>,
    clusters: &[Cluster],
) -> Result<Vec<VoxelIndex>> {
    let mut cluster_of_part: FxHashMap<VoxelIndex, usize> = FxHashMap::default();
    for (number, cluster) in clusters.iter().enumerate() {
        cluster_of_part.extend(cluster.parts.iter().map(|lowest| (*lowest, number)));
    }
    let block_of = |voxel: &VoxelIndex| voxel.map(|k| k.div_euclid(BLOCK_EDGE as i32));
    let mut blocks: Vec<BlockIndex> = cluster_of_part.keys().map(block_of).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let mut nearest: Vec<Candidate> = vec![(f64::INFINITY, [0; 3]); clusters.len()];
    search.for_each_block(
        &blocks,
        &|_, _| {},
        |_, bits| {
            let components = Components::of(&bits.frontier);
            let mut of_block: FxHashMap<usize, Candidate> = FxHashMap::default();
            for (voxel, part) in components.voxels() {
                let lowest = components.parts[part as usize].lowest;
                let Some(&number) = cluster_of_part.get(&lowest) else { continue };
                let candidate = (squared_distance(voxel, &clusters[number]), voxel);
                let best = of_block.entry(number).or_insert(candidate);
                *best = nearer(*best, candidate);
            }
            of_block
        },
        |_, of_block| {
            for (number, candidate) in of_block {
                nearest[number] = nearer(nearest[number], candidate);
            }
        },
    )?;
    Ok(nearest.into_iter().map(|(_, voxel)| voxel).collect())
}

fn squared_distance(voxel: VoxelIndex, cluster: &Cluster) -> f64 {
    let mean = cluster.sums.total.map(|total| total as f64 / cluster.sums.voxels as f64);
    (0..3).map(|k| (f64::from(voxel[k]) - mean[k]).powi(2)).sum()
}

fn nearer(a: Candidate, b: Candidate) -> Candidate {
    let is_b = b.0.total_cmp(&a.0).then_with(|| order(b.1).cmp(&order(a.1))).is_lt();
    if is_b { b } else { a }
}
