use super::map_writer::MapWriter;
use crate::error::{Error, Result};
use crate::mapper::MapReader;
use crate::persistence::PointReader;
use crate::scan::PointAttributes;
use crate::space::{Point, TileBox};
use crate::store::{
    CatalogEntry, Disk, KeptRecord, KeptRecords, Layout, MapPath, ScanArchive, SegmentPlace, SegmentReader,
};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::sync::Arc;

/// Copies the kept scans of maps that are parts of one build: each scan once, as one build of `region` would have kept
/// it.
///
/// A part numbers all scans of the build, and keeps those that reach it, each with the tiles of its region. Memory: one
/// entry per part, and one open file for each part that keeps scans near the current one.
///
/// # Errors
///
/// A scan that is not equal in all parts that keep it, a damaged or unreadable one, or an I/O error. Without
/// `may_lack_scans` also a scan that no part keeps.
pub(super) fn unite_scans(
    writer: &mut MapWriter,
    parts: Vec<Part<'_>>,
    region: Option<TileBox>,
    may_lack_scans: bool,
) -> Result<()> {
    let mut united = UnitedScans::of(parts)?;
    writer.keep_scans(|archive| {
        let mut entry = united.next_entry()?;
        match &mut entry {
            Some(CatalogEntry::Unlisted(first, _)) if !may_lack_scans => return Err(united.lacks(*first)),
            Some(CatalogEntry::Kept(scan)) => {
                united.copy_points(archive, scan, region)?;
            }
            _ => {}
        }
        Ok(entry)
    })
}

/// Copies the kept scans that parts of an update have added to a map, each once: those after number `before`, `scans` of
/// them.
///
/// # Errors
///
/// As for [`unite_scans`], and another number of scans.
pub(super) fn add_united_scans(
    archive: &mut ScanArchive,
    parts: Vec<Part<'_>>,
    region: Option<TileBox>,
    before: u64,
    scans: u64,
) -> Result<()> {
    let mut united = UnitedScans::of(parts)?;
    united.next = before + 1;
    while let Some(entry) = united.next_entry()? {
        match entry {
            CatalogEntry::Kept(scan) if scan.number <= before => {
                return Err(united.differs(united.holder, scan.number));
            }
            CatalogEntry::Kept(mut scan) => {
                united.copy_points(archive, &mut scan, region)?;
                archive.note(CatalogEntry::Kept(scan));
            }
            CatalogEntry::Unlisted(first, _) => return Err(united.lacks(first)),
            _ => return Err(united.differs(united.holder, united.next - 1)),
        }
    }
    match united.next.cmp(&(before + scans + 1)) {
        Ordering::Less => Err(united.lacks(united.next)),
        Ordering::Equal => Ok(()),
        Ordering::Greater => Err(united.differs(united.holder, united.next - 1)),
    }
}

/// A part whose next scan is so many numbers ahead is closed until then.
const GAP_SCANS: u64 = 256;

/// Catalog of a part of a build.
pub(super) struct Part<'a> {
    source: Source<'a>,
    disk: Arc<dyn Disk>,
    layout: Layout,
    /// `None` while the part is closed.
    records: Option<KeptRecords>,
    /// Number of entries read.
    taken: u64,
    /// Number of the last scan of these.
    last: u64,
    /// The next entry that is not [`CatalogEntry::Unlisted`].
    next: Option<CatalogEntry>,
}

