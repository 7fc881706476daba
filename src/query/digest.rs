use crate::error::Result;
use crate::mapper::MapView;
use crate::tile::Tile;
use crate::tile::format::encode_entries;
use std::convert::Infallible;

const LABEL: &[u8] = b"voxtile-digest-1";

pub(super) fn digest(view: &impl MapView) -> Result<blake3::Hash> {
    let grid = &view.config().grid;
    let mut hasher = blake3::Hasher::new();
    hasher.update(LABEL);
    hasher.update(&grid.resolution_m().to_bits().to_le_bytes());
    hasher.update(&grid.tile_size_m().to_bits().to_le_bytes());
    for tile in view.tiles() {
        let tile = tile?;
        if tile.table().is_empty() {
            continue;
        }
        for index in tile.index().to_array() {
            hasher.update(&index.to_le_bytes());
        }
        hasher.update(digest_of_tile(&tile).as_bytes());
    }
    Ok(hasher.finalize())
}

/// Over key, log-odds and count of every entry, as in `iwlo_meta.bin`.
fn digest_of_tile(tile: &Tile) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let Ok(()) = encode_entries(tile.table(), |entries| {
        hasher.update(entries);
        Ok::<(), Infallible>(())
    });
    hasher.finalize()
}
