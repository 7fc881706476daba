use super::map_editor::{MapEditor, edit};
use super::part::{Part, Share, VoxelPart};
use super::table_change::voxels_of_part;
use crate::error::Result;
use crate::space::TileIndex;
use crate::store::MapPath;
use serde::Serialize;

/// Result of [`clear`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Cleared {
    /// Number of voxels that became unknown.
    pub voxels_cleared: u64,
    /// Number of tiles that lost some of their voxels.
    pub tiles_changed: u64,
    /// Number of tiles that lost all voxels and were removed from the map.
    pub tiles_removed: u64,
    /// Number of tiles in the map now.
    pub tiles: u64,
}

/// Makes the voxels in a part of space unknown, in place and in one commit.
///
/// A tile that is entirely in the part is not read. `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// No map, another writer, an invalid box, a damaged tile, or an I/O error. The map is unchanged then.
pub fn clear(map: impl Into<MapPath>, part: &Part, mut progress: impl FnMut(u64, u64)) -> Result<Cleared> {
    let (disk, map) = map.into().into_parts();
    let map = &*map;
    edit(disk, map, |editor| {
        let grid = editor.config().grid;
        let part = part.voxels(&grid)?;
        let mut tiles = editor.tiles();
        let all = tiles.len() as u64;
        tiles.retain(|&tile| part.share_of(&grid.voxels_of_tile(tile)) != Share::Nothing);
        let mut cleared = Cleared::default();
        for (done, &tile) in (0..).zip(&tiles) {
            progress(done, tiles.len() as u64);
            clear_tile(editor, tile, &part, &mut cleared)?;
        }
        progress(tiles.len() as u64, tiles.len() as u64);
        cleared.tiles = all - cleared.tiles_removed;
        if cleared.tiles_changed + cleared.tiles_removed > 0 {
            editor.commit("clear", |_| {})?;
        }
        Ok(cleared)
    })
}

fn clear_tile(
    editor: &mut MapEditor,
    tile: TileIndex,
    part: &VoxelPart,
    cleared: &mut Cleared,
) -> Result<()> {
    let voxels = editor.config().grid.voxels_of_tile(tile);
    if part.share_of(&voxels) == Share::Everything
        && let Some(version) = editor.version(tile)
    {
        cleared.voxels_cleared += version.voxels;
        cleared.tiles_removed += 1;
        return editor.remove(tile);
    }
    let before = editor.table(tile)?;
    let after = voxels_of_part(&before, &voxels, &part.rest());
    if after.len() == before.len() {
        return Ok(());
    }
    cleared.voxels_cleared += (before.len() - after.len()) as u64;
    *(if after.is_empty() { &mut cleared.tiles_removed } else { &mut cleared.tiles_changed }) += 1;
    drop(before);
    editor.replace(tile, &after)
}
