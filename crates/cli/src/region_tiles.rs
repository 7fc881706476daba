//! The tiles of a region that a map is built of.

use crate::part::region_of;
use voxtile::space::{Grid, TileBox};
use voxtile::{Error, Result};

/// The tiles of a `--region`.
pub fn tiles_of(corners: &[f64], grid: &Grid) -> Result<TileBox> {
    let region = region_of(corners)?;
    TileBox::with_centers_in(&region, grid).ok_or_else(|| {
        let reason = format!(
            "no tile has its center in {region}; tiles are {} m long, and a region is made of whole ones",
            grid.tile_size_m()
        );
        Error::argument("--region", reason)
    })
}

/// The tiles in metres; what reaches beyond all voxels is infinite.
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
