//! The search for moving points in parts that several processes share.
//!
//! ```text
//! column of tiles -> shard of the scans in reverse order, and of the unmarked ones if there are marks   map_column
//! column, maps joined of these -> shard of the counts of scans, if parked things are not to be marked   count_column
//! range of scans, maps joined of all these -> marks in a file                                           FoundMarks
//! all found marks -> NewMarks -> replay of the affected tiles                                           clean_found
//! ```

use crate::clean::{Clean, Cleaned};
use crate::find_moving::MovingFinder;
use crate::scan_map::{Order, insert, without_tiles_and_marks};
use crate::search::{MemoryShares, find_in};
use crate::seen_through::BothOrders;
use crate::stays::{Stays, count_in};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewMarks, Replay, mark_moving};
use voxtile::scan::MovingMarks;
use voxtile::space::{Grid, TileIndex};
use voxtile::store::KeptRecord;
use voxtile::{
    Error, MapPath, MapReader, MapView, Mapper, MemoryLimit, OutOfCoreTileMapper, Queries, Result, TileBox,
};

/// Hits that marks hide may be so many voxels from the voxels that their scan has updated.
const HIDDEN_REACH: u32 = 20;

/// Maps that a search compares with the scans: [`map_column`] and [`count_column`] make their shards.
#[derive(Clone, Debug)]
pub struct SearchMaps {
    /// The scans in reverse order.
    pub reversed: MapPath,
    /// The scans without marks; `None` for a map without marks.
    pub unmarked: Option<MapPath>,
    /// Counts of the scans that hit each place; `None` unless parked things are not to be marked.
    pub counts: Option<MapPath>,
}

/// Columns of tiles, by their index in units of `tiles` along x and y, that the scans of a map reach.
///
/// # Errors
///
/// A map of a region with marks of moving points: hits that they hide may be anywhere in it; damage; an I/O error.
pub fn search_columns(map: impl Into<MapPath>, tiles: u32) -> Result<BTreeSet<[i32; 2]>> {
    let map = MapReader::open(map, 0)?;
    let edge = i32::try_from(tiles.max(1)).unwrap_or(i32::MAX);
    let mut columns = BTreeSet::new();
    let mut scans = map.kept_scans()?;
    while let Some(record) = scans.next_record()? {
        if record.moving.is_some() && record.rays.region.is_some() {
            let reason =
                "has marks of moving points and is a map of a region; remove the marks first (`undo`)";
            return Err(Error::argument(map.folder().display().to_string(), reason));
        }
        for reach in reach(&record, &map.grid()) {
            let column_of = |tile: TileIndex| [tile.x.div_euclid(edge), tile.y.div_euclid(edge)];
            let ([west, south], [east, north]) = (column_of(reach.min()), column_of(reach.max()));
            columns.extend((west..=east).flat_map(|x| (south..=north).map(move |y| [x, y])));
        }
    }
    Ok(columns)
}

/// Boxes around the tiles that a scan without marks may change.
fn reach(record: &KeptRecord, grid: &Grid) -> Vec<TileBox> {
    let around = |tile: TileIndex, tiles: i32| TileBox::new(tile, tile).grown(tiles);
    if record.moving.is_none() {
        return record.tiles.iter().map(|&tile| around(tile, 0)).collect();
    }
    let tiles = HIDDEN_REACH.div_ceil(grid.voxels_per_tile_edge().unsigned_abs().max(1)) as i32;
    let of_origin = grid.tile_of(record.origin_m());
    record.tiles.iter().copied().chain(of_origin).map(|tile| around(tile, tiles)).collect()
}

/// Maps the kept scans of a map as if none were marked, into the tiles of a region: a shard of the map `map_id`.
///
/// # Errors
///
/// A map that keeps no scans; damage; an output with other content; an I/O error; a request to stop.
pub fn map_column(
    map: impl Into<MapPath>,
    order: Order,
    region: TileBox,
    output: impl Into<MapPath>,
    map_id: [u8; 16],
    how: &Replay,
) -> Result<()> {
    let map = MapReader::open(map, 0)?;
    let mut scans = map.kept_scans()?;
    let mut records = Vec::new();
    while let Some(record) = scans.next_record()? {
        how.stop.check()?;
        if reach(&record, &map.grid()).iter().any(|reach| reach.intersection(region).is_some()) {
            records.push(without_tiles_and_marks(record));
        }
    }
    if order == Order::Reverse {
        records.reverse();
    }
    let mut shard = begin_shard(&map, region, output.into(), map_id, how)?;
    for record in records {
        how.stop.check()?;
        insert(&mut shard, &scans, record)?;
    }
    shard.flush()
}

