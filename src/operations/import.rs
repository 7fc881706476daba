use super::map_writer::{MapWriter, WrittenMap};
use crate::config::Storage;
use crate::error::Result;
use crate::mapper::{MapView, OctreeMap};
use crate::store::MapPath;

/// Creates a map from a file of OctoMap: the same voxels with the same log-odds, observation counts of 0, and no scans.
///
/// Memory: the file's tree and one tile. The map appears only when it is complete, see [`MapWriter`]. `progress`
/// receives the number of tiles done and in total.
///
/// # Errors
///
/// An output with other content, or an I/O error.
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
