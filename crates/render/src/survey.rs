use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::mapper::MapView;
use voxtile::sensor::Evidence;
use voxtile::space::{TileBox, TileIndex};
use voxtile::{Error, Result};

/// Counts of the content of a map, voxel by voxel.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Survey {
    /// Number of observed voxels.
    pub voxels: u64,
    /// Number of occupied voxels.
    pub occupied: u64,
    /// Number of columns with an observed voxel.
    pub columns: u64,
    /// Number of columns with an occupied voxel.
    pub occupied_columns: u64,
    /// Area of the columns with an observed voxel, in square metres.
    pub area_m2: f64,
    /// Volume of the observed voxels, in cubic metres.
    pub volume_m3: f64,
    /// Observed voxels by probability: twenty bins of 0.05 from 0; the last includes 1.
    pub probabilities: [u64; 20],
    /// Occupied voxels by height, from the lowest bin.
    pub heights: Vec<HeightBin>,
    /// Occupied voxels by class of most points; empty without this layer.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub classes: BTreeMap<u8, u64>,
    /// Tiles that could not be read and are not counted.
    pub unread: Vec<[i32; 3]>,
}

/// Bin of the histogram of heights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HeightBin {
    /// Lower border in metres.
    pub from_m: f64,
    /// Upper border in metres.
    pub to_m: f64,
    /// Number of occupied voxels.
    pub occupied: u64,
}

/// Maximum number of height bins.
const MAX_BINS: u64 = 40;

impl Survey {
    /// Counts a map tile by tile on the caller's rayon pool; damaged tiles are skipped. `progress` receives the numbers
    /// of finished and of all tiles, from any thread. Memory: the list of tiles, and one tile per thread.
    ///
    /// # Errors
    ///
    /// Fails on errors that do not concern a single tile, such as [`Error::Changed`].
    pub fn of(map: &dyn MapView, progress: impl Fn(u64, u64) + Sync) -> Result<Self> {
        let tiles = map.tile_indices();
        let Some(bounds) = TileBox::of(tiles.iter().copied()) else { return Ok(Self::default()) };
        let counter = Counter::of(map, bounds);
        let (done, all) = (AtomicU64::new(0), tiles.len() as u64);
        // Tiles of one stack share their columns. They are adjacent in the list, which is sorted by x, y and z.
        let stacks: Vec<&[TileIndex]> =
            tiles.chunk_by(|a, b| a.to_array()[..2] == b.to_array()[..2]).collect();
        let counts = stacks
            .par_iter()
            .map(|stack| counter.count(stack, || progress(1 + done.fetch_add(1, Ordering::Relaxed), all)));
        let counts = counts.try_reduce(Counts::default, |a, b| Ok(a.plus(b)))?;
        Ok(counter.survey(counts))
    }
}

struct Counter<'a> {
    map: &'a dyn MapView,
    /// Lowest voxel of the lowest tile.
    bottom: i64,
    /// Height of a bin in voxels.
    bin: i64,
}

#[derive(Default)]
struct Counts {
    voxels: u64,
    occupied: u64,
    columns: u64,
    occupied_columns: u64,
    probabilities: [u64; 20],
    heights: Vec<u64>,
    classes: BTreeMap<u8, u64>,
    unread: Vec<[i32; 3]>,
}

impl<'a> Counter<'a> {
    fn of(map: &'a dyn MapView, bounds: TileBox) -> Self {
        let grid = map.config().grid;
        let [low, high] = [bounds.min(), bounds.max()].map(|tile| grid.voxels_of_tile(tile));
        let (bottom, end) = (i64::from(low.min[2]), i64::from(high.end[2]));
        let bin = (end - bottom).max(1).unsigned_abs().div_ceil(MAX_BINS) as i64;
        Self { map, bottom, bin }
    }

