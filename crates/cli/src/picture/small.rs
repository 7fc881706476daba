use super::path_of;
use crate::terminal::{self, Protocol};
use std::io::Write;
use voxtile::mapper::MapView;
use voxtile_pipeline::AnyMap;
use voxtile_render::Picture;

/// Characters of a small picture, in columns and rows.
const SIZE: [usize; 2] = [60, 20];
/// Maps of more tiles or voxels take longer to read than somebody waits for a few lines.
const MAX_TILES: usize = 2000;
const MAX_VOXELS: u64 = 40_000_000;

/// Whether a map is drawn in about a second.
pub fn is_quick(map: &AnyMap) -> bool {
    let tiles = map.tile_indices();
    let voxels: u64 = tiles.iter().filter_map(|&tile| map.voxels_of_tile_hint(tile)).sum();
    (1..=MAX_TILES).contains(&tiles.len()) && voxels <= MAX_VOXELS
}

/// Draws a map from above, in a few lines of half blocks.
pub fn print_small(map: &AnyMap, out: &mut impl Write) -> anyhow::Result<()> {
    let picture = Picture::new().with_size_px([SIZE[0], 2 * SIZE[1]]).with_legend(false).with_grid(false);
    let drawn = picture.with_path(path_of(map)).draw(map, |_, _| {})?;
    writeln!(out)?;
    terminal::write(&drawn.image, Protocol::blocks_of_environment(), out)
}
