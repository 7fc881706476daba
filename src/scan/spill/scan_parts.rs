use super::overflow::Overflow;
use super::part_log::{MakeScratch, NONE, PartLog};
use crate::scan::pages::MarkedBrick;
use crate::scan::per_scan::{Intensities, hits_and_misses, united, updates_by_tile};
use crate::scan::stop::Stop;
use crate::scan::updates::{BrickUpdate, ScanUpdates, TileUpdates, in_order_of_tiles};
use crate::scan::{PackedUpdates, ScanReport};
use crate::space::{Grid, TileIndex, TileTable, TileValue, put_number, take_number};
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The updates of one scan in parts, packed, tile by tile: as many as it takes, in little memory. Threads give them in.
///
/// Where each voxel counts once, a voxel may be in several parts: they are united at the end. Where every ray counts, the
/// parts of a tile count one after the other.
pub(crate) struct ScanParts<'a> {
    grid: &'a Grid,
    parts: Mutex<Parts<'a>>,
    is_empty: AtomicBool,
    has_failed: AtomicBool,
}

struct Parts<'a> {
    log: PartLog<'a>,
    /// Number of updates, and the updates, packed: what a record is made of.
    record: Vec<u8>,
    lists: TileTable<List>,
    most_tiles: usize,
    /// Why a part could not be kept; there is no use in others then.
    refusal: Option<Refusal>,
}

enum Refusal {
    Disk(io::Error),
    TooManyTiles,
}

/// The parts of a tile.
#[derive(Clone, Copy)]
struct List {
    /// Where the last is in the log.
    last: u64,
    count: u32,
    hits: u64,
    misses: u64,
}

impl Default for List {
    fn default() -> Self {
        Self { last: NONE, count: 0, hits: 0, misses: 0 }
    }
}

impl TileValue for List {
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

/// Bricks that are made into updates at a time.
const BRICKS_AT_A_TIME: usize = 4096;

impl<'a> ScanParts<'a> {
    /// What comes to more than so many bytes goes to a file that is made then.
    pub(crate) fn new(
        grid: &'a Grid,
        most_bytes: usize,
        most_tiles: usize,
        make_scratch: &'a MakeScratch<'a>,
    ) -> Self {
        let log = PartLog::new(most_bytes, make_scratch);
        let (record, lists, refusal) = Default::default();
        Self {
            grid,
            parts: Mutex::new(Parts { log, record, lists, most_tiles, refusal }),
            is_empty: AtomicBool::new(true),
            has_failed: AtomicBool::new(false),
        }
    }

    /// Whether no part was given in.
    pub(crate) fn is_empty(&self) -> bool {
        self.is_empty.load(Ordering::Relaxed)
    }

    /// Whether what is given in cannot be kept any more.
    #[inline]
    pub(crate) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// Gives in marked bricks, each voxel of which counts once.
    pub(crate) fn put_marked(&self, bricks: impl Iterator<Item = MarkedBrick>, intensities: &Intensities) {
        let mut some = Vec::with_capacity(BRICKS_AT_A_TIME);
        let mut bricks = bricks.peekable();
        while bricks.peek().is_some() {
            some.clear();
            // A page has 512 more at most.
            some.extend(bricks.by_ref().take(BRICKS_AT_A_TIME));
            let tiles = updates_by_tile(self.grid, &some, intensities).into_iter();
            self.put(tiles.map(|(tile, bricks)| {
                let counts = hits_and_misses(&bricks);
                (tile, TileUpdates::Once(bricks), counts)
            }));
        }
    }

    /// Gives in updates of tiles, with the number of their hits and misses.
    pub(crate) fn put(&self, tiles: impl Iterator<Item = (TileIndex, TileUpdates, (u64, u64))>) {
        if self.has_failed() {
            return;
        }
        self.is_empty.store(false, Ordering::Relaxed);
        let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        for (tile, updates, counts) in tiles {
            if let Err(refusal) = parts.put(tile, &updates, counts) {
                parts.refusal.get_or_insert(refusal);
                self.has_failed.store(true, Ordering::Relaxed);
                return;
            }
        }
    }

