use super::map_writer::{MapWriter, WrittenMap};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::store::{MapPath, hex, move_map};
use std::path::Path;

/// Makes a piece of a map to come: a copy of a map that nobody writes to, with the id that the other is to have.
///
/// Pieces of one id that have no tile in common become a map by [`join`](super::join()), which reads none of their
/// tiles. So it is here that every byte is compared with the map's log, and what this returns for is durable. No table
/// is decoded. Tiles say that they are of scan 0, for the map to come may number scans otherwise. `progress` is told
/// the tiles done and all.
///
/// # Errors
///
/// A map of the original format, a snapshot, a damaged tile, an output with other content, a disk that refuses; there
/// is no piece then.
pub fn make_piece(
    map: &MapReader,
    output: impl AsRef<Path>,
    map_id: [u8; 16],
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let mut metadata = map.metadata().clone();
    let Some(ext) = metadata.ext.as_mut().filter(|_| map.snapshot().is_none()) else {
        let reason =
            "a snapshot or of the original format; a piece is made of a map with checksums, as it is now";
        return Err(Error::argument(map.folder().display().to_string(), reason));
    };
    ext.map_id = hex(&map_id);
    let mut writer = MapWriter::create_as(map.disk(), output.as_ref(), metadata)?;
    writer.take_scans_of(map)?;
    let tiles = map.tile_indices();
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        writer.copy_as_of(tile, map, 0)?;
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    writer.finish()
}

/// Makes a map that is no longer needed where it is a piece of a map to come, as [`make_piece`] does, but by moving it:
/// no tile is read or written, and each file is synced once.
///
/// That needs a map with the id `map_id` and a place in the same file system. Nobody else has seen the map; it may have
/// been written without syncs ([`UnsyncedDisk`](crate::store::UnsyncedDisk)). Of its tiles' files the length is
/// compared with the log, and they go on to say of which of the map's scans they are. A map that cannot be moved is
/// copied, and every byte is compared; it stays where it is then.
///
/// # Errors
///
/// As for [`make_piece`], and a map that somebody writes to. There is no piece then, and the map may be gone.
pub fn move_piece(
    map: impl Into<MapPath>,
    output: impl AsRef<Path>,
    map_id: [u8; 16],
    progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let (disk, folder) = map.into().into_parts();
    let map = MapReader::open(MapPath::on(disk.clone(), &folder), 0)?;
    if map.map_id() != Some(map_id) || map.keeps_scans() {
        return make_piece(&map, output, map_id, progress);
    }
    let mut written = WrittenMap::default();
    let versions = map.tile_indices().into_iter().filter_map(|tile| map.version_of_tile(tile));
    versions.for_each(|version| written.add(version));
    drop(map);
    if move_map(&disk, &folder, output.as_ref())? {
        return Ok(written);
    }
    make_piece(&MapReader::open(MapPath::on(disk, &folder), 0)?, output, map_id, progress)
}