enum Source<'a> {
    Open(&'a MapReader),
    Shard(&'a MapPath),
}

impl<'a> Part<'a> {
    /// A map that is open already.
    pub(super) fn open(map: &'a MapReader) -> Self {
        Self::new(Source::Open(map), map)
    }

    /// A shard without a writer; `map` is its reader.
    pub(super) fn of_shard(path: &'a MapPath, map: &MapReader) -> Self {
        Self::new(Source::Shard(path), map)
    }

    fn new(source: Source<'a>, map: &MapReader) -> Self {
        let (disk, layout) = (map.disk(), map.store().layout().clone());
        Self { source, disk, layout, records: None, taken: 0, last: 0, next: None }
    }

    fn explained<T>(&self, result: Result<T>) -> Result<T> {
        match self.source {
            Source::Open(map) => map.explained(result),
            Source::Shard(_) => result,
        }
    }

    fn name(&self) -> String {
        self.layout.folder().display().to_string()
    }

    /// Reads the next entry with a scan.
    fn advance(&mut self) -> Result<()> {
        let before = self.last;
        let mut records = match self.records.take() {
            Some(records) => records,
            None => self.reopened()?,
        };
        self.next = loop {
            let entry = self.explained(records.next_entry())?;
            self.taken += u64::from(entry.is_some());
            self.last = entry.as_ref().and_then(CatalogEntry::numbers).map_or(self.last, |(_, last)| last);
            match entry {
                Some(CatalogEntry::Unlisted(..)) => {}
                entry => break entry,
            }
        };
        if self.next.is_some() && self.last - before <= GAP_SCANS {
            self.records = Some(records);
        }
        Ok(())
    }

    fn reopened(&self) -> Result<KeptRecords> {
        let mut records = match self.source {
            Source::Open(map) => map.kept_records()?,
            Source::Shard(path) => MapReader::open(path.clone(), 0)?.kept_records()?,
        };
        for _ in 0..self.taken {
            self.explained(records.next_entry())?;
        }
        Ok(records)
    }

    /// The number from which the next entry is valid; `None` after the last entry.
    fn next_number(&self) -> Option<u64> {
        self.next.as_ref().map(|entry| entry.numbers().map_or(self.last + 1, |(first, _)| first))
    }
}

/// Iterator over the united entries of parts.
struct UnitedScans<'a> {
    parts: Vec<Part<'a>>,
    /// Parts with a further entry, by its number.
    queue: BinaryHeap<Reverse<(u64, usize)>>,
    /// Number after the last entry.
    next: u64,
    /// The part whose points the last kept scan has.
    holder: usize,
}

impl<'a> UnitedScans<'a> {
    fn of(parts: Vec<Part<'a>>) -> Result<Self> {
        let mut united = Self { parts, queue: BinaryHeap::new(), next: 1, holder: 0 };
        (0..united.parts.len()).try_for_each(|part| united.advance(part))?;
        Ok(united)
    }

    fn advance(&mut self, part: usize) -> Result<()> {
        self.parts[part].advance()?;
        self.queue.extend(self.parts[part].next_number().map(|number| Reverse((number, part))));
        Ok(())
    }

    fn next_entry(&mut self) -> Result<Option<CatalogEntry>> {
        let Some(&Reverse((number, first))) = self.queue.peek() else {
            let last = self.parts.iter().map(|part| part.last).max().unwrap_or(0);
            return Ok(self.gap_before(last + 1));
        };
        if let Some(gap) = self.gap_before(number) {
            return Ok(Some(gap));
        }
        let mut holders = Vec::new();
        while let Some(&Reverse((of_next, part))) = self.queue.peek()
            && of_next == number
        {
            self.queue.pop();
            holders.push(part);
        }
        let mut entry = self.parts[first].next.take();
        self.holder = first;
        let is_scan = matches!(entry, Some(CatalogEntry::Kept(_)));
        for &part in &holders[1..] {
            let other = self.parts[part].next.take();
            if !self.unite(&mut entry, part, &other)? {
                return Err(self.differs(part, number));
            }
        }
        // Only kept scans may be missing in a part.
        if let Some(lacking) = (0..self.parts.len()).find(|part| !is_scan && !holders.contains(part)) {
            return Err(self.differs(lacking, number));
        }
        holders.into_iter().try_for_each(|part| self.advance(part))?;
        self.next = entry.as_ref().and_then(CatalogEntry::numbers).map_or(self.next, |(_, last)| last + 1);
        Ok(entry)
    }

    /// Copies the points of the last kept scan to another archive.
    fn copy_points(
        &self,
        archive: &mut ScanArchive,
        scan: &mut KeptRecord,
        region: Option<TileBox>,
    ) -> Result<()> {
        scan.rays.region = region;
        scan.tiles.sort_unstable();
        scan.tiles.dedup();
        let holder = &self.parts[self.holder];
        for place in scan.places_mut() {
            *place = holder.explained(archive.copy_from(&*holder.disk, &holder.layout, *place))?;
        }
        Ok(())
    }

    /// The numbers before this one that no part has a scan for.
    fn gap_before(&mut self, number: u64) -> Option<CatalogEntry> {
        let gap = (self.next < number).then(|| CatalogEntry::Unlisted(self.next, number - 1));
        self.next = self.next.max(number);
        gap
    }

