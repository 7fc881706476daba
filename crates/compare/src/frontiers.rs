use crate::bits::Bits;
use crate::block_bits::BlockBits;
use crate::blocks::{Cube, blocks_of};
use crate::change::{bounds_m, center_m};
use crate::components::Components;
use crate::joined::{BlockParts, Joined};
use crate::mask_reader::MaskReader;
use crate::sweep::Sweep;
use crate::tile_masks::Thresholds;
use rustc_hash::FxHashSet;
use serde::Serialize;
use voxtile::mapper::MapView;
use voxtile::scan::Stop;
use voxtile::{Aabb, Point, Result, TileIndex};

/// Options of [`frontiers`].
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct FrontierOptions {
    /// Voxels of the smallest frontier that is listed. Default: 8.
    pub min_voxels: u64,
    /// Box in metres: only voxels whose center is inside are examined. Default: all.
    pub region: Option<Aabb>,
    /// Bytes of memory for tiles, but at least what one block needs. Default: 256 MiB.
    pub memory_bytes: usize,
    /// Stops the search.
    pub stop: Stop,
}

impl Default for FrontierOptions {
    fn default() -> Self {
        Self { min_voxels: 8, region: None, memory_bytes: 256 << 20, stop: Stop::default() }
    }
}

impl FrontierOptions {
    /// Sets the voxels of the smallest frontier that is listed.
    pub fn with_min_voxels(self, min_voxels: u64) -> Self {
        Self { min_voxels, ..self }
    }

    /// Sets the box in metres.
    pub fn with_region(self, region: impl Into<Option<Aabb>>) -> Self {
        Self { region: region.into(), ..self }
    }

    /// Sets the bytes of memory for tiles.
    pub fn with_memory(self, memory_bytes: usize) -> Self {
        Self { memory_bytes, ..self }
    }

    /// Sets what stops the search.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }
}

/// Result of [`frontiers`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Coverage {
    /// Number of free voxels.
    pub free: u64,
    /// Number of occupied voxels.
    pub occupied: u64,
    /// Number of voxels of the box, observed or not; `None` without a box. Saturates.
    pub voxels_of_box: Option<u64>,
    /// Share of the box that was observed, 0 to 1; `None` without a box.
    pub observed_share: Option<f64>,
    /// Number of frontier voxels, in listed and smaller frontiers.
    pub frontier_voxels: u64,
    /// Number of frontiers with fewer voxels than the least.
    pub small_frontiers: u64,
    /// The listed frontiers, the largest first.
    pub frontiers: Vec<Frontier>,
}

/// Cluster of free voxels that share faces with unknown ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Frontier {
    /// Number, from 1 on: by the number of voxels, then by the lowest voxel.
    pub number: u32,
    /// Number of voxels.
    pub voxels: u64,
    /// Area of the faces between its voxels and unknown ones, in square metres.
    pub area_m2: f64,
    /// Box of the voxels in metres.
    pub bounds_m: Aabb,
    /// Mean of the centers in metres.
    pub center_m: Point,
}

/// Finds the frontiers of a map: clusters of free voxels next to unknown ones, where exploration can continue.
///
/// `progress` receives the number of blocks done and in total.
///
/// # Errors
///
/// Fails if a tile cannot be read, or with [`Error::Stopped`](voxtile::Error::Stopped).
pub fn frontiers<V: MapView>(
    map: &V,
    options: &FrontierOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Coverage> {
    let grid = map.config().grid;
    let region = options.region.map(|region| grid.voxels_in(&region));
    let mut blocks = blocks_of(&grid, map.tile_indices().into_iter());
    if let Some(region) = region {
        blocks.retain(|&block| {
            let [min, end] = Cube::of_block(block).positions_of(&region);
            (0..3).all(|k| min[k] < end[k])
        });
    }
    let mut coverage = Coverage::default();
    let mut joined = Joined::new(options.min_voxels.max(1));
    let mut reader = MaskReader::new(map, Thresholds::of(map, f64::INFINITY), options.memory_bytes / 2);
    let sweep =
        Sweep { blocks: &blocks, memory_bytes: options.memory_bytes / 2, stop: &options.stop, progress };
    sweep.run(
        |blocks| {
            let cubes = blocks.iter().map(|&block| Cube::of_block(block).grown(1));
            let tiles: FxHashSet<TileIndex> = cubes.flat_map(|cube| cube.tiles(map)).collect();
            let mut tiles: Vec<TileIndex> = tiles.into_iter().collect();
            tiles.sort_unstable();
            reader.read(&tiles)
        },
        |block, loaded| {
            let own = Cube::of_block(block);
            let cube = own.grown(1);
            let bits = BlockBits::of(cube, &cube.tiles(map), loaded);
            let mut inside = Bits::new(cube);
            let [min, end] = region.map_or([[0; 3], [own.edge; 3]], |region| own.positions_of(&region));
            inside.add_box(min.map(|k| k + 1), end.map(|k| k + 1));
            let of_box = |bits: &Bits| Bits::combined([bits, &inside], |[bits, inside]| bits & inside);
            let (known, occupied) = (of_box(&bits.known), of_box(&bits.occupied));
            let free = Bits::combined([&known, &occupied], |[known, occupied]| known & !occupied);
            // For each direction, the free voxels whose neighbor is unknown.
            let faces: [Bits; 6] = std::array::from_fn(|k| {
                let neighbor = bits.known.moved(k / 2, k % 2 == 0);
                Bits::combined([&free, &neighbor], |[free, neighbor]| free & !neighbor)
            });
            let [a, b, c, d, e, f] = &faces;
            let frontier = Bits::combined([a, b, c, d, e, f], |faces| faces.iter().fold(0, |all, k| all | k));
            let mut components = Components::of(&frontier);
            components.count_faces(&faces);
            Ok((free.count(), occupied.count(), frontier.count(), BlockParts::of(components, block)))
        },
        |block, (free, occupied, frontier, parts)| {
            coverage.free += free;
            coverage.occupied += occupied;
            coverage.frontier_voxels += frontier;
            parts.join(block, &mut joined);
            Ok(())
        },
    )?;
    let (clusters, [small_frontiers, _]) = joined.finish();
    coverage.small_frontiers = small_frontiers;
    coverage.frontiers = clusters
        .iter()
        .zip(1..)
        .map(|(cluster, number)| Frontier {
            number,
            voxels: cluster.sums.voxels,
            area_m2: cluster.sums.faces as f64 * grid.resolution_m().powi(2),
            bounds_m: bounds_m(&cluster.sums, &grid),
            center_m: center_m(&cluster.sums, &grid),
        })
        .collect();
    if let Some(region) = region {
        let edge = |k: usize| (i64::from(region.end[k]) - i64::from(region.min[k])).max(0) as u64;
        let all = edge(0).saturating_mul(edge(1)).saturating_mul(edge(2));
        coverage.voxels_of_box = Some(all);
        let observed = (coverage.free + coverage.occupied) as f64;
        coverage.observed_share = Some(if all == 0 { 0.0 } else { observed / all as f64 });
    }
    Ok(coverage)
}
