//! Text for the tile region of a map.

use voxtile::space::{Grid, TileBox};

/// Formats the tiles in metres. Bounds beyond the last possible voxel print as infinite.
pub fn text(tiles: TileBox, grid: &Grid) -> String {
    let (min, max) = (tiles.min().to_array(), tiles.max().to_array());
    let edge = i64::from(grid.voxels_per_tile_edge());
    let corner = |tile: i64| match i32::try_from(tile * edge) {
        Ok(voxel) => grid.corner_m(voxel),
        Err(_) => f64::INFINITY.copysign(tile as f64),
    };
    let along = |k: usize, axis: char| {
        format!("{axis} {} to {}", corner(i64::from(min[k])), corner(i64::from(max[k]) + 1))
    };
    format!("whole tiles: {}, {}, {} m", along(0, 'x'), along(1, 'y'), along(2, 'z'))
}
