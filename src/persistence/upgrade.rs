use super::load;
use super::map_id::new_map_id;
use super::tile_saver::TileSaver;
use crate::config::MapConfig;
use crate::error::Result;
use crate::store::{Metadata, TileStore};
use std::collections::BTreeSet;

/// Gives a map of the seed's format, before its first change, an id, a log and trailers: every tile is written anew as it
/// is, and committed with the metadata of that id. Until that is done it stays a map of the seed's format, with the same
/// content. Nothing to do for other maps.
pub(crate) fn upgrade(
    store: &mut TileStore,
    saver: &mut TileSaver,
    config: &MapConfig,
    metadata: impl FnOnce([u8; 16]) -> Metadata,
) -> Result<()> {
    if store.metadata().ext.is_some() {
        return Ok(());
    }
    log::info!("{}: a map of the seed's format; its tiles get checksums", store.folder().display());
    store.upgrade(new_map_id())?;
    for index in store.suspects() {
        // What an earlier attempt wrote of it cannot be trusted: it is written again from the tile's own file.
        store.drop_next(index);
    }
    for index in store.tiles().collect::<BTreeSet<_>>() {
        if store.version(index).is_some() {
            continue; // Written by an earlier attempt.
        }
        if let Some(read) = load::load_table(store, &config.grid, index)? {
            let version = saver.write(&store.writer()?, index, &read.table, 0)?;
            store.note_next(index, version);
        }
    }
    store.commit(metadata(store.map_id().unwrap_or_default()), 0)
}
