use crate::heights::nth;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use voxtile::mapper::MapView;
use voxtile::space::{Point, TileIndex, VoxelIndex};
use voxtile::{Error, Result};

/// Columns around a trajectory, and whether something is above them. Pictures of rooms cut the ceiling, which would
/// hide everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Roof {
    /// Columns of half a metre that have free space at the height of the sensor, in tiles along the trajectory.
    pub columns: u64,
    /// Columns of these with an occupied voxel above the sensor, up to 20 m.
    pub roofed: u64,
    /// Roofed columns with an occupied voxel below the sensor, down to 20 m.
    pub floored: u64,
    /// Median height of the sensor in metres.
    pub sensor_m: f64,
    /// Difference between its highest and lowest position, in metres.
    pub spread_m: f64,
    /// Height in metres below which a tenth of the roofs begin; infinite without a roof.
    pub ceiling_m: f64,
}

/// Maximum number of columns of tiles that are read, evenly along the trajectory.
const MAX_STACKS: usize = 32;
/// A roof is at most this far above the sensor, and a floor below it.
const MAX_AWAY_M: f64 = 20.0;
/// Width of the columns: sparse points on a ceiling must not leave gaps between them.
const COLUMN_M: f64 = 0.5;
/// Share of roofed columns from which on the map is of rooms.
const ROOM_SHARE: f64 = 0.55;
/// Share of roofed columns with a floor from which on z is up. Cameras have other axes: a cut would leave nothing.
const FLOOR_SHARE: f64 = 0.2;
/// What hangs lower above the sensor is furniture, not a ceiling.
const MIN_CEILING_M: f64 = 0.3;
/// Heights of a sensor that stays on one floor differ by less. One cut would hide the upper storeys of others.
const MAX_SPREAD_M: f64 = 2.0;

impl Roof {
    /// Counts the columns around a trajectory; `None` without a position. Reads up to 32 columns of tiles; unreadable
    /// tiles are skipped.
    ///
    /// # Errors
    ///
    /// Fails on errors that do not concern a single tile, such as [`Error::Changed`].
    pub fn of(map: &dyn MapView, path: &[Point]) -> Result<Option<Self>> {
        let grid = map.config().grid;
        let mut visited: BTreeMap<[i32; 2], Vec<f64>> = BTreeMap::new();
        for (place, voxel) in path.iter().filter_map(|place| Some((place, grid.voxel_of(*place)?))) {
            let [x, y, _] = grid.tile_of_voxel(voxel).to_array();
            visited.entry([x, y]).or_default().push(place[2]);
        }
        let heights: Vec<f64> = visited.values().flatten().copied().collect();
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let spread_m = highest - heights.iter().copied().fold(f64::INFINITY, f64::min);
        let Some(sensor_m) = median(heights) else { return Ok(None) };
        let stacks: Vec<([i32; 2], f64)> =
            visited.into_iter().filter_map(|(at, heights)| Some((at, median(heights)?))).collect();
        let every = stacks.len().div_ceil(MAX_STACKS);
        let stacks: Vec<([i32; 2], f64)> = stacks.into_iter().step_by(every.max(1)).collect();
        let mut tiles: HashMap<[i32; 2], Vec<TileIndex>> = HashMap::new();
        for tile in map.tile_indices() {
            let [x, y, _] = tile.to_array();
            tiles.entry([x, y]).or_default().push(tile);
        }
        let counts = stacks
            .par_iter()
            .map(|(at, height_m)| count(map, tiles.get(at).map_or(&[], Vec::as_slice), *height_m));
        let Counts { columns, roofed, floored, ceilings } =
            counts.try_reduce(Counts::default, |a, b| Ok(a.plus(b)))?;
        let tenth = ceilings.values().sum::<u64>() / 10;
        let ceiling_m = nth(ceilings.iter(), tenth).map_or(f64::INFINITY, |z| grid.corner_m(z));
        Ok(Some(Self { columns, roofed, floored, sensor_m, spread_m, ceiling_m }))
    }

    /// Share of roofed columns, 0 to 1.
    pub fn share(&self) -> f64 {
        self.roofed as f64 / self.columns.max(1) as f64
    }

    /// Returns the height in metres at which pictures of rooms cut the ceiling: that of the sensor. `None` if less than
    /// 55 % of the columns are roofed, if less than 20 % of these have a floor (z is not up), or if the sensor's heights
    /// differ by more than 2 m (several storeys, ramps).
    /// Measured: rooms have 70 to 99 %, streets and campuses 1 to 39 %.
    pub fn cut_m(&self) -> Option<f64> {
        let is_roofed = self.columns > 0 && self.share() >= ROOM_SHARE;
        let has_floor = self.floored as f64 >= FLOOR_SHARE * self.roofed as f64;
        (is_roofed && has_floor && self.spread_m <= MAX_SPREAD_M).then_some(self.sensor_m)
    }

