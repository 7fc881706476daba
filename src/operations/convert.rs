use super::map_writer::{MapWriter, WrittenMap};
use crate::config::Storage;
use crate::error::Result;
use crate::mapper::{MapReader, MapView};
use crate::persistence::{new_map_id, new_metadata};
use std::path::Path;

/// Whether a new map gets the scans that its source keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CopyScans {
    /// It keeps them too, so it can be remapped.
    Yes,
    /// It has only the list of scans.
    No,
}

/// Copies a map to a new one with another or the same storage, in `folder`, which must be missing or empty. The content
/// is identical bit by bit. Memory: one tile, and about 200 bytes per tile.
///
/// The copy keeps the map's id, its inputs, the scan numbers of the map and of each tile, and with [`CopyScans::Yes`] the
/// kept scans. A build can therefore be resumed on either map, and a merge of both reports that they are related. Flush
/// numbers restart, and snapshots are not copied. A map of the original format gets an id. `progress` receives the
/// number of tiles done and in total.
///
/// # Errors
///
/// A folder with other content, a damaged tile or kept scan, or an I/O error. There is no new map then.
pub fn convert(
    map: &MapReader,
    folder: impl AsRef<Path>,
    storage: Storage,
    scans: CopyScans,
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let mut metadata = map.metadata().clone();
    if metadata.ext.is_none() {
        metadata = new_metadata(map.config(), new_map_id(), &[]);
    }
    if let Some(ext) = &mut metadata.ext {
        ext.storage = storage;
    }
    let mut writer = MapWriter::create_as(map.disk(), folder.as_ref(), metadata)?;
    match scans {
        CopyScans::Yes if map.keeps_scans() => writer.keep_scans_of(map)?,
        _ => writer.take_scans_of(map)?,
    }
    let tiles = map.tile_indices();
    for (done, &tile) in (1..).zip(&tiles) {
        if let Some(read) = map.read_table(tile)? {
            let scan_number = read.trailer.map_or(0, |trailer| trailer.scan_number);
            writer.put_as_of(tile, &read.table, scan_number)?;
        }
        progress(done, tiles.len() as u64);
    }
    writer.finish()
}