/// Counts the scans that hit each voxel that was seen through, in the tiles of a region: a shard of the map `map_id`.
///
/// # Errors
///
/// As for [`map_column`].
pub fn count_column(
    map: impl Into<MapPath>,
    maps: &SearchMaps,
    region: TileBox,
    output: impl Into<MapPath>,
    map_id: [u8; 16],
    how: &Replay,
) -> Result<()> {
    let opened = Opened::of(map.into(), maps, how)?;
    let mut shard = begin_shard(&opened.map, region, output.into(), map_id, how)?;
    let finder = opened.finder(how).within(region);
    let mut scans = opened.map.kept_scans()?;
    while let Some(record) = scans.next_record()? {
        how.stop.check()?;
        if reach(&record, &opened.map.grid()).iter().any(|reach| reach.intersection(region).is_some()) {
            finder.for_each_part(&scans.open(record)?, |voxels| count_in(&mut shard, &voxels))?;
        }
    }
    shard.flush()
}

fn begin_shard(
    map: &MapReader,
    region: TileBox,
    output: MapPath,
    map_id: [u8; 16],
    how: &Replay,
) -> Result<OutOfCoreTileMapper> {
    let own = map.config().rays.region;
    let region = own.map_or(Some(region), |own| own.intersection(region)).unwrap_or(region);
    let mut config = map.config().clone().with_kept_scans(false).with_region(region);
    config.memory = how.memory;
    if let MemoryLimit::Bytes(bytes) = how.memory {
        config = config.with_memory_bytes(bytes.max(MemoryLimit::min_bytes(&map.grid())));
    }
    let mut shard = OutOfCoreTileMapper::create_as(output, config, map_id)?;
    shard.stop_with(how.stop.clone());
    Ok(shard)
}

/// The maps of a search.
struct Opened {
    map: MapReader,
    reversed: MapReader,
    unmarked: Option<MapReader>,
    shares: MemoryShares,
}

impl Opened {
    fn of(map: MapPath, maps: &SearchMaps, how: &Replay) -> Result<Self> {
        let shares = MemoryShares::of(how.memory, maps.counts.is_some());
        let open = |path: &MapPath| MapReader::open(path.clone(), shares.map_bytes);
        Ok(Self {
            map: MapReader::open(map, shares.tiles_bytes)?,
            reversed: open(&maps.reversed)?,
            unmarked: maps.unmarked.as_ref().map(open).transpose()?,
            shares,
        })
    }

    fn finder<'a>(&'a self, how: &'a Replay) -> MovingFinder<'a> {
        let forward: &dyn Queries = self.unmarked.as_ref().unwrap_or(&self.map);
        let maps = BothOrders { forward, reverse: &self.reversed };
        MovingFinder::new(maps, self.map.folder(), self.shares.points_at_a_time(), &how.stop)
    }
}

/// Marks of moving points that a search of some scans has found, in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FoundMarks {
    flush_number: u64,
    /// First and last number of the searched scans.
    searched: (u64, u64),
    points: u64,
    moving_points: u64,
    /// Scans whose marks change, in the order of the file.
    scans: Vec<FoundScan>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct FoundScan {
    number: u64,
    points: u64,
    bytes: u64,
    crc32: u32,
}

