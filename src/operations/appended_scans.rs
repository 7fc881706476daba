use super::map_writer::MapWriter;
use crate::error::Result;
use crate::mapper::MapReader;
use crate::store::CatalogEntry;

/// Copies the kept scans of several maps, one map after the other. The scans of each map get the numbers after those of
/// the map before.
///
/// # Errors
///
/// A damaged or unreadable scan, or an I/O error.
pub(super) fn append_scans(writer: &mut MapWriter, maps: &[MapReader]) -> Result<()> {
    let mut rest = maps.iter();
    let mut current = None;
    let (mut before, mut last) = (0, 0);
    writer.keep_scans(|archive| {
        loop {
            let Some((map, records)) = &mut current else {
                let Some(map) = rest.next() else { return Ok(None) };
                current = Some((map, map.kept_records()?));
                before = last;
                continue;
            };
            let Some(entry) = map.explained(records.next_entry())? else {
                current = None;
                continue;
            };
            let mut entry = entry.after(before);
            if let CatalogEntry::Kept(scan) = &mut entry {
                for place in scan.places_mut() {
                    *place = map.explained(archive.copy_from(&*map.disk(), map.store().layout(), *place))?;
                }
            }
            last = entry.numbers().map_or(last, |(_, last)| last);
            return Ok(Some(entry));
        }
    })
}
