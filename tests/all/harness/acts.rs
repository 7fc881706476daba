use super::map::{at, map, name, open_or_create, replay, scans};
use super::model::State;
use super::scans::{Taken, new_marks, new_poses};
use std::ops::Range;
use testkit::faulty_disk::FaultyDisk;
use voxtile::operations::{
    NewPoses, OnlineRemap, Part, Remap, ScanSelection, clear, delete_snapshot, mark_moving, remap,
    remove_points, remove_scans, revert, snapshot,
};
use voxtile::scan::MovingMarks;
use voxtile::space::TileIndex;
use voxtile::store::TileStore;
use voxtile::{Aabb, MapConfig, Mapper, Result};

/// Operations on a map, each in a process of its own.
#[derive(Clone, Debug)]
pub enum Act {
    /// Inserts scans with these seeds and flushes.
    Scans(Range<u64>),
    /// Changes the poses of the scans whose number modulo 4 is `rest`, or of all.
    Move {
        seed: u64,
        rest: Option<u64>,
    },
    /// Like `Move`, but as an online remap, while a mapper inserts scans with these seeds and flushes after each.
    MoveOnline {
        seed: u64,
        rest: Option<u64>,
        meanwhile: Range<u64>,
    },
    /// Marks points as moving in the scans whose number modulo 4 is `rest`, or in all.
    Mark {
        seed: u64,
        rest: Option<u64>,
    },
    RemoveScans(u64, u64),
    RemovePoints(Aabb),
    /// Removes one in this many tiles.
    RemoveTiles(i32),
    /// Makes the voxels in a box unknown.
    Clear(Aabb),
    Snapshot(&'static str),
    Delete(&'static str),
    Revert(&'static str),
}

/// Whether [`Act::RemoveTiles`] removes a tile.
pub fn is_removed(one_in: i32, tile: TileIndex) -> bool {
    (tile.x + tile.y + tile.z).rem_euclid(one_in) == 0
}

/// Performs an act on the map of a disk; `before` is the naive map before it.
pub fn perform(disk: &FaultyDisk, config: &MapConfig, before: &State, act: &Act) -> Result<()> {
    let poses = |seed, rest| NewPoses::Moving(new_poses(&before.now.scans, seed, rest));
    match act {
        Act::Scans(seeds) => {
            let mut mapper = open_or_create(disk, config)?;
            seeds.clone().try_for_each(|seed| Taken::new(seed).insert_into(&mut mapper))?;
            mapper.flush()
        }
        Act::Move { seed, rest } => {
            remap(&scans(disk)?, &poses(*seed, *rest), &Remap::new(replay()), |_, _| ()).map(drop)
        }
        Act::MoveOnline { seed, rest, meanwhile } => {
            let mut mapper = open_or_create(disk, config)?;
            let mut online = OnlineRemap::begin(&scans(disk)?, &poses(*seed, *rest), &Remap::new(replay()))?;
            for number in meanwhile.clone() {
                if number % 3 > 0 {
                    online.follow(|_| ())?;
                }
                Taken::new(number).insert_into(&mut mapper)?;
                mapper.flush()?;
            }
            drop(mapper);
            online.finish().map(drop)
        }
        Act::Mark { seed, rest } => {
            let marks = new_marks(&before.now.scans, *seed, *rest);
            let numbers: Vec<_> = marks.keys().copied().collect();
            let of_scan = move |number: u64| Ok(MovingMarks::new(marks[&number].iter().copied()));
            mark_moving(&scans(disk)?, numbers, of_scan, &replay(), |_, _| ()).map(drop)
        }
        Act::RemoveScans(first, last) => {
            let scans = ScanSelection::Numbers(*first, *last);
            remove_scans(at(disk), &scans, false, &replay(), |_, _| ()).map(drop)
        }
        Act::RemovePoints(region) => remove_points(at(disk), region, &replay(), |_, _| ()).map(drop),
        Act::RemoveTiles(one_in) => {
            let mut store = TileStore::open(disk.shared(), map())?;
            let tiles: Vec<_> = store.tiles().iter().filter(|tile| is_removed(*one_in, *tile)).collect();
            tiles.into_iter().try_for_each(|tile| store.remove(tile))?;
            store.commit(store.metadata().clone(), store.commits().scan_number)
        }
        Act::Clear(region) => clear(at(disk), &Part::Inside(*region), |_, _| ()).map(drop),
        Act::Snapshot(of) => snapshot(at(disk), &name(of)),
        Act::Delete(of) => delete_snapshot(at(disk), &name(of)),
        Act::Revert(to) => revert(at(disk), &name(to), None, |_, _| ()).map(drop),
    }
}