impl FoundMarks {
    /// Searches the scans with these numbers, and writes the marks to the file `output`, durably.
    ///
    /// # Errors
    ///
    /// A map that keeps no scans; damage; an I/O error; a request to stop.
    pub fn search(
        map: impl Into<MapPath>,
        maps: &SearchMaps,
        how: &Clean,
        numbers: RangeInclusive<u64>,
        output: &Path,
    ) -> Result<Self> {
        let opened = Opened::of(map.into(), maps, &how.replay)?;
        let counts = match (&maps.counts, how.parked_scans) {
            (Some(counts), Some(min_scans)) => {
                let counts = MapReader::open(counts.clone(), opened.shares.counts_bytes)?;
                Some(Stays::of(counts, min_scans))
            }
            _ => None,
        };
        let finder = opened.finder(&how.replay).with(how.region, counts.as_ref());
        let failed = |error| Error::io(output, "write", error);
        let mut file = BufWriter::new(File::create(output).map_err(failed)?);
        let mut scans = Vec::new();
        let searched = (*numbers.start(), *numbers.end());
        let take = |number, marks: &MovingMarks| {
            let bytes = marks.as_bytes();
            scans.push(FoundScan {
                number,
                points: marks.points(),
                bytes: bytes.len() as u64,
                crc32: crc32fast::hash(bytes),
            });
            file.write_all(bytes).map_err(failed)
        };
        let (points, moving_points) = find_in(&opened.map, &finder, numbers, take, |_| ())?;
        let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
        file.sync_all().map_err(failed)?;
        Ok(Self { flush_number: opened.map.flush_number(), searched, points, moving_points, scans })
    }
}

/// Marks that searches of all scans have found, each with its file.
#[derive(Clone, Debug, Default)]
pub struct AllMarks {
    points: u64,
    moving_points: u64,
    places: FxHashMap<u64, (PathBuf, u64, FoundScan)>,
}

impl AllMarks {
    /// Joins searches.
    ///
    /// # Errors
    ///
    /// A scan that was not searched; [`Error::Changed`] if the map was flushed since.
    pub fn of(scans: &KeptSummary, map: &Path, found: &[(PathBuf, FoundMarks)]) -> Result<Self> {
        if found.iter().any(|(_, found)| found.flush_number != scans.flush_number()) {
            return Err(Error::Changed { path: map.to_owned() });
        }
        let mut ranges: Vec<_> = found.iter().map(|(_, found)| found.searched).collect();
        ranges.sort_unstable();
        let mut ranges = ranges.iter().peekable();
        for scan in scans.scans() {
            while ranges.next_if(|(_, last)| *last < scan.number).is_some() {}
            if ranges.peek().is_none_or(|(first, _)| *first > scan.number) {
                let reason = format!("scan {} was not searched: pass the searches of all scans", scan.number);
                return Err(Error::argument("searches", reason));
            }
        }
        let mut all = Self::default();
        for (path, found) in found {
            all.points += found.points;
            all.moving_points += found.moving_points;
            let mut offset = 0_u64;
            for scan in &found.scans {
                all.places.insert(scan.number, (path.clone(), offset, *scan));
                offset = offset.saturating_add(scan.bytes);
            }
        }
        Ok(all)
    }

    /// The marks, read from the files when they are needed.
    pub fn new_marks(&self) -> NewMarks {
        let places = self.places.clone();
        let of_scan = move |number: u64| {
            let Some((path, offset, scan)) = places.get(&number) else {
                return Err(Error::argument("scans", format!("no marks were found for scan {number}")));
            };
            read_marks(path, *offset, scan).map_err(|error| Error::io(path, "read", error))
        };
        NewMarks::new(self.places.keys().copied().collect::<Vec<_>>(), of_scan)
    }
}

fn read_marks(path: &Path, offset: u64, scan: &FoundScan) -> io::Result<MovingMarks> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(offset))?;
    let mut bytes = Vec::new();
    file.take(scan.bytes).read_to_end(&mut bytes)?;
    let is_intact = bytes.len() as u64 == scan.bytes && crc32fast::hash(&bytes) == scan.crc32;
    let marks = is_intact.then(|| MovingMarks::from_bytes(bytes, scan.points)).flatten();
    marks.ok_or_else(|| {
        let hint = "the file of found marks is damaged; remove it and its text, and search again";
        io::Error::new(io::ErrorKind::InvalidData, hint)
    })
}

/// Marks the found points; the result is that of [`clean`](crate::clean()). `how` has finished parts, if several
/// processes have replayed the affected tiles.
///
/// # Errors
///
/// As for [`mark_moving`].
pub fn clean_found(scans: &KeptSummary, found: &AllMarks, how: &Replay) -> Result<Cleaned> {
    let marks = found.new_marks();
    let numbers = marks.numbers().to_vec();
    let replayed = mark_moving(scans, numbers, move |number| marks.of_scan(number), how, |_, _| ())?;
    Ok(Cleaned { replayed, points: found.points, points_changed: found.moving_points })
}