    /// Adds the tiles of the same entry of another part. Returns false if it is another one.
    fn unite(
        &self,
        entry: &mut Option<CatalogEntry>,
        part: usize,
        other: &Option<CatalogEntry>,
    ) -> Result<bool> {
        let (Some(CatalogEntry::Kept(scan)), Some(CatalogEntry::Kept(same))) = (entry.as_mut(), other) else {
            return Ok(entry == other);
        };
        scan.updates += same.updates;
        scan.tiles.extend(&same.tiles);
        let [a, b] = [self.holder, part].map(|part| &self.parts[part]);
        Ok(is_same_scan(scan, same)
            && have_same_marks(a, scan, b, same)?
            && (have_same_bytes(a, scan.place, b, same.place)?
                || have_same_points(a, scan.place, b, same.place)?))
    }

    fn differs(&self, part: usize, number: u64) -> Error {
        let reason = format!(
            "its entry {number} of kept scans is not the one of {}: build both from the same scans",
            self.parts[self.holder].name()
        );
        Error::argument(self.parts[part].name(), reason)
    }

    fn lacks(&self, number: u64) -> Error {
        let reason = format!("no part keeps scan {number}: build the part that it reaches");
        Error::argument(self.parts.first().map(Part::name).unwrap_or_default(), reason)
    }
}

/// Returns whether two records are of one scan, in different regions.
fn is_same_scan(a: &KeptRecord, b: &KeptRecord) -> bool {
    let of_scan = |record: &KeptRecord| {
        let mut scan = record.clone();
        (scan.updates, scan.place, scan.rays.region) = (0, SegmentPlace::default(), None);
        if let Some(place) = scan.moving.as_mut().and_then(|marks| marks.place.as_mut()) {
            *place = SegmentPlace::default();
        }
        scan.tiles.clear();
        scan
    };
    of_scan(a) == of_scan(b)
}

/// Returns whether the same points are marked as moving.
fn have_same_marks(a: &Part<'_>, of_a: &KeptRecord, b: &Part<'_>, of_b: &KeptRecord) -> Result<bool> {
    let [place_in_a, place_in_b] = [of_a, of_b].map(|scan| scan.moving.and_then(|marks| marks.place));
    match place_in_a.zip(place_in_b) {
        Some((in_a, in_b)) => have_same_bytes(a, in_a, b, in_b),
        None => Ok(true),
    }
}

/// Returns whether blocks are stored as the same bytes, which is the usual case and the faster test.
fn have_same_bytes(a: &Part<'_>, of_a: SegmentPlace, b: &Part<'_>, of_b: SegmentPlace) -> Result<bool> {
    if of_a.bytes != of_b.bytes {
        return Ok(false);
    }
    let open = |part: &Part<'_>, place| part.explained(SegmentReader::open(&*part.disk, &part.layout, place));
    let (mut from_a, mut from_b) = (open(a, of_a)?, open(b, of_b)?);
    loop {
        match (a.explained(from_a.next_block())?, b.explained(from_b.next_block())?) {
            (None, None) => return Ok(true),
            (one, other) if one == other => {}
            _ => return Ok(false),
        }
    }
}

/// Returns whether the points are the same to the bit. Their bytes may differ, because the form of a block depends on the
/// scans that a part keeps before it.
fn have_same_points(a: &Part<'_>, of_a: SegmentPlace, b: &Part<'_>, of_b: SegmentPlace) -> Result<bool> {
    let open = |part: &Part<'_>, place| part.explained(PointReader::open(&*part.disk, &part.layout, place));
    let mut readers = [(a, open(a, of_a)?), (b, open(b, of_b)?)];
    let mut blocks: [PointsOfBlock; 2] = Default::default();
    loop {
        let mut are_more = [false; 2];
        for (((part, reader), block), is_more) in readers.iter_mut().zip(&mut blocks).zip(&mut are_more) {
            let PointsOfBlock { points, intensities, attributes } = block;
            *is_more = part.explained(reader.next(points, intensities, attributes))?;
        }
        if !blocks[0].equals(&blocks[1]) || are_more[0] != are_more[1] {
            return Ok(false);
        }
        if !are_more[0] {
            return Ok(true);
        }
    }
}

#[derive(Default)]
struct PointsOfBlock {
    points: Vec<Point>,
    intensities: Vec<f32>,
    attributes: PointAttributes,
}

impl PointsOfBlock {
    fn equals(&self, other: &Self) -> bool {
        let are_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        let [points, of_other] = [self, other].map(|block| block.points.as_flattened());
        let intensities = self.intensities.iter().zip(&other.intensities);
        points.len() == of_other.len()
            && self.intensities.len() == other.intensities.len()
            && points.iter().zip(of_other).all(are_same)
            && intensities.into_iter().all(|(a, b)| a.to_bits() == b.to_bits())
            && self.attributes == other.attributes
    }
}
