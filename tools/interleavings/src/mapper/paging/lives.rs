//! Lives of the mapper's tiles in little memory: what is in use, packed, on its way to disk and from there.

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

/// The tiles of a map under way, and what they must be.
struct Life {
    tiles: PagedTiles,
    disk: MemoryDisk,
    config: MapConfig,
    /// Every tile, in memory and beyond doubt.
    expected: BTreeMap<TileIndex, Tile>,
    /// The same as of the last flush.
    flushed: BTreeMap<TileIndex, Tile>,
    /// The same as of flushes that were begun beside the mapper, by the number of batches.
    begun: BTreeMap<u64, BTreeMap<TileIndex, Tile>>,
    /// That of the one that goes on.
    flying: Option<u64>,
    /// Whether flushes go on beside the mapper.
    is_beside: bool,
    /// How often each tile was to be changed or was asked for.
    touched: BTreeMap<TileIndex, u64>,
    errors: u64,
}

fn config(storage: Storage) -> MapConfig {
    MapConfig::new(0.5, TILE_M).unwrap().with_storage(storage)
}

fn voxels(tile: &Tile) -> Vec<Voxel> {
    tile.voxels().collect()
}

impl Life {
    fn new(storage: Storage, is_beside: bool) -> Self {
        let (disk, config, map_id) = (MemoryDisk::new(), config(storage), new_map_id());
        let metadata = new_metadata(&config, map_id, &[]);
        let store = TileStore::create(Arc::new(disk.clone()), Path::new("/map"), metadata, map_id).unwrap();
        let tiles = PagedTiles::new(config.clone(), store);
        let (expected, flushed, begun, touched) = Default::default();
        Self { tiles, disk, config, expected, flushed, begun, flying: None, is_beside, touched, errors: 0 }
    }

    /// A batch of points in some tiles: taken whole, or refused and nothing of it taken.
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

    /// Asks for a tile, wherever it is.
    fn ask(&mut self) {
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
        // Whatever came of one beside the mapper, this one tells it.
        self.flying = None;
        match self.tiles.pager().flush() {
            Ok(()) => {
                self.flushed = self.expected.clone();
                self.begun.clear();
            }
            Err(error) => {
                // What could not be saved before is saved now, and no older trouble is told of.
                assert!(refuses, "{error:#}");
                self.errors += 1;
            }
        }
    }

    /// Begins a flush that goes on beside what comes next.
    fn begin_flush(&mut self) {
        let number = self.tiles.pager().scan_number();
        match self.tiles.begin_flush() {
            Ok(()) => {
                self.begun.insert(number, self.expected.clone());
                self.flying = Some(number);
            }
            Err(_) => {
                (self.errors, self.flying) = (self.errors + 1, None);
            }
        }
    }

    fn end_flush(&mut self) {
        let flying = self.flying.take();
        match (self.tiles.end_flush(), flying) {
            (Ok(()), Some(number)) => {
                assert_eq!(self.tiles.pager().store().commits().scan_number, number);
                self.flushed = self.begun.remove(&number).expect("it was begun");
                self.begun.clear();
            }
            (Ok(()), None) => {}
            (Err(_), _) => self.errors += 1,
        }
    }

    /// Goes away in the middle of everything, and begins again with what was flushed.
    fn begin_again(self) -> Self {
        let Self { tiles, disk, config, mut flushed, begun, flying, is_beside, touched, errors, .. } = self;
        drop(tiles);
        let store = TileStore::open(Arc::new(disk.clone()), Path::new("/map")).unwrap();
        let committed = store.commits().scan_number;
        // What goes on when the mapper goes is finished, unless the disk refuses.
        assert!(flying.is_none_or(|number| number == committed || disk.refused() > 0), "{committed}");
        if let Some(begun) = begun.get(&committed) {
            flushed = begun.clone();
        }
        let tiles = PagedTiles::new(config.clone(), store);
        let (expected, begun) = (flushed.clone(), BTreeMap::new());
        Self { tiles, disk, config, expected, flushed, begun, flying: None, is_beside, touched, errors }
    }

    fn run(&mut self, steps: usize) {
        let mut refuses = false;
        self.disk.refuse(refuses);
        for _ in 0..steps {
            match thread_rng().gen_range(0..16) {
                0..8 => self.insert(),
                8 if self.is_beside => self.begin_flush(),
                8 => self.insert(),
                9 if self.is_beside && thread_rng().gen_bool(0.3) => self.end_flush(),
                9..13 => self.ask(),
                13 => self.flush(refuses),
                _ => {
                    refuses = !refuses && thread_rng().gen_bool(0.5);
                    self.disk.refuse(refuses);
                }
            }
        }
        // A refusal is told of once, if at all: a tile that is saved the next time is no trouble.
        assert!(self.errors <= self.disk.refused(), "{} errors", self.errors);
    }

    /// Nothing goes to disk more often than it was changed or wanted.
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

fn live(storage: Storage, is_beside: bool) {
    let mut life = Life::new(storage, is_beside);
    for _ in 0..2 {
        life.run(24);
        life.check_tiles();
        if !life.is_beside {
            life.check_saves();
        }
        life = life.begin_again();
        life.check_tiles();
    }
    life.disk.refuse(false);
    life.insert();
    life.flush(false);
    life.begin_again().check_tiles();
}

/// Scans, questions, flushes and a disk that refuses now and then: no update is lost, none counts twice, no older
/// version of a tile comes after a newer, and nobody waits for ever.
#[test]
fn tiles_on_their_way_to_disk_and_back_are_what_they_must_be() {
    in_many_orders(|| live(Storage::Compact, false));
}

/// The same where the saving thread unpacks tiles.
#[test]
fn tiles_that_are_unpacked_on_their_way_are_too() {
    in_many_orders(|| live(Storage::OctoMap, false));
}

/// The same with flushes that go on beside scans, questions and whatever ends the mapper: what is on disk afterwards is
/// the map as of one of them.
#[test]
fn flushes_beside_the_mapper_are_of_one_scan() {
    in_many_orders(|| live(Storage::Compact, true));
}

#[test]
fn flushes_beside_the_mapper_that_unpack_tiles_are_too() {
    in_many_orders(|| live(Storage::OctoMap, true));
}
