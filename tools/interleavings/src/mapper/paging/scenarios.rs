//! Random operations on the mapper's tiles in little memory: resident, packed, being saved and being loaded.

use super::memory_disk::MemoryDisk;
use super::paged_tiles::PagedTiles;
use crate::config::{MapConfig, Storage};
use crate::in_many_orders;
use crate::persistence::{new_map_id, new_metadata};
use crate::space::TileIndex;
use crate::store::{TileFile, TileStore};
use crate::tile::{OctreeFactory, Tile};
use shuttle::rand::{Rng, thread_rng};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use voxtile::scan::PointBatch;
use voxtile::tile::Voxel;

const TILES: i32 = 8;
const TILE_M: f64 = 4.0;

/// The tiles of a map, and their expected contents.
struct Scenario {
    tiles: PagedTiles,
    disk: MemoryDisk,
    config: MapConfig,
    /// All tiles, kept in memory.
    expected: BTreeMap<TileIndex, Tile>,
    /// The tiles as of the last flush.
    flushed: BTreeMap<TileIndex, Tile>,
    /// The tiles as of each background flush that has begun, by the number of batches.
    begun: BTreeMap<u64, BTreeMap<TileIndex, Tile>>,
    /// The background flush that is still running.
    running: Option<u64>,
    /// Whether flushes run in the background.
    in_background: bool,
    /// Number of times each tile was changed or queried.
    touched: BTreeMap<TileIndex, u64>,
    errors: u64,
}

fn config(storage: Storage) -> MapConfig {
    MapConfig::new(0.5, TILE_M).unwrap().with_storage(storage)
}

fn voxels(tile: &Tile) -> Vec<Voxel> {
    tile.voxels().collect()
}

impl Scenario {
    fn new(storage: Storage, in_background: bool) -> Self {
        let (disk, config, map_id) = (MemoryDisk::new(), config(storage), new_map_id());
        let metadata = new_metadata(&config, map_id, &[]);
        let store = TileStore::create(Arc::new(disk.clone()), Path::new("/map"), metadata, map_id).unwrap();
        let tiles = PagedTiles::new(config.clone(), store);
        let (expected, flushed, begun, touched) = Default::default();
        Self {
            tiles,
            disk,
            config,
            expected,
            flushed,
            begun,
            running: None,
            in_background,
            touched,
            errors: 0,
        }
    }

    /// Inserts a batch of points in some tiles, which is accepted or refused as a whole.
    fn insert(&mut self) {
        let mut random = thread_rng();
        let first = random.gen_range(0..TILES);
        let points: Vec<[f64; 3]> = (0..random.gen_range(1..=3))
            .flat_map(|k| {
                let corner = f64::from((first + k) % TILES) * TILE_M;
                [0; 4].map(|_| [corner + random.gen_range(0.0..TILE_M), random.gen_range(0.0..TILE_M), 1.0])
            })
            .collect();
        let is_occupied: Vec<bool> = points.iter().map(|_| random.gen_bool(0.5)).collect();
        let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
        let updates = batch.updates(&self.config.grid, &self.config.sensor_model).unwrap();
        updates.tiles.iter().for_each(|(index, _)| self.touch(*index));
        let prepared = self.tiles.pager().prepare(&updates, 0);
        if prepared.is_err() {
            self.errors += 1;
            return;
        }
        self.tiles.pager().prefetch(&updates.tiles);
        for (index, updates) in &updates.tiles {
            let empty = || Tile::empty(&self.config.grid, &OctreeFactory::default(), *index);
            let tile = self.expected.entry(*index).or_insert_with(empty);
            tile.apply(&self.config.sensor_model, updates);
        }
        self.tiles.pager().accept(updates);
    }

    /// Queries a tile.
    fn query(&mut self) {
        let index = TileIndex::new(thread_rng().gen_range(0..TILES), 0, 0);
        self.touch(index);
        match self.tiles.pager().tile(index) {
            Ok(found) => {
                assert_eq!(found.as_deref().map(voxels), self.expected.get(&index).map(voxels), "{index}");
            }
            Err(_) => self.errors += 1,
        }
    }

    fn touch(&mut self, index: TileIndex) {
        *self.touched.entry(index).or_default() += 1;
    }

    fn flush(&mut self, refuses: bool) {
        // This flush reports the error of an earlier background flush.
        self.running = None;
        match self.tiles.pager().flush() {
            Ok(()) => {
                self.flushed = self.expected.clone();
                self.begun.clear();
            }
            Err(error) => {
                // Tiles that could not be saved before are saved now, and older errors are not reported again.
                assert!(refuses, "{error:#}");
                self.errors += 1;
            }
        }
    }

