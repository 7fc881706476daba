use crate::change::{bounds_m, center_m};
use crate::components::Components;
use crate::frontier_goals::nearest_to_means;
use crate::frontier_search::FrontierSearch;
use crate::joined::{BlockParts, Cluster, Joined};
use serde::Serialize;
use voxtile::mapper::MapView;
use voxtile::scan::Stop;
use voxtile::{Aabb, Grid, Point, Result, VoxelIndex};

/// Options of [`frontiers`] and [`frontiers_in`].
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
    /// Mean of the centers in metres. Its place may be occupied or unknown.
    pub center_m: Point,
    /// Center in metres of its voxel that is nearest to the mean: free space next to the unknown, a goal for a robot.
    pub goal_m: Point,
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
    let search = &mut FrontierSearch::new(map, options);
    let (mut coverage, clusters) = covered(search, options.min_voxels, progress)?;
    coverage.frontiers = numbered(search, &clusters, &map.config().grid)?;
    Ok(coverage)
}

/// Finds the frontiers inside a box in metres: of any map, also of one that is being built
/// ([`LiveView`](voxtile::LiveView)).
///
/// Frontiers are those of the voxels whose center is inside; `options.region` is ignored. The cost depends on the box,
/// not on the map.
///
/// ```
/// use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Scan};
/// use voxtile_compare::{FrontierOptions, frontiers_in};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// map.insert_scan(&Scan { origin: [0.05; 3], points: vec![[2.05, 0.05, 0.05]], intensities: None })?;
/// let around = Aabb { min: [-1.0; 3], max: [1.0; 3] };
/// let found = frontiers_in(&map, &around, &FrontierOptions::default())?;
/// assert_eq!(found.len(), 1);
/// assert!((found[0].area_m2 - 0.41).abs() < 1e-9); // Around a ray of ten voxels, and behind the sensor.
/// assert!((found[0].goal_m[0] - 0.45).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// As for [`frontiers`].
pub fn frontiers_in<V: MapView>(map: &V, region: &Aabb, options: &FrontierOptions) -> Result<Vec<Frontier>> {
    let options = &options.clone().with_region(*region);
    let search = &mut FrontierSearch::new(map, options);
    let (_, clusters) = covered(search, options.min_voxels, &|_, _| {})?;
    numbered(search, &clusters, &map.config().grid)
}

/// Counts voxels, and returns the clusters to list, the largest first.
fn covered<V: MapView>(
    search: &mut FrontierSearch<'_, V>,
    min_voxels: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<(Coverage, Vec<Cluster>)> {
    let mut coverage = Coverage::default();
    let mut joined = Joined::new(min_voxels.max(1));
    search.for_each_block(
        &search.blocks(),
        progress,
        |block, bits| {
            let mut components = Components::of(&bits.frontier);
            components.count_faces(&bits.faces);
            (bits.free, bits.occupied, bits.frontier.count(), BlockParts::of(components, block))
        },
        |block, (free, occupied, frontier, parts)| {
            coverage.free += free;
            coverage.occupied += occupied;
            coverage.frontier_voxels += frontier;
            parts.join(block, &mut joined);
        },
    )?;
    let (clusters, [small_frontiers, _]) = joined.finish();
    coverage.small_frontiers = small_frontiers;
    if let Some(region) = search.region() {
        let edge = |k: usize| (i64::from(region.end[k]) - i64::from(region.min[k])).max(0) as u64;
        let all = edge(0).saturating_mul(edge(1)).saturating_mul(edge(2));
        coverage.voxels_of_box = Some(all);
        let observed = (coverage.free + coverage.occupied) as f64;
        coverage.observed_share = Some(if all == 0 { 0.0 } else { observed / all as f64 });
    }
    Ok((coverage, clusters))
}

/// Returns the clusters with their goals, which take a second pass over the blocks of the clusters.
fn numbered<V: MapView>(
    search: &mut FrontierSearch<'_, V>,
    clusters: &[Cluster],
    grid: &Grid,
) -> Result<Vec<Frontier>> {
    let goals = nearest_to_means(search, clusters)?;
    let frontier = |((cluster, goal), number): ((&Cluster, VoxelIndex), u32)| Frontier {
        number,
        voxels: cluster.sums.voxels,
        area_m2: cluster.sums.faces as f64 * grid.resolution_m().powi(2),
        bounds_m: bounds_m(&cluster.sums, grid),
        center_m: center_m(&cluster.sums, grid),
        goal_m: grid.center_m(goal),
    };
    Ok(clusters.iter().zip(goals).zip(1..).map(frontier).collect())
}
