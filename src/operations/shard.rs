use super::map_writer::{MapWriter, WrittenMap};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::store::{MapPath, hex, move_map};
use std::path::Path;

/// Creates a shard of a future map: a copy of a map without a writer, with the id of the future map.
///
/// [`join`](super::join()) combines shards with one id and without common tiles to a map, without reading their tiles.
/// Therefore this function compares every byte with the map's log, and the shard is durable when it returns. Tables are
/// not decoded. The tiles get scan number 0, because the future map may number scans differently. A shard of a map that
/// keeps its scans keeps them too. `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// A map of the original format, a snapshot, a damaged tile, an output with other content, or an I/O error. There is no
/// shard then.
pub fn make_shard(
    map: &MapReader,
    output: impl AsRef<Path>,
    map_id: [u8; 16],
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let mut metadata = map.metadata().clone();
    let Some(ext) = metadata.ext.as_mut().filter(|_| map.snapshot().is_none()) else {
        let reason = "a snapshot or a map of the original format; create a shard from the current state of a map with \
             checksums";
        return Err(Error::argument(map.folder().display().to_string(), reason));
    };
    ext.map_id = hex(&map_id);
    let mut writer = MapWriter::create_as(map.disk(), output.as_ref(), metadata)?;
    match map.keeps_scans() {
        true => writer.keep_scans_of(map)?,
        false => writer.take_scans_of(map)?,
    }
    let tiles = map.tile_indices();
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        writer.copy_as_of(tile, map, 0)?;
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    writer.finish()
}

/// Like [`make_shard`], but moves a map that is no longer needed: no tile is read or written, and each file is synced
/// once.
///
/// The map must have the id `map_id`, be on the same file system, and not be used by another process. It may have been
/// written without syncs ([`UnsyncedDisk`](crate::store::UnsyncedDisk)). The lengths of its tiles' files are compared
/// with the log, and the tiles keep their scan numbers. If the map cannot be moved, it is copied, every byte is
/// compared, and the source remains.
///
/// # Errors
///
/// As for [`make_shard`], and a map with a writer. There is no shard then, and the map may be lost.
pub fn move_shard(
    map: impl Into<MapPath>,
    output: impl AsRef<Path>,
    map_id: [u8; 16],
    progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let (disk, folder) = map.into().into_parts();
    let map = MapReader::open(MapPath::on(disk.clone(), &folder), 0)?;
    if map.map_id() != Some(map_id) {
        return make_shard(&map, output, map_id, progress);
    }
    let mut written = WrittenMap::default();
    let versions = map.tile_indices().into_iter().filter_map(|tile| map.version_of_tile(tile));
    versions.for_each(|version| written.add(version));
    drop(map);
    if move_map(&disk, &folder, output.as_ref())? {
        return Ok(written);
    }
    make_shard(&MapReader::open(MapPath::on(disk, &folder), 0)?, output, map_id, progress)
}
