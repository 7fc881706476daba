use crate::frontiers::FrontierOptions;
use crate::nearest_position::Positions;
use rayon::prelude::*;
use serde::Serialize;
use voxtile::mapper::MapView;
use voxtile::{Point, Result, TileIndex};

/// Least distances of the classes in metres.
const DISTANCES_M: [f64; 9] = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
/// Number of classes of observation counts: from 1, 2, 4, 8, ... on.
const COUNT_CLASSES: usize = 12;

/// How often the occupied voxels of a map were observed, and from how far.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Observations {
    /// Occupied voxels by their number of observations, hits and misses.
    pub counts: Vec<Class>,
    /// Occupied voxels by the distance in metres to the nearest position of the sensor; `None` without positions.
    pub distances_m: Option<Vec<Class>>,
}

/// Voxels of a class, which ends where the next one begins.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Class {
    /// Least value.
    pub from: f64,
    /// Number of voxels.
    pub voxels: u64,
}

/// Counts of one part of the map.
#[derive(Clone, Copy, Default)]
struct Sums {
    counts: [u64; COUNT_CLASSES],
    distances: [u64; DISTANCES_M.len()],
}

impl Sums {
    fn and(mut self, other: &Self) -> Self {
        self.counts.iter_mut().zip(other.counts).for_each(|(sum, more)| *sum += more);
        self.distances.iter_mut().zip(other.distances).for_each(|(sum, more)| *sum += more);
        self
    }
}

/// Counts the occupied voxels of a map by their number of observations, and by the distance to the nearest of the
/// `positions` of its sensor, in metres. Of positions in one voxel, one counts.
///
/// Of the options, `min_voxels` and `memory_bytes` are ignored: a tile per core is in memory. `progress` receives the
/// number of tiles done and in total.
///
/// # Errors
///
/// Fails if a tile cannot be read, or with [`Error::Stopped`](voxtile::Error::Stopped).
pub fn observations<V: MapView>(
    map: &V,
    positions: Option<&[Point]>,
    options: &FrontierOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Observations> {
    let tiles = map.tile_indices();
    let positions = positions.map(|positions| Positions::new(&map.config().grid, positions));
    let mut sums = Sums::default();
    progress(0, tiles.len() as u64);
    let at_a_time = 2 * rayon::current_num_threads().max(1);
    for (number, some) in tiles.chunks(at_a_time).enumerate() {
        options.stop.check()?;
        let of_tiles: Result<Vec<Sums>> =
            some.par_iter().map(|&tile| sums_of_tile(map, tile, positions.as_ref(), options)).collect();
        sums = of_tiles?.iter().fold(sums, Sums::and);
        progress((number * at_a_time + some.len()) as u64, tiles.len() as u64);
    }
    let classes = |from: &mut dyn Iterator<Item = f64>, voxels: &[u64]| {
        let used = voxels.iter().rposition(|voxels| *voxels > 0).map_or(0, |last| last + 1);
        from.zip(&voxels[..used]).map(|(from, &voxels)| Class { from, voxels }).collect()
    };
    Ok(Observations {
        counts: classes(&mut (0..).map(|class| f64::from(class).exp2()), &sums.counts),
        distances_m: positions.map(|_| classes(&mut DISTANCES_M.into_iter(), &sums.distances)),
    })
}

fn sums_of_tile(
    map: &impl MapView,
    tile: TileIndex,
    positions: Option<&Positions>,
    options: &FrontierOptions,
) -> Result<Sums> {
    let mut sums = Sums::default();
    let grid = map.config().grid;
    let is_outside = |center_m| options.region.is_some_and(|region| !region.contains(center_m));
    let near = positions.map(|positions| positions.near(&grid.voxels_of_tile(tile), &grid));
    for voxel in map.voxels_from(tile, map.config().occupied_log_odds())? {
        let center_m = grid.center_m(voxel.index);
        if is_outside(center_m) {
            continue;
        }
        let class = voxel.evidence.observation_count.max(1).ilog2() as usize;
        sums.counts[class.min(COUNT_CLASSES - 1)] += 1;
        if let Some(distance_m) = near.as_ref().and_then(|near| near.distance_m(center_m)) {
            let class = DISTANCES_M.partition_point(|from_m| *from_m <= distance_m) - 1;
            sums.distances[class] += 1;
        }
    }
    Ok(sums)
}