    /// Like [`Roof::cut_m`], for oblique views: walls are cut halfway between the sensor, which may be near the floor,
    /// and the ceiling.
    pub fn oblique_cut_m(&self) -> Option<f64> {
        let halfway_m = f64::midpoint(self.sensor_m, self.ceiling_m);
        self.cut_m().map(|cut_m| if halfway_m.is_finite() { halfway_m.max(cut_m) } else { cut_m })
    }
}

/// Columns of stacks of tiles; see [`Roof`].
#[derive(Clone, Debug, Default)]
struct Counts {
    columns: u64,
    roofed: u64,
    floored: u64,
    /// Number of columns by the height, in voxels, of the lowest occupied voxel well above the sensor.
    ceilings: BTreeMap<i32, u64>,
}

impl Counts {
    fn plus(mut self, other: Self) -> Self {
        self.columns += other.columns;
        self.roofed += other.roofed;
        self.floored += other.floored;
        other.ceilings.into_iter().for_each(|(z, count)| *self.ceilings.entry(z).or_default() += count);
        self
    }

    fn add(&mut self, column: Column) {
        self.columns += u64::from(column.is_free);
        self.roofed += u64::from(column.is_free && column.has_roof);
        self.floored += u64::from(column.is_free && column.has_roof && column.has_floor);
        if let Some(z) = column.ceiling {
            *self.ceilings.entry(z).or_default() += 1;
        }
    }
}

/// Column of half a metre in a stack of tiles.
#[derive(Clone, Copy, Debug, Default)]
struct Column {
    /// Whether it has free space at the height of the sensor.
    is_free: bool,
    /// Whether it has an occupied voxel above the sensor.
    has_roof: bool,
    /// Whether it has an occupied voxel below the sensor.
    has_floor: bool,
    /// Height of the lowest occupied voxel well above the sensor, in voxels.
    ceiling: Option<i32>,
}

/// Counts the columns of a stack of tiles with a sensor at a height.
fn count(map: &dyn MapView, tiles: &[TileIndex], height_m: f64) -> Result<Counts> {
    let (grid, occupied_from) = (map.config().grid, map.config().occupied_log_odds());
    let Some([_, _, sensor]) = grid.voxel_of([0.0, 0.0, height_m]) else { return Ok(Counts::default()) };
    let away = (MAX_AWAY_M / grid.resolution_m()).min(1e9) as i32;
    let [lowest, highest] = [sensor.saturating_sub(away), sensor.saturating_add(away)];
    let wide = ((COLUMN_M / grid.resolution_m()).round().min(1e9) as i32).max(1);
    let edge = grid.voxels_per_tile_edge().div_euclid(wide) + 1;
    let mut columns = vec![Column::default(); (edge * edge) as usize];
    for &index in tiles {
        let voxels = grid.voxels_of_tile(index);
        if voxels.end[2] <= lowest || voxels.min[2] > highest {
            continue;
        }
        let tile = match map.tile_uncached(index) {
            Ok(Some(tile)) => tile,
            Ok(None) | Err(Error::Damaged { .. } | Error::Io { .. }) => continue,
            Err(error) => return Err(error),
        };
        let place = |voxel: VoxelIndex| {
            let [x, y] = [0, 1].map(|k| voxel[k].wrapping_sub(voxels.min[k]) / wide);
            (x + y * edge) as usize
        };
        if (voxels.min[2]..voxels.end[2]).contains(&sensor) {
            for x in voxels.min[0]..voxels.end[0] {
                for y in voxels.min[1]..voxels.end[1] {
                    let evidence = tile.evidence([x, y, sensor]);
                    if evidence.is_some_and(|evidence| evidence.log_odds < occupied_from) {
                        columns[place([x, y, sensor])].is_free = true;
                    }
                }
            }
        }
        for voxel in tile.voxels_from(occupied_from) {
            let z = voxel.index[2];
            if (lowest..=highest).contains(&z)
                && z != sensor
                && let Some(column) = columns.get_mut(place(voxel.index))
            {
                column.has_floor |= z < sensor;
                column.has_roof |= z > sensor;
                if grid.corner_m(z) > height_m + MIN_CEILING_M {
                    column.ceiling = Some(column.ceiling.map_or(z, |lowest| lowest.min(z)));
                }
            }
        }
    }
    let mut counts = Counts::default();
    columns.into_iter().for_each(|column| counts.add(column));
    Ok(counts)
}

fn median(mut heights: Vec<f64>) -> Option<f64> {
    heights.sort_unstable_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied()
}