    /// What was given in. `report` is about the points; what has no room in memory is put aside.
    ///
    /// # Errors
    ///
    /// Those of putting aside, and of the file of the parts; [`Error::Stopped`](crate::error::Error::Stopped).
    pub(crate) fn into_updates(
        self,
        mut report: ScanReport,
        counts_once: bool,
        stop: &Stop,
        overflow: &mut Overflow<'_>,
    ) -> crate::error::Result<ScanUpdates> {
        let mut parts = self.parts.into_inner().unwrap_or_else(PoisonError::into_inner);
        match parts.refusal.take() {
            Some(Refusal::Disk(error)) => return Err(overflow.error(error)),
            Some(Refusal::TooManyTiles) => return Err(overflow.too_many_tiles()),
            None => {}
        }
        let lists = std::mem::take(&mut parts.lists);
        let mut kept = Kept { tiles: Vec::new(), bytes: 0 };
        for (tile, list) in lists.iter() {
            stop.check()?;
            let records = parts.records_of(&list).map_err(|error| overflow.error(error))?;
            let (hits, misses) = match counts_once && list.count > 1 {
                true => {
                    let bricks = parts.united(&records).map_err(|error| overflow.error(error))?;
                    let counts = hits_and_misses(&bricks);
                    kept.push(tile, PackedUpdates::of(&TileUpdates::Once(bricks)), overflow)?;
                    counts
                }
                false => {
                    for at in records {
                        let packed = parts.read(at).map_err(|error| overflow.error(error))?;
                        kept.push(tile, packed, overflow)?;
                    }
                    (list.hits, list.misses)
                }
            };
            report.hits += hits;
            report.misses += misses;
        }
        let tiles =
            kept.tiles.into_iter().map(|(tile, packed)| (tile, TileUpdates::Packed(packed))).collect();
        let mut updates = in_order_of_tiles(self.grid, tiles, report);
        updates.report.tiles_touched = lists.len() as u64;
        Ok(updates)
    }
}

impl Parts<'_> {
    fn put(&mut self, tile: TileIndex, updates: &TileUpdates, counts: (u64, u64)) -> Result<(), Refusal> {
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
        list.last = self.log.append(list.last, &self.record).map_err(Refusal::Disk)?;
        list.count += 1;
        list.hits += counts.0;
        list.misses += counts.1;
        self.lists.insert(tile, list);
        if self.lists.len() > self.most_tiles { Err(Refusal::TooManyTiles) } else { Ok(()) }
    }

    /// Where the parts of a tile are, in the order in which they came.
    fn records_of(&mut self, list: &List) -> io::Result<Vec<u64>> {
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
        self.log.read(at, &mut self.record)?;
        let (updates, bytes) = self.record.split_first_chunk().ok_or(io::ErrorKind::UnexpectedEof)?;
        Ok(PackedUpdates::from_parts(bytes.to_vec(), u64::from_le_bytes(*updates) as usize))
    }

    fn united(&mut self, records: &[u64]) -> io::Result<Vec<BrickUpdate>> {
        let mut all = Vec::new();
        for &at in records {
            for updates in self.read(at)?.iter() {
                if let TileUpdates::Once(bricks) = updates {
                    all = united(all, bricks);
                }
            }
        }
        Ok(all)
    }
}

/// Updates of tiles that are kept in memory.
struct Kept {
    tiles: Vec<(TileIndex, PackedUpdates)>,
    bytes: usize,
}

/// What a tile takes beside its updates.
const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, PackedUpdates)>();

impl Kept {
    /// Keeps the next updates of a tile. If there are too many, all are put aside.
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
        if self.bytes > overflow.most_bytes {
            self.bytes = 0;
            (overflow.put_aside)(std::mem::take(&mut self.tiles))?;
        }
        Ok(())
    }
}
