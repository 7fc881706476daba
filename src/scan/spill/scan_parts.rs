use super::overflow::Overflow;
use super::part_log::{MakeScratch, NONE, PartLog};
use crate::config::GUARD_REACH;
use crate::scan::clearing::Clearance;
use crate::scan::pages::MarkedBrick;
use crate::scan::per_scan::{
    Intensities, guarded_updates, hits_and_misses, marks_by_tile, merge_bricks, updates_by_tile,
};
use crate::scan::stop::Stop;
use crate::scan::updates::{
    BrickUpdate, MappedTiles, ScanUpdates, TileUpdates, in_order_of_tiles, mean_tiles_of_brick,
};
use crate::scan::{PackedUpdates, ScanReport};
use crate::space::{TileIndex, TileTable, TileValue, put_number, take_number};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Packed updates of one scan in any number of parts, by tile, with little memory. Threads add parts concurrently.
///
/// With insertion per scan, a voxel may be in several parts, which are merged at the end. With insertion per ray, the
/// parts of a tile are concatenated.
pub(crate) struct ScanParts<'a> {
    mapped: MappedTiles<'a>,
    /// Rule for weak misses, if the map has one. The rule is applied to the merged parts of a tile, which therefore
    /// include all marks within its reach of the tile.
    clearance: Option<Clearance>,
    parts: Mutex<Parts<'a>>,
    stop: &'a Stop,
    is_empty: AtomicBool,
    has_failed: AtomicBool,
}

struct Parts<'a> {
    log: PartLog<'a>,
    /// The record under construction: number of updates, then the packed updates.
    record: Vec<u8>,
    lists: TileTable<PartList>,
    max_tiles: usize,
    /// The first failure; parts added after it are dropped.
    failure: Option<Failure>,
}

enum Failure {
    Disk(io::Error),
    TooManyTiles,
}

#[derive(Clone, Copy)]
struct PartList {
    /// Position of the last part in the log.
    last: u64,
    count: u32,
    hits: u64,
    misses: u64,
}

impl Default for PartList {
    fn default() -> Self {
        Self { last: NONE, count: 0, hits: 0, misses: 0 }
    }
}

impl TileValue for PartList {
    fn pack(self, before: Self, out: &mut Vec<u8>) {
        put_number(self.last.wrapping_sub(before.last) as i64, out);
        put_number(self.count, out);
        put_number(self.hits, out);
        put_number(self.misses, out);
    }

    fn unpack(before: Self, input: &mut &[u8]) -> Self {
        let last = before.last.wrapping_add(take_number::<i64>(input) as u64);
        Self { last, count: take_number(input), hits: take_number(input), misses: take_number(input) }
    }
}

/// Number of bricks that are converted to updates at a time, if each is in one tile.
const BRICKS_AT_A_TIME: usize = 4096;

impl<'a> ScanParts<'a> {
    /// Creates a collection that spills parts beyond `max_bytes` to a file, which is created on demand. Once `stop` is
    /// raised, parts are dropped.
    pub(crate) fn new(
        mapped: MappedTiles<'a>,
        clearance: Option<Clearance>,
        stop: &'a Stop,
        max_bytes: usize,
        max_tiles: usize,
        make_scratch: &'a MakeScratch<'a>,
    ) -> Self {
        let log = PartLog::new(max_bytes, make_scratch);
        let (record, lists, failure) = Default::default();
        Self {
            mapped,
            clearance,
            parts: Mutex::new(Parts { log, record, lists, max_tiles, failure }),
            stop,
            is_empty: AtomicBool::new(true),
            has_failed: AtomicBool::new(false),
        }
    }

    /// Creates a collection that accepts no parts: adding one fails, and collecting ends.
    pub(crate) fn refused(mapped: MappedTiles<'a>, stop: &'a Stop) -> Self {
        Self::new(mapped, None, stop, 0, 0, &|| Err(io::ErrorKind::Unsupported.into()))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.is_empty.load(Ordering::Relaxed)
    }

    /// Returns whether adding failed; further parts are dropped.
    #[inline]
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// Adds marked bricks, in insertion per scan.
    pub(crate) fn add_marked(&self, bricks: impl Iterator<Item = MarkedBrick>, intensities: &Intensities) {
        let at_a_time = BRICKS_AT_A_TIME / mean_tiles_of_brick(self.mapped.grid);
        let mut some = Vec::with_capacity(at_a_time);
        let mut bricks = bricks.peekable();
        while !self.stop.is_set() && bricks.peek().is_some() {
            some.clear();
            some.extend(bricks.by_ref().take(at_a_time));
            let tiles = match self.clearance {
                None => updates_by_tile(self.mapped, &some, intensities, |_| [0; 8]),
                Some(_) => marks_by_tile(self.mapped, &some, intensities, GUARD_REACH),
            };
            self.add(tiles.into_iter().map(|(tile, bricks)| {
                let counts = hits_and_misses(&bricks);
                (tile, TileUpdates::Masks(bricks), counts)
            }));
        }
    }

    /// Adds updates of tiles, restricted to mapped tiles, with their numbers of hits and misses.
    pub(crate) fn add(&self, tiles: impl Iterator<Item = (TileIndex, TileUpdates, (u64, u64))>) {
        if self.has_failed() {
            return;
        }
        self.is_empty.store(false, Ordering::Relaxed);
        let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        for (tile, updates, counts) in tiles.filter(|(tile, ..)| self.mapped.has(*tile)) {
            if let Err(failure) = parts.add(tile, &updates, counts) {
                parts.failure.get_or_insert(failure);
                self.has_failed.store(true, Ordering::Relaxed);
                return;
            }
        }
    }

