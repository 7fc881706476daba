use super::map_editor::{MapEditor, edit};
use super::merge::{check_grid, check_model, common_crs, have_no_common_tile};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::sensor::Evidence;
use crate::space::{MortonCode, TileIndex};
use crate::store::MapPath;
use crate::tile::Table;
use serde::Serialize;

/// What a map took from its parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Adopted {
    /// Tiles that the map did not have before.
    pub tiles_added: u64,
    /// Tiles that are others now.
    pub tiles_changed: u64,
    /// Tiles of the parts that are in the map as they were.
    pub tiles_equal: u64,
    /// Number of the map's last scan.
    pub scan_number: u64,
    /// Number of the flush that made all of this durable.
    pub flush_number: u64,
}

/// Puts the tiles of parts in the place of a map's own, in one commit: readers see all of it, or nothing.
///
/// Parts are made of the map as of the flush `of_flush`, each with other tiles: a crop of the map that took more scans.
/// `scans` says how many scans the map has more, then; it does not get their list. Tiles that no part has stay.
/// `progress` is told the tiles done and all.
///
/// # Errors
///
/// No map there, another writer, a map that was flushed since `of_flush`, a map that keeps its scans, parts of another
/// grid or model or with a common tile, a damaged tile, a disk that refuses; the map is as before then.
pub fn adopt(
    map: impl Into<MapPath>,
    parts: &[MapReader],
    of_flush: u64,
    scans: u64,
    mut progress: impl FnMut(u64, u64),
) -> Result<Adopted> {
    let (disk, map) = map.into().into_parts();
    let map = &*map;
    let before = MapReader::open(MapPath::on(disk.clone(), map), 0)?;
    for part in parts {
        check_grid(part, &before)?;
        check_model(part, &before)?;
    }
    common_crs(parts.iter().chain([&before]))?;
    if before.keeps_scans() {
        let reason = "the map keeps its scans, and the tiles of parts come without theirs; use `voxtile build --append`";
        return Err(Error::argument(map.display().to_string(), reason));
    }
    if !have_no_common_tile(parts) {
        return Err(Error::argument("parts", "two of them have the same tile; make parts of other regions"));
    }
    edit(disk, map, |editor| {
        // Under the map's lock: what was flushed before it was taken is seen here.
        let flush_number = editor.flush_number();
        if flush_number != of_flush {
            let reason = format!(
                "the map is at flush {flush_number}, and the parts are of flush {of_flush}: somebody has changed it \
                 meanwhile; make the parts again"
            );
            return Err(Error::argument("of_flush", reason));
        }
        editor.add_scans(scans)?;
        let all = parts.iter().map(|part| part.tile_indices().len() as u64).sum();
        let mut adopted = Adopted::default();
        let mut done = 0;
        for part in parts {
            for tile in part.tile_indices() {
                progress(done, all);
                done += 1;
                if let Some(found) = part.tile_uncached(tile)? {
                    adopt_tile(editor, tile, found.table(), &mut adopted)?;
                }
            }
        }
        progress(all, all);
        if scans > 0 || adopted.tiles_added + adopted.tiles_changed > 0 {
            editor.commit("adopt", |_| {})?;
        }
        (adopted.scan_number, adopted.flush_number) = (editor.scan_number(), editor.flush_number());
        Ok(adopted)
    })
}

/// A tile that is as it was is not written: readers and snapshots need no copy of it.
fn adopt_tile(editor: &mut MapEditor, tile: TileIndex, table: &Table, adopted: &mut Adopted) -> Result<()> {
    if editor.version(tile).is_none() {
        adopted.tiles_added += 1;
    } else if is_same(&editor.table(tile)?, table) {
        adopted.tiles_equal += 1;
        return Ok(());
    } else {
        adopted.tiles_changed += 1;
    }
    editor.replace(tile, table)
}

/// Whether two tables have the same evidence, to the bit.
fn is_same(a: &Table, b: &Table) -> bool {
    let bits = |(code, evidence): (MortonCode, Evidence)| {
        (code, evidence.log_odds.to_bits(), evidence.observation_count)
    };
    a.iter().map(bits).eq(b.iter().map(bits))
}
