use super::load;
use super::map_id::new_map_id;
use super::tile_saver::TileSaver;
use crate::config::MapConfig;
use crate::error::Result;
use crate::store::{Metadata, TileStore};
use std::collections::BTreeSet;

/// Upgrades a map of the original format before its first change: adds an id and a log, rewrites every tile with a
/// trailer, and commits. Until then the map remains in the original format. Does nothing for other maps.
pub(crate) fn upgrade(
    store: &mut TileStore,
    saver: &mut TileSaver,
    config: &MapConfig,
    metadata: impl FnOnce([u8; 16]) -> Metadata,
) -> Result<()> {
    if store.metadata().ext.is_some() {
        return Ok(());
    }
    log::info!(
        "{}: upgrading a map of the original format; its tiles get checksums",
        store.folder().display()
    );
    let map_id = store.upgrade(new_map_id())?;
    for index in store.tiles().failed_syncs() {
        // An earlier sync of this version failed, so it is written again from the tile's own file.
        store.tiles_mut().drop_next(index);
    }
    for index in store.tiles().iter().collect::<BTreeSet<_>>() {
        if store.tiles().version(index).is_some() {
            continue; // Written by an earlier attempt.
        }
        if let Some(read) = load::load_table(store, &config.grid, index)? {
            let version = saver.write(&store.writer()?, index, &read.table, 0)?;
            store.tiles_mut().note_next(index, version);
        }
    }
    store.commit(metadata(map_id), 0)
}