    /// Counts the tiles of one stack.
    fn count(&self, stack: &[TileIndex], step: impl Fn()) -> Result<Counts> {
        let config = self.map.config();
        let occupied_from = config.occupied_log_odds();
        let edge = config.grid.voxels_per_tile_edge();
        let has_classes = config.layers().class;
        // By column: bit 1 is observed, bit 2 is occupied.
        let mut columns = vec![0_u8; (edge * edge) as usize];
        let mut counts = Counts::default();
        for &index in stack {
            step();
            let tile = match self.map.tile_uncached(index) {
                Ok(Some(tile)) => tile,
                Ok(None) => continue,
                Err(Error::Damaged { .. } | Error::Io { .. }) => {
                    counts.unread.push(index.to_array());
                    continue;
                }
                Err(error) => return Err(error),
            };
            let corner = tile.voxel_box().min;
            for voxel in tile.voxels() {
                let [x, y] = [0, 1].map(|k| voxel.index[k].wrapping_sub(corner[k]));
                let is_occupied = voxel.evidence.log_odds >= occupied_from;
                if has_classes
                    && is_occupied
                    && let Some(class) = tile.layers_of(voxel.index).and_then(|layers| layers.class())
                {
                    *counts.classes.entry(class).or_default() += 1;
                }
                counts.add(voxel.evidence, is_occupied.then(|| self.bin_of(voxel.index[2])));
                if let Some(column) = columns.get_mut((x + y * edge) as usize) {
                    *column |= if is_occupied { 3 } else { 1 };
                }
            }
        }
        counts.columns = columns.iter().filter(|&&column| column > 0).count() as u64;
        counts.occupied_columns = columns.iter().filter(|&&column| column > 1).count() as u64;
        Ok(counts)
    }

    fn bin_of(&self, z: i32) -> usize {
        ((i64::from(z) - self.bottom) / self.bin).clamp(0, MAX_BINS as i64 - 1) as usize
    }

    fn survey(&self, counts: Counts) -> Survey {
        let resolution_m = self.map.config().grid.resolution_m();
        let border_m = |bin: usize| (self.bottom + bin as i64 * self.bin) as f64 * resolution_m;
        let Counts {
            voxels,
            occupied,
            columns,
            occupied_columns,
            probabilities,
            heights,
            classes,
            mut unread,
        } = counts;
        unread.sort_unstable();
        let first = heights.iter().position(|&count| count > 0).unwrap_or(heights.len());
        let bins = heights.into_iter().enumerate().skip(first);
        Survey {
            voxels,
            occupied,
            columns,
            occupied_columns,
            area_m2: columns as f64 * resolution_m.powi(2),
            volume_m3: voxels as f64 * resolution_m.powi(3),
            probabilities,
            heights: bins
                .map(|(bin, occupied)| HeightBin { from_m: border_m(bin), to_m: border_m(bin + 1), occupied })
                .collect(),
            classes,
            unread,
        }
    }
}

impl Counts {
    fn add(&mut self, evidence: Evidence, height: Option<usize>) {
        self.voxels += 1;
        let bin = (evidence.probability() * self.probabilities.len() as f64) as usize;
        self.probabilities[bin.min(19)] += 1;
        if let Some(bin) = height {
            self.occupied += 1;
            if self.heights.len() <= bin {
                self.heights.resize(bin + 1, 0);
            }
            self.heights[bin] += 1;
        }
    }

    fn plus(mut self, mut other: Self) -> Self {
        self.voxels += other.voxels;
        self.occupied += other.occupied;
        self.columns += other.columns;
        self.occupied_columns += other.occupied_columns;
        self.probabilities.iter_mut().zip(other.probabilities).for_each(|(sum, count)| *sum += count);
        if self.heights.len() < other.heights.len() {
            std::mem::swap(&mut self.heights, &mut other.heights);
        }
        self.heights.iter_mut().zip(other.heights).for_each(|(sum, count)| *sum += count);
        other.classes.iter().for_each(|(class, count)| *self.classes.entry(*class).or_default() += count);
        self.unread.append(&mut other.unread);
        self
    }
}
