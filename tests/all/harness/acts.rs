use super::map::{at, map, name, open_or_create, rework, scans};
use super::model::State;
use super::scans::{Taken, new_poses};
use std::ops::Range;
use testkit::faulty_disk::FaultyDisk;
use voxtile::operations::{
    NewPoses, OnlineRemap, Remap, ScanSelection, delete_snapshot, remap, remove_points, remove_scans, revert,
    snapshot,
};
use voxtile::space::TileIndex;
use voxtile::store::TileStore;
use voxtile::{Aabb, MapConfig, Mapper, Result};

/// What people do with a map, each in a process of its own.
#[derive(Clone, Debug)]
pub enum Act {
    /// Scans with these seeds are inserted and flushed.
    Scans(Range<u64>),
    /// Some scans get other poses: those whose number leaves this rest when it is divided by four, or all.
    Move {
        seed: u64,
        rest: Option<u64>,
    },
    /// The same while a mapper inserts scans with these seeds and flushes each.
    MoveBeside {
        seed: u64,
        rest: Option<u64>,
        meanwhile: Range<u64>,
    },
    RemoveScans(u64, u64),
    RemovePoints(Aabb),
    /// One in so many tiles is taken out of the map.
    RemoveTiles(i32),
    Snapshot(&'static str),
    Delete(&'static str),
    Revert(&'static str),
}

/// Whether [`Act::RemoveTiles`] takes a tile.
pub fn is_removed(one_in: i32, tile: TileIndex) -> bool {
    (tile.x + tile.y + tile.z).rem_euclid(one_in) == 0
}

/// Does it with the map on a disk; `before` is the naive one.
pub fn perform(disk: &FaultyDisk, config: &MapConfig, before: &State, act: &Act) -> Result<()> {
    let poses = |seed, rest| NewPoses::Numbered(new_poses(&before.now.scans, seed, rest));
    match act {
        Act::Scans(seeds) => {
            let mut mapper = open_or_create(disk, config)?;
            seeds.clone().try_for_each(|seed| Taken::new(seed).insert_into(&mut mapper))?;
            mapper.flush()
        }
        Act::Move { seed, rest } => {
            remap(&scans(disk)?, &poses(*seed, *rest), &Remap::new(rework()), |_, _| ()).map(drop)
        }
        Act::MoveBeside { seed, rest, meanwhile } => {
            let mut mapper = open_or_create(disk, config)?;
            let mut beside = OnlineRemap::begin(&scans(disk)?, &poses(*seed, *rest), &Remap::new(rework()))?;
            for number in meanwhile.clone() {
                if number % 3 > 0 {
                    beside.follow(|_| ())?;
                }
                Taken::new(number).insert_into(&mut mapper)?;
                mapper.flush()?;
            }
            drop(mapper);
            beside.finish().map(drop)
        }
        Act::RemoveScans(first, last) => {
            let scans = ScanSelection::Numbers(*first, *last);
            remove_scans(at(disk), &scans, false, &rework(), |_, _| ()).map(drop)
        }
        Act::RemovePoints(region) => remove_points(at(disk), region, &rework(), |_, _| ()).map(drop),
        Act::RemoveTiles(one_in) => {
            let mut store = TileStore::open(disk.shared(), map())?;
            let tiles: Vec<_> = store.tiles().iter().filter(|tile| is_removed(*one_in, *tile)).collect();
            tiles.into_iter().try_for_each(|tile| store.remove(tile))?;
            store.commit(store.metadata().clone(), store.commits().scan_number)
        }
        Act::Snapshot(of) => snapshot(at(disk), &name(of)),
        Act::Delete(of) => delete_snapshot(at(disk), &name(of)),
        Act::Revert(to) => revert(at(disk), &name(to), None, |_, _| ()).map(drop),
    }
}