    /// Begins a background flush.
    fn begin_flush(&mut self) {
        let number = self.tiles.pager().scan_number();
        match self.tiles.begin_flush() {
            Ok(()) => {
                self.begun.insert(number, self.expected.clone());
                self.running = Some(number);
            }
            Err(_) => {
                (self.errors, self.running) = (self.errors + 1, None);
            }
        }
    }

    fn end_flush(&mut self) {
        let running = self.running.take();
        match (self.tiles.end_flush(), running) {
            (Ok(()), Some(number)) => {
                assert_eq!(self.tiles.pager().store().commits().scan_number, number);
                self.flushed = self.begun.remove(&number).expect("it was begun");
                self.begun.clear();
            }
            (Ok(()), None) => {}
            (Err(_), _) => self.errors += 1,
        }
    }

    /// Drops the map at any point and opens it as of the last flush.
    fn reopen(self) -> Self {
        let Self { tiles, disk, config, mut flushed, begun, running, in_background, touched, errors, .. } =
            self;
        drop(tiles);
        let store = TileStore::open(Arc::new(disk.clone()), Path::new("/map")).unwrap();
        let committed = store.commits().scan_number;
        // Dropping the mapper completes a running flush, unless the disk refuses.
        assert!(running.is_none_or(|number| number == committed || disk.refused() > 0), "{committed}");
        if let Some(begun) = begun.get(&committed) {
            flushed = begun.clone();
        }
        let tiles = PagedTiles::new(config.clone(), store);
        let (expected, begun) = (flushed.clone(), BTreeMap::new());
        Self { tiles, disk, config, expected, flushed, begun, running: None, in_background, touched, errors }
    }

    fn run(&mut self, steps: usize) {
        let mut refuses = false;
        self.disk.refuse(refuses);
        for _ in 0..steps {
            match thread_rng().gen_range(0..16) {
                0..8 => self.insert(),
                8 if self.in_background => self.begin_flush(),
                8 => self.insert(),
                9 if self.in_background && thread_rng().gen_bool(0.3) => self.end_flush(),
                9..13 => self.query(),
                13 => self.flush(refuses),
                _ => {
                    refuses = !refuses && thread_rng().gen_bool(0.5);
                    self.disk.refuse(refuses);
                }
            }
        }
        // An error is reported at most once: a tile that is saved by a retry is no error.
        assert!(self.errors <= self.disk.refused(), "{} errors", self.errors);
    }

    /// No tile is written more often than it was changed or queried.
    fn check_saves(&self) {
        let layout = self.tiles.pager().store().layout().clone();
        for (index, touched) in &self.touched {
            let begun = self.disk.begun(&layout.next(*index, TileFile::Table));
            assert!(begun <= *touched, "{index} was begun {begun} times and touched {touched} times");
        }
    }

    fn check_tiles(&mut self) {
        assert_eq!(self.tiles.pager().tile_indices(), self.expected.keys().copied().collect::<Vec<_>>());
        for (index, tile) in &self.expected {
            let found = self.tiles.pager().tile_uncached(*index).unwrap().unwrap();
            assert_eq!(voxels(&found), voxels(tile), "{index}");
        }
    }
}

fn run_scenario(storage: Storage, in_background: bool) {
    let mut scenario = Scenario::new(storage, in_background);
    for _ in 0..2 {
        scenario.run(24);
        scenario.check_tiles();
        if !scenario.in_background {
            scenario.check_saves();
        }
        scenario = scenario.reopen();
        scenario.check_tiles();
    }
    scenario.disk.refuse(false);
    scenario.insert();
    scenario.flush(false);
    scenario.reopen().check_tiles();
}

/// Inserts, queries and flushes on a disk that sometimes refuses: no update is lost or counted twice, no older version
/// of a tile replaces a newer one, and there is no deadlock.
#[test]
fn tiles_keep_their_contents_while_saved_and_loaded() {
    in_many_orders(|| run_scenario(Storage::Compact, false));
}

/// With octomap storage, the saving thread must also unpack the tiles.
#[test]
fn tiles_unpacked_by_the_saving_thread_keep_their_contents() {
    in_many_orders(|| run_scenario(Storage::OctoMap, false));
}

/// Background flushes run during inserts, queries and the drop of the map. The map on disk is that of one of the
/// flushes.
#[test]
fn a_background_flush_saves_the_map_as_of_one_scan() {
    in_many_orders(|| run_scenario(Storage::Compact, true));
}

#[test]
fn a_background_flush_that_unpacks_tiles_saves_the_map_as_of_one_scan() {
    in_many_orders(|| run_scenario(Storage::OctoMap, true));
}
