use super::map_writer::{MapWriter, WrittenMap};
use crate::config::Storage;
use crate::error::Result;
use crate::mapper::{MapReader, MapView};
use crate::persistence::{new_map_id, new_metadata};
use std::path::Path;

/// Writes a map anew with another storage, or the same: a new map in `folder`, which does not exist yet or is empty,
/// with the same content to the bit. In memory are one tile and some 200 bytes a tile.
///
/// It is the same map in another form: its id, its number of scans, each tile's, and the input that a build goes on
/// with are kept, so that a build can be resumed on either, and a merge of both is warned of. Only flushes are counted
/// anew; snapshots are not taken along. A map of the original format, which has no id, gets one, as it would before its
/// first change. `progress` is told the tiles done and all.
///
/// # Errors
///
/// A folder with other content, a damaged tile, which is named, a disk that refuses: there is no new map then.
pub fn convert(
    map: &MapReader,
    folder: impl AsRef<Path>,
    storage: Storage,
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
    writer.take_scans_of(map)?;
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
