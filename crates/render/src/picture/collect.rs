use super::cells::{Cell, Cells, Rank};
use super::frame::Frame;
use super::options::Picture;
use super::view::{Change, ColorBy, View};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Grid, TileIndex, VoxelBox, VoxelIndex};
use voxtile::{Error, Result};
use voxtile_distance::{DistanceField, DistanceOptions, MapDistances};

#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    One(&'a dyn MapView),
    Two { before: &'a dyn MapView, after: &'a dyn MapView },
}

/// Result of reading the tiles of a picture.
pub(super) struct Collected {
    /// `None` if no voxel was observed.
    pub known: Option<Known>,
    pub content: Content,
    /// Cap of the distances in metres; 0 for other pictures.
    pub max_distance_m: f64,
    pub tiles: u64,
    /// Unreadable tiles, in order.
    pub unread: Vec<TileIndex>,
}

/// Meaning of the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Values of one map.
    Values,
    /// Changes between two states.
    Difference,
    /// Classes of a comparison.
    Comparison,
}

/// Cells, and the bounds of the known ones.
pub(super) struct Known {
    pub frame: Frame,
    pub cells: Cells,
    pub first: [usize; 2],
    pub count: [usize; 2],
}

/// Voxels along an edge of the squares whose distances are computed at a time.
const SQUARE_VOXELS: i32 = 512;

/// Share of the known cells that may be beyond each border of the picture: single rays would make the rest small.
pub(super) const OUTSIDE: f64 = 0.005;
/// Maximum number of tiles to read a second time for finer cells.
const MAX_TILES_READ_TWICE: usize = 4096;

impl Collected {
    /// Reads all tiles. If the observed area is so small that cells can be finer, reads the tiles a second time.
    pub fn of(picture: &Picture, source: Source, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Self> {
        let collector = Collector::new(picture, source);
        let tiles = collector.tiles();
        let done = Progress::new(tiles.len() as u64, progress);
        let mut known = None;
        if let Some(voxels) = collector.bounds(&tiles) {
            known = collector.collect(&tiles, voxels, collector.outside(), &done)?;
        }
        if let Some(found) = &known {
            let seen = found.frame.voxels_of(found.first, found.count);
            let finer = Frame::new(picture.view, seen, picture.most_px);
            if finer.voxels_a_cell < found.frame.voxels_a_cell && tiles.len() <= MAX_TILES_READ_TWICE {
                drop(known.take());
                done.all.fetch_add(tiles.len() as u64, Ordering::Relaxed);
                known = collector.collect(&tiles, seen, 0.0, &done)?;
            }
        }
        Ok(Self {
            known,
            content: if matches!(source, Source::Two { .. }) { Content::Difference } else { Content::Values },
            max_distance_m: 0.0,
            tiles: tiles.len() as u64,
            unread: collector.into_unread(),
        })
    }
}

impl Collected {
    /// Computes the distances of one layer of voxels, square by square.
    pub fn of_distances<V: MapView>(
        picture: &Picture,
        map: &V,
        options: DistanceOptions,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Self> {
        let grid = map.config().grid;
        let collector = Collector::new(picture, Source::One(map));
        let tiles = collector.tiles();
        let mut known = None;
        if let Some(voxels) = collector.bounds(&tiles) {
            let frame = Frame::new(picture.view, voxels, picture.most_px);
            let cells = Cells::new(frame.cells[0] * frame.cells[1], None);
            let starts = |k: usize| (voxels.min[k]..voxels.end[k]).step_by(SQUARE_VOXELS as usize);
            let squares: Vec<[i32; 2]> = starts(0).flat_map(|x| starts(1).map(move |y| [x, y])).collect();
            for (number, [x, y]) in squares.iter().copied().enumerate() {
                progress(number as u64, squares.len() as u64);
                let end = |from: i32, k: usize| from.saturating_add(SQUARE_VOXELS).min(voxels.end[k]);
                let [min, max] = [[x, y, voxels.min[2]], [end(x, 0), end(y, 1), voxels.end[2]]]
                    .map(|corner| corner.map(|k| f64::from(k) * grid.resolution_m()));
                let field = map.distance_field(&Aabb { min, max }, options)?;
                add_distances(&field, &frame, &cells);
            }
            let seen = seen(&frame, &cells, 0.0);
            known = seen.map(|(first, count)| Known { frame, cells, first, count });
        }
        let max_distance_m = options.max_distance_m;
        Ok(Self {
            known,
            content: Content::Values,
            max_distance_m,
            tiles: tiles.len() as u64,
            unread: Vec::new(),
        })
    }
}

/// Adds the distances of a field. A cell of several voxels shows the largest, or an obstacle.
fn add_distances(field: &DistanceField, frame: &Frame, cells: &Cells) {
    let (voxels, resolution_m) = (field.voxel_box().intersection(&frame.voxels), field.grid().resolution_m());
    for z in voxels.min[2]..voxels.end[2] {
        for y in voxels.min[1]..voxels.end[1] {
            for x in voxels.min[0]..voxels.end[0] {
                let distance = field.voxel([x, y, z]).in_metres(resolution_m);
                let Some(distance_m) = distance.capped_m(field.options().max_distance_m) else { continue };
                let rank = if distance_m > 0.0 { Rank::Free } else { Rank::Occupied };
                cells.add(frame.place_of([x, y, z]), Cell { rank, value: distance_m as f32, near: 0 });
            }
        }
    }
}

pub(super) struct Progress<'a> {
    done: AtomicU64,
    all: AtomicU64,
    report: &'a (dyn Fn(u64, u64) + Sync),
}

impl<'a> Progress<'a> {
    pub fn new(all: u64, report: &'a (dyn Fn(u64, u64) + Sync)) -> Self {
        Self { done: AtomicU64::new(0), all: AtomicU64::new(all), report }
    }

