use super::map_writer::{MapWriter, WrittenMap};
use crate::config::Storage;
use crate::error::Result;
use crate::mapper::{MapView, OctreeMap};
use crate::store::MapPath;

/// Makes a map of a file of OctoMap: the same voxels with the same log-odds, no observation counts (0), no scans.
///
/// In memory are the file's tree and one tile. The map is there as a whole or not at all, see [`MapWriter`]. `progress`
/// is told the tiles done and all.
///
/// # Errors
///
/// An output with other content, a disk that refuses.
pub fn import(
    map: &OctreeMap,
    output: impl Into<MapPath>,
    storage: Storage,
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let mut writer = MapWriter::create(output, &map.config().clone().with_storage(storage))?;
    let tiles = map.tile_indices();
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        writer.put(tile, &map.table_of(tile))?;
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    writer.finish()
}
