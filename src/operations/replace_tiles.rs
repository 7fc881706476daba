use super::map_editor::{MapEditor, edit};
use super::merge::{check_grid, check_layers, check_model, common_crs, have_no_common_tile};
use super::united_scans::{Part, add_united_scans};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::sensor::Evidence;
use crate::space::{MortonCode, TileIndex};
use crate::store::{Extension, InputContent, InputRecord, MapPath};
use crate::tile::Table;
use serde::Serialize;

/// Result of [`replace_tiles`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct TilesReplaced {
    /// Number of new tiles.
    pub tiles_added: u64,
    /// Number of replaced tiles.
    pub tiles_changed: u64,
    /// Number of tiles that are equal in the map and in the parts.
    pub tiles_equal: u64,
    /// Number of the map's last scan.
    pub scan_number: u64,
    /// Number of the flush that committed the tiles.
    pub flush_number: u64,
}

/// Replaces tiles of a map by those of parts, in one commit.
///
/// Each part is a crop of the map as of flush `of_flush`, into which more scans were inserted. No two parts have a tile
/// in common. `scans` is the number of these scans. A map that keeps its scans keeps them too, each once, as scans of an
/// input with the name `input`; another map gets no list of them. Tiles that no part has are unchanged. `progress`
/// receives the number of tiles done and in total.
///
/// # Errors
///
/// No map, another writer, a map that was flushed after `of_flush`, parts with another grid or sensor model or with a
/// common tile, a scan that no part keeps or that differs between parts, a damaged tile, or an I/O error. The map is unchanged then.
pub fn replace_tiles(
    map: impl Into<MapPath>,
    parts: &[MapReader],
    of_flush: u64,
    scans: u64,
    input: Option<&str>,
    mut progress: impl FnMut(u64, u64),
) -> Result<TilesReplaced> {
    let (disk, map) = map.into().into_parts();
    let map = &*map;
    let before = MapReader::open(MapPath::on(disk.clone(), map), 0)?;
    for part in parts {
        check_grid(part, &before)?;
        check_model(part, &before)?;
        check_layers(part, &before)?;
    }
    common_crs(parts.iter().chain([&before]))?;
    let keeps_scans = before.keeps_scans();
    if let Some(part) = parts.iter().find(|part| keeps_scans != part.keeps_scans()) {
        let reason =
            if keeps_scans { "keeps no scans, but the map does" } else { "keeps scans, unlike the map" };
        return Err(Error::argument(part.folder().display().to_string(), reason));
    }
    if !have_no_common_tile(parts) {
        return Err(Error::argument("parts", "two parts have the same tile; crop disjoint regions"));
    }
    edit(disk, map, |editor| {
        // The map is locked, so no other process can flush it after this check.
        let flush_number = editor.flush_number();
        if flush_number != of_flush {
            let reason = format!(
                "the map is at flush {flush_number}, but the parts are of flush {of_flush}: the map has changed \
                 meanwhile; create the parts again"
            );
            return Err(Error::argument("of_flush", reason));
        }
        let scans_before = editor.scan_number();
        editor.add_scans(scans)?;
        if keeps_scans {
            let (parts, region) = (parts.iter().map(Part::open).collect(), editor.config().rays.region);
            editor.keep_scans(|archive| add_united_scans(archive, parts, region, scans_before, scans))?;
        }
        let all = parts.iter().map(|part| part.tile_indices().len() as u64).sum();
        let mut replaced = TilesReplaced::default();
        let mut done = 0;
        for part in parts {
            for tile in part.tile_indices() {
                progress(done, all);
                done += 1;
                if let Some(found) = part.tile_uncached(tile)? {
                    replace_tile(editor, tile, found.table(), &mut replaced)?;
                }
            }
        }
        progress(all, all);
        if scans > 0 || replaced.tiles_added + replaced.tiles_changed > 0 {
            let note = |ext: &mut Extension| {
                ext.inputs.extend(input.map(|name| unknown_input(name, scans_before, scans)))
            };
            if keeps_scans { editor.commit_scans(note)? } else { editor.commit("adopt", |_| {})? }
        }
        (replaced.scan_number, replaced.flush_number) = (editor.scan_number(), editor.flush_number());
        Ok(replaced)
    })
}

/// Record of an input that cannot be resumed, because its fingerprint is unknown.
fn unknown_input(name: &str, first_scan: u64, scans: u64) -> InputRecord {
    let content = Some(InputContent { scans, ..InputContent::default() });
    InputRecord { first_scan, content, ..InputRecord::from(name.to_owned()) }
}

/// Writes a tile if it has changed. An equal tile is not written: its old version would have to be kept for readers and
/// snapshots.
fn replace_tile(
    editor: &mut MapEditor,
    tile: TileIndex,
    table: &Table,
    replaced: &mut TilesReplaced,
) -> Result<()> {
    if editor.version(tile).is_none() {
        replaced.tiles_added += 1;
    } else if is_same(&editor.table(tile)?, table) {
        replaced.tiles_equal += 1;
        return Ok(());
    } else {
        replaced.tiles_changed += 1;
    }
    editor.replace(tile, table)
}

/// Returns whether two tables have the same evidence, bit by bit, and the same layers.
fn is_same(a: &Table, b: &Table) -> bool {
    let bits = |(code, evidence): (MortonCode, Evidence)| {
        (code, evidence.log_odds.to_bits(), evidence.observation_count)
    };
    let are_layers_same = match (a.layers(), b.layers()) {
        (Some(a), Some(b)) => a.is_same(b),
        (a, b) => a.is_none() && b.is_none(),
    };
    are_layers_same && a.iter().map(bits).eq(b.iter().map(bits))
}
