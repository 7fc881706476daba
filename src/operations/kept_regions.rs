use super::map_writer::MapWriter;
use crate::error::{Error, Result};
use crate::mapper::MapReader;
use crate::space::TileBox;
use crate::store::{CatalogEntry, KeptRecord, KeptRecords, Layout, SegmentPlace, SegmentReader};

/// Copies the kept scans of maps that are regions of one build: each scan once, as one build of `region` would have kept
/// it. The maps keep all scans of the build, each with the tiles of its region.
///
/// # Errors
///
/// A scan that is not equal in all maps, a damaged or unreadable one, or an I/O error.
pub(super) fn keep_scans_of_regions(
    writer: &mut MapWriter,
    maps: &[MapReader],
    region: Option<TileBox>,
) -> Result<()> {
    let Some((first, others)) = maps.split_first() else { return Ok(()) };
    let mut records = first.kept_records()?;
    let mut of_others = others.iter().map(MapReader::kept_records).collect::<Result<Vec<_>>>()?;
    writer.keep_scans(|archive| {
        let mut entry = first.explained(records.next_entry())?;
        for (map, records) in others.iter().zip(&mut of_others) {
            unite(&mut entry, first, map, records)?;
        }
        if let Some(CatalogEntry::Kept(scan)) = &mut entry {
            scan.rays.region = region;
            scan.tiles.sort_unstable();
            scan.tiles.dedup();
            for place in scan.places_mut() {
                *place = first.explained(archive.copy_from(first.store().layout(), *place))?;
            }
        }
        Ok(entry)
    })
}

/// Adds the tiles of the next entry of another map to an entry of the first, and checks that all else is equal.
fn unite(
    entry: &mut Option<CatalogEntry>,
    first: &MapReader,
    map: &MapReader,
    records: &mut KeptRecords,
) -> Result<()> {
    let other = map.explained(records.next_entry())?;
    let is_same = match (entry.as_mut(), &other) {
        (Some(CatalogEntry::Kept(scan)), Some(CatalogEntry::Kept(same))) => {
            scan.updates += same.updates;
            scan.tiles.extend(&same.tiles);
            is_same_scan(scan, same) && have_same_points(first, scan.place, map, same.place)?
        }
        (entry, other) => entry.as_deref() == other.as_ref(),
    };
    if is_same {
        return Ok(());
    }
    let number = entry.as_ref().or(other.as_ref()).and_then(CatalogEntry::numbers).map(|(number, _)| number);
    let name =
        number.map_or("an entry after the last scan".to_owned(), |number| format!("kept scan {number}"));
    let reason = format!(
        "its {name} is not the one of {}: build both regions from the same scans",
        first.folder().display()
    );
    Err(Error::argument(map.folder().display().to_string(), reason))
}

/// Returns whether two records are of one scan, in different regions.
fn is_same_scan(a: &KeptRecord, b: &KeptRecord) -> bool {
    let of_scan = |record: &KeptRecord| {
        let mut scan = record.clone();
        (scan.updates, scan.place, scan.rays.region) = (0, SegmentPlace::default(), None);
        scan.tiles.clear();
        scan
    };
    of_scan(a) == of_scan(b)
}

fn have_same_points(a: &MapReader, of_a: SegmentPlace, b: &MapReader, of_b: SegmentPlace) -> Result<bool> {
    if of_a.bytes != of_b.bytes {
        return Ok(false);
    }
    let open = |map: &MapReader, place| -> Result<SegmentReader> {
        let layout: &Layout = map.store().layout();
        map.explained(SegmentReader::open(&*map.disk(), layout, place))
    };
    let (mut from_a, mut from_b) = (open(a, of_a)?, open(b, of_b)?);
    loop {
        match (a.explained(from_a.next_block())?, b.explained(from_b.next_block())?) {
            (None, None) => return Ok(true),
            (one, other) if one == other => {}
            _ => return Ok(false),
        }
    }
}
