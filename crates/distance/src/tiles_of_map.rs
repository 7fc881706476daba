use crate::extent::Extent;
use crate::observed::Observed;
use crate::options::DistanceOptions;
use crate::tile_voxels::TileVoxels;
use rayon::prelude::*;
use voxtile::mapper::MapView;
use voxtile::space::TileBox;
use voxtile::{Result, TileIndex};

/// The tiles of a map that overlap a box of voxels, in order.
pub(crate) fn tiles_in(map: &impl MapView, extent: &Extent) -> Vec<TileIndex> {
    /// Looking up this many tiles is cheaper than listing all tiles of a large map.
    const MAX_LOOKED_UP: u64 = 4096;
    let wanted = extent.tiles(&map.config().grid).map(|[min, max]| TileBox::new(min, max));
    let Some(tiles) = wanted.and_then(|wanted| map.tile_bounds()?.intersection(wanted)) else {
        return Vec::new();
    };
    if tiles.count() <= MAX_LOOKED_UP {
        return tiles.tiles().filter(|&tile| map.has_tile(tile)).collect();
    }
    map.tile_indices().into_iter().filter(|&tile| tiles.contains(tile)).collect()
}

/// Reads the voxels of a box from a map, on all cores.
///
/// # Errors
///
/// Fails if a tile cannot be read.
pub(crate) fn read_box(map: &impl MapView, extent: Extent, options: &DistanceOptions) -> Result<Observed> {
    /// Tiles that are in memory at the same time.
    const TOGETHER: usize = 64;
    let mut observed = Observed::new(extent, options);
    for tiles in tiles_in(map, &extent).chunks(TOGETHER) {
        let read: Vec<Result<TileVoxels>> =
            tiles.par_iter().map(|&tile| TileVoxels::read(map, tile, options.needs_known())).collect();
        for tile in read {
            tile?.add_to(&mut observed);
        }
    }
    Ok(observed)
}