    /// Returns the merged updates. `report` covers the points; updates that exceed the memory limit are spilled.
    ///
    /// # Errors
    ///
    /// Returns errors from the spill and from the log's file, and [`Error::Stopped`](crate::error::Error::Stopped).
    pub(crate) fn into_updates(
        self,
        mut report: ScanReport,
        is_per_scan: bool,
        stop: &Stop,
        overflow: &mut Overflow<'_>,
    ) -> crate::error::Result<ScanUpdates> {
        let mut parts = self.parts.into_inner().unwrap_or_else(PoisonError::into_inner);
        match parts.failure.take() {
            Some(Failure::Disk(error)) => return Err(overflow.error(error)),
            Some(Failure::TooManyTiles) => return Err(overflow.too_many_tiles()),
            None => {}
        }
        let lists = std::mem::take(&mut parts.lists);
        let mut output = OutputBuffer { tiles: Vec::new(), bytes: 0 };
        let mut tiles_touched = 0;
        for (tile, list) in lists.iter() {
            stop.check()?;
            let records = parts.records_of(&list).map_err(|error| overflow.error(error))?;
            let (hits, misses) = match is_per_scan && (list.count > 1 || self.clearance.is_some()) {
                true => {
                    let mut bricks = parts.merged(&records).map_err(|error| overflow.error(error))?;
                    if let Some(clearance) = &self.clearance {
                        bricks = guarded_updates(self.mapped.grid, tile, &bricks, clearance);
                        if bricks.is_empty() {
                            continue;
                        }
                    }
                    let counts = hits_and_misses(&bricks);
                    output.push(tile, PackedUpdates::of(&TileUpdates::Masks(bricks)), overflow)?;
                    counts
                }
                false => {
                    for at in records {
                        let packed = parts.read(at).map_err(|error| overflow.error(error))?;
                        output.push(tile, packed, overflow)?;
                    }
                    (list.hits, list.misses)
                }
            };
            report.hits += hits;
            report.misses += misses;
            tiles_touched += 1;
        }
        let tiles =
            output.tiles.into_iter().map(|(tile, packed)| (tile, TileUpdates::Packed(packed))).collect();
        let mut updates = in_order_of_tiles(self.mapped.grid, tiles, report);
        updates.report.tiles_touched = tiles_touched;
        Ok(updates)
    }
}

impl Parts<'_> {
    fn add(&mut self, tile: TileIndex, updates: &TileUpdates, counts: (u64, u64)) -> Result<(), Failure> {
        let mut list = self.lists.get(tile).unwrap_or_default();
        let packed;
        let packed = match updates {
            TileUpdates::Packed(packed) => packed,
            updates => {
                packed = PackedUpdates::of(updates);
                &packed
            }
        };
        self.record.clear();
        self.record.extend((packed.len() as u64).to_le_bytes());
        self.record.extend(packed.as_bytes());
        list.last = self.log.append(list.last, &self.record).map_err(Failure::Disk)?;
        list.count += 1;
        list.hits += counts.0;
        list.misses += counts.1;
        self.lists.insert(tile, list);
        if self.lists.len() > self.max_tiles { Err(Failure::TooManyTiles) } else { Ok(()) }
    }

    /// Positions of a tile's parts, the oldest first.
    fn records_of(&mut self, list: &PartList) -> io::Result<Vec<u64>> {
        let mut records = Vec::new();
        let mut at = list.last;
        while at != NONE {
            records.push(at);
            at = self.log.before(at)?;
        }
        records.reverse();
        Ok(records)
    }

    fn read(&mut self, at: u64) -> io::Result<PackedUpdates> {
        let (updates, bytes) =
            self.log.record(at)?.split_first_chunk().ok_or(io::ErrorKind::UnexpectedEof)?;
        Ok(PackedUpdates::from_parts(bytes.to_vec(), u64::from_le_bytes(*updates) as usize))
    }

    fn merged(&mut self, records: &[u64]) -> io::Result<Vec<BrickUpdate>> {
        let mut all = Vec::new();
        for &at in records {
            for updates in self.read(at)?.iter() {
                if let TileUpdates::Masks(bricks) = updates {
                    all = merge_bricks(all, bricks);
                }
            }
        }
        Ok(all)
    }
}

/// Complete updates of tiles, in memory.
struct OutputBuffer {
    tiles: Vec<(TileIndex, PackedUpdates)>,
    bytes: usize,
}

/// Bytes of a tile in addition to its updates.
const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, PackedUpdates)>();

impl OutputBuffer {
    /// Appends the next updates of a tile. If the limit is exceeded, all are spilled.
    fn push(
        &mut self,
        tile: TileIndex,
        mut packed: PackedUpdates,
        overflow: &mut Overflow<'_>,
    ) -> crate::error::Result<()> {
        packed.shrink();
        self.bytes += SLOT_BYTES + packed.bytes();
        match self.tiles.last_mut() {
            Some((last, before)) if *last == tile => before.append(&packed),
            _ => self.tiles.push((tile, packed)),
        }
        if self.bytes > overflow.max_bytes {
            self.bytes = 0;
            (overflow.spill)(std::mem::take(&mut self.tiles))?;
        }
        Ok(())
    }
}
