use super::map_writer::MapWriter;
use crate::error::Result;
use crate::mapper::MapReader;
use crate::space::TileBox;
use crate::store::{CatalogEntry, KeptRecord};

/// Copies the kept scans that changed a tile in a box, with all their points. They are mapped only into this box from
/// then on. The numbers of the others become those of removed scans.
///
/// # Errors
///
/// A damaged or unreadable scan, or an I/O error.
pub(super) fn keep_scans_of_part(writer: &mut MapWriter, map: &MapReader, part: TileBox) -> Result<()> {
    let mut records = map.kept_records()?;
    let mut waiting = None;
    writer.keep_scans(|archive| {
        let mut left_out: Option<(u64, u64)> = None;
        loop {
            let entry = match waiting.take() {
                Some(entry) => Some(entry),
                None => map.explained(records.next_entry())?.map(|entry| limited_to(part, entry)),
            };
            match (left_out, entry) {
                (None, Some(CatalogEntry::Removed(first, last))) => left_out = Some((first, last)),
                (Some((first, _)), Some(CatalogEntry::Removed(_, last))) => left_out = Some((first, last)),
                (Some((first, last)), entry) => {
                    waiting = entry;
                    return Ok(Some(CatalogEntry::Removed(first, last)));
                }
                (None, mut entry) => {
                    if let Some(CatalogEntry::Kept(scan)) = &mut entry {
                        for place in scan.places_mut() {
                            *place =
                                map.explained(archive.copy_from(&*map.disk(), map.store().layout(), *place))?;
                        }
                    }
                    return Ok(entry);
                }
            }
        }
    })
}

/// The entry of a map of a part.
fn limited_to(part: TileBox, mut entry: CatalogEntry) -> CatalogEntry {
    let CatalogEntry::Kept(scan) = &mut entry else { return entry };
    let KeptRecord { number, rays, tiles, .. } = &mut **scan;
    tiles.retain(|tile| part.contains(*tile));
    rays.region = rays.region.map_or(Some(part), |region| region.intersection(part));
    if tiles.is_empty() || rays.region.is_none() {
        return CatalogEntry::Removed(*number, *number);
    }
    entry
}