    fn step(&self) {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        (self.report)(done, self.all.load(Ordering::Relaxed));
    }
}

impl Source<'_> {
    fn grid(self) -> Grid {
        match self {
            Self::One(map) => map.config().grid,
            Self::Two { after, .. } => after.config().grid,
        }
    }
}

/// Reader of the tiles of a picture.
pub(super) struct Collector<'a> {
    picture: &'a Picture,
    source: Source<'a>,
    grid: Grid,
    unread: Mutex<Vec<TileIndex>>,
}

impl<'a> Collector<'a> {
    pub fn new(picture: &'a Picture, source: Source<'a>) -> Self {
        Self { picture, source, grid: source.grid(), unread: Mutex::default() }
    }

    /// Returns the unreadable tiles that were skipped, in order.
    pub fn into_unread(self) -> Vec<TileIndex> {
        let mut unread = self.unread.into_inner().unwrap_or_else(PoisonError::into_inner);
        unread.sort_unstable();
        unread.dedup();
        unread
    }

    /// Returns the selected voxels.
    fn wanted(&self) -> VoxelBox {
        let all = VoxelBox { min: [i32::MIN; 3], end: [i32::MAX; 3] };
        let mut wanted = self.picture.region.as_ref().map_or(all, |region| self.grid.voxels_in(region));
        if let Some(max_height_m) = self.picture.max_height_m {
            let below =
                Aabb { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY, f64::INFINITY, max_height_m] };
            wanted.end[2] = wanted.end[2].min(self.grid.voxels_in(&below).end[2]);
        }
        if let View::Slice { z_m, thickness_m } = self.picture.view {
            let half_m = 0.5 * thickness_m;
            let [x, y] = [0.0; 2];
            let layer = voxtile::space::Aabb { min: [x, y, z_m - half_m], max: [x, y, z_m + half_m] };
            let mut layer = self.grid.voxels_in(&layer);
            if layer.min[2] >= layer.end[2]
                && let Some([_, _, z]) = self.grid.voxel_of([x, y, z_m])
            {
                (layer.min[2], layer.end[2]) = (z, z.saturating_add(1));
            }
            wanted.min[2] = wanted.min[2].max(layer.min[2]);
            wanted.end[2] = wanted.end[2].min(layer.end[2]);
        }
        wanted
    }

    /// Returns the tiles that contain some of these voxels, in order.
    pub fn tiles(&self) -> Vec<TileIndex> {
        let mut tiles = match self.source {
            Source::One(map) => map.tile_indices(),
            Source::Two { before, after } => [before.tile_indices(), after.tile_indices()].concat(),
        };
        let wanted = self.wanted();
        tiles.retain(|&tile| !self.grid.voxels_of_tile(tile).intersection(&wanted).is_empty());
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    /// Returns the bounds of the selected voxels of the tiles; `None` without tiles.
    pub fn bounds(&self, tiles: &[TileIndex]) -> Option<VoxelBox> {
        let wanted = self.wanted();
        let boxes = tiles.iter().map(|&tile| self.grid.voxels_of_tile(tile).intersection(&wanted));
        boxes.reduce(|a, b| VoxelBox {
            min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
            end: std::array::from_fn(|k| a.end[k].max(b.end[k])),
        })
    }

    /// Returns the share of the known cells that may be beyond each border of the picture.
    fn outside(&self) -> f64 {
        let shows_all = self.picture.region.is_some() || matches!(self.source, Source::Two { .. });
        if shows_all { 0.0 } else { OUTSIDE }
    }

    /// Reads the tiles into cells, and crops them to the known ones but a share.
    fn collect(
        &self,
        tiles: &[TileIndex],
        voxels: VoxelBox,
        outside: f64,
        progress: &Progress,
    ) -> Result<Option<Known>> {
        let frame = Frame::new(self.picture.view, voxels, self.picture.most_px);
        let layer = match self.picture.color_by {
            ColorBy::Layer(layer) if matches!(self.source, Source::One(_)) => Some(layer),
            _ => None,
        };
        let cells = Cells::new(frame.cells[0] * frame.cells[1], layer);
        self.for_each_tile(tiles, progress, |tile| match self.source {
            Source::One(map) => self.add(map, tile, &frame, &cells),
            Source::Two { before, after } => self.add_difference(before, after, tile, &frame, &cells),
        })?;
        let seen = seen(&frame, &cells, outside);
        Ok(seen.map(|(first, count)| Known { frame, cells, first, count }))
    }

    /// Visits all tiles on the caller's rayon pool, and skips unreadable ones if the picture allows it.
    pub fn for_each_tile(
        &self,
        tiles: &[TileIndex],
        progress: &Progress,
        visit: impl Fn(TileIndex) -> Result<()> + Sync,
    ) -> Result<()> {
        let outcomes = tiles.par_iter().map(|&tile| {
            let visited = visit(tile);
            progress.step();
            visited.or_else(|error| self.skip(tile, error))
        });
        // Return the first error in tile order, so that it does not depend on the number of threads.
        outcomes.find_first(Result::is_err).unwrap_or(Ok(()))
    }

    fn skip(&self, tile: TileIndex, error: Error) -> Result<()> {
        if !self.picture.skips_unreadable || !matches!(error, Error::Damaged { .. } | Error::Io { .. }) {
            return Err(error);
        }
        self.unread.lock().unwrap_or_else(PoisonError::into_inner).push(tile);
        Ok(())
    }

    fn add(&self, map: &dyn MapView, index: TileIndex, frame: &Frame, cells: &Cells) -> Result<()> {
        let Some(tile) = map.tile_uncached(index)? else { return Ok(()) };
        let (view, resolution_m) = (self.picture.view, self.grid.resolution_m());
        let occupied_from = map.config().occupied_log_odds();
        let last_scan = map.last_scan_of_tile_hint(index).unwrap_or_default() as f32;
        for voxel in tile.voxels().filter(|voxel| frame.voxels.contains(voxel.index)) {
            let evidence = voxel.evidence;
            let is_occupied = evidence.log_odds >= occupied_from;
            let value = match self.picture.color_by {
                ColorBy::Count => evidence.observation_count as f32,
                ColorBy::LastScan => last_scan,
                _ if !is_occupied => 0.0,
                ColorBy::Height => ((f64::from(voxel.index[2]) + 0.5) * resolution_m) as f32,
                ColorBy::Probability | ColorBy::Distance => evidence.probability() as f32,
                ColorBy::Layer(_) => 0.0,
            };
            let rank = if is_occupied { Rank::Occupied } else { Rank::Free };
            let (place, near) = (frame.place_of(voxel.index), view.nearness(voxel.index));
            cells.add(place, Cell { rank, value, near });
            if let Some(layer) = cells.layer.as_ref().filter(|_| is_occupied) {
                layer.add(place, near, || tile.layers_of(voxel.index));
            }
        }
        Ok(())
    }

    fn add_difference(
        &self,
        before: &dyn MapView,
        after: &dyn MapView,
        index: TileIndex,
        frame: &Frame,
        cells: &Cells,
    ) -> Result<()> {
        let maps = [before, after];
        let tiles = [before.tile_uncached(index)?, after.tile_uncached(index)?];
        let occupied_from = maps.map(|map| map.config().occupied_log_odds());
        let is_occupied = |side: usize, voxel: VoxelIndex| {
            let evidence = tiles[side].as_ref().and_then(|tile| tile.evidence(voxel));
            evidence.is_some_and(|evidence| evidence.log_odds >= occupied_from[side])
        };
        for (side, tile) in tiles.iter().enumerate() {
            for voxel in tile.iter().flat_map(|tile| tile.voxels()) {
                if !frame.voxels.contains(voxel.index) {
                    continue;
                }
                let here = voxel.evidence.log_odds >= occupied_from[side];
                // A free voxel that is occupied on the other side is added again, as occupied, with the voxels of that
                // side.
                let rank = match (here, here && is_occupied(1 - side, voxel.index)) {
                    (false, _) => Rank::Free,
                    (true, true) => Rank::Changed(Change::Same),
                    (true, false) if side == 0 => Rank::Changed(Change::Vanished),
                    (true, false) => Rank::Changed(Change::Appeared),
                };
                let near = self.picture.view.nearness(voxel.index);
                cells.add(frame.place_of(voxel.index), Cell { rank, value: 0.0, near });
            }
        }
        Ok(())
    }
}

/// Returns the first cell and the number of cells of the bounds of the known cells, but a share of them beyond each
/// border; `None` if there are none.
pub(super) fn seen(frame: &Frame, cells: &Cells, outside: f64) -> Option<([usize; 2], [usize; 2])> {
    let mut counts = frame.cells.map(|count| vec![0_u64; count]);
    for (place, _) in cells.iter().enumerate().filter(|(_, cell)| cell.rank > Rank::Unknown) {
        counts[0][place % frame.cells[0]] += 1;
        counts[1][place / frame.cells[0]] += 1;
    }
    let few = (counts[0].iter().sum::<u64>() as f64 * outside) as u64;
    let [mut first, mut count] = [[0; 2]; 2];
    for (k, counts) in counts.iter().enumerate() {
        first[k] = first_beyond(counts.iter(), few)?;
        count[k] = frame.cells[k] - first_beyond(counts.iter().rev(), few)? - first[k];
    }
    Some((first, count))
}

/// Returns the first place whose count, with those before, is above a number.
pub(super) fn first_beyond<'a>(mut counts: impl Iterator<Item = &'a u64>, few: u64) -> Option<usize> {
    let mut sum = 0;
    counts.position(|count| {
        sum += count;
        sum > few
    })
}
