use voxtile::space::{Aabb, Grid, TileBox};
use voxtile::{Error, Result};

/// Returns the tiles with their center in a region.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if there are none.
pub fn tiles_of(region: &Aabb, grid: &Grid) -> Result<TileBox> {
    TileBox::with_centers_in(region, grid).ok_or_else(|| {
        let reason = format!(
            "no tile has its center in {region}; tiles have an edge of {} m, and a region consists of whole tiles",
            grid.tile_size_m()
        );
        Error::argument("region", reason)
    })
}
