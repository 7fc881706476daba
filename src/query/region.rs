use crate::config::MapConfig;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::maths::logit;
use crate::space::{Aabb, BRICK_EDGE, Grid, TileBox, TileIndex, VoxelBox};
use crate::tile::{Tile, Voxel};

pub(super) fn evidence_in<'a, V: MapView + ?Sized>(
    view: &'a V,
    region: &Aabb,
) -> impl Iterator<Item = Result<Voxel>> + use<'a, V> {
    let (grid, region) = (view.config().grid, *region);
    let voxels = voxels_around(&grid, &region);
    tiles_in(view, &voxels).into_iter().flat_map(move |index| {
        let tile = match view.tile_uncached(index) {
            Ok(tile) => tile,
            Err(error) => return vec![Err(error)],
        };
        let inside = |tile: TileRef<'_>| {
            let voxels = voxels_in(&tile, &voxels);
            voxels.filter(|voxel| region.contains(grid.center_m(voxel.index))).map(Ok).collect()
        };
        tile.map_or(Vec::new(), inside)
    })
}

pub(super) fn for_each_voxel_in<V: MapView + ?Sized>(
    view: &V,
    region: &Aabb,
    mut visit: impl FnMut(Voxel),
) -> Result<()> {
    evidence_in(view, region).try_for_each(|voxel| {
        visit(voxel?);
        Ok(())
    })
}

pub(super) fn for_each_occupied(
    view: &impl MapView,
    min_probability: Option<f64>,
    region: Option<&Aabb>,
    mut visit: impl FnMut(Voxel),
) -> Result<()> {
    let threshold = min_log_odds(view.config(), min_probability);
    let mut visit_occupied = |voxel: Voxel| {
        if voxel.evidence.log_odds >= threshold {
            visit(voxel);
        }
    };
    match region {
        Some(region) => for_each_voxel_in(view, region, visit_occupied),
        None => view.tiles().try_for_each(|tile| {
            tile?.voxels().for_each(&mut visit_occupied);
            Ok(())
        }),
    }
}

pub(super) fn cached_occupied_voxels(
    view: &impl MapView,
    min_probability: Option<f64>,
) -> Result<Vec<Voxel>> {
    let threshold = min_log_odds(view.config(), min_probability);
    let mut voxels = Vec::new();
    for index in view.cached_tile_indices() {
        if let Some(tile) = view.tile_uncached(index)? {
            voxels.extend(tile.voxels().filter(|voxel| voxel.evidence.log_odds >= threshold));
        }
    }
    Ok(voxels)
}

/// Log-odds of the smallest probability; at 0 and below every observed voxel passes, above 1 none.
fn min_log_odds(config: &MapConfig, min_probability: Option<f64>) -> f64 {
    match min_probability {
        None => config.occupied_log_odds(),
        Some(probability) if probability <= 0.0 => f64::NEG_INFINITY,
        Some(probability) if probability >= 1.0 => f64::INFINITY,
        Some(probability) => logit(probability),
    }
}

/// The tiles of the map that overlap a box of voxels, in order.
pub(super) fn tiles_in<V: MapView + ?Sized>(view: &V, voxels: &VoxelBox) -> Vec<TileIndex> {
    /// Looking up so many is cheaper than listing all tiles of a large map.
    const MOST_LOOKED_UP: u64 = 4096;
    let Some(tiles) = tile_box_around(view, voxels) else { return Vec::new() };
    if tiles.count() <= MOST_LOOKED_UP {
        return tiles.tiles().filter(|&tile| view.has_tile(tile)).collect();
    }
    let mut all = view.tile_indices();
    all.retain(|&tile| tiles.contains(tile));
    all
}

/// The tiles, there or not, that overlap a box of voxels within the bounds of the map.
fn tile_box_around<V: MapView + ?Sized>(view: &V, voxels: &VoxelBox) -> Option<TileBox> {
    if voxels.is_empty() {
        return None;
    }
    let grid = &view.config().grid;
    let (first, last) = (voxels.min, voxels.end.map(|end| end - 1));
    let wanted = TileBox::new(grid.tile_of_voxel(first), grid.tile_of_voxel(last));
    view.tile_bounds()?.intersection(wanted)
}

/// The observed voxels of a tile that lie in a box, by brick.
pub(super) fn voxels_in(tile: &Tile, voxels: &VoxelBox) -> impl Iterator<Item = Voxel> {
    let bricks = tile.table().bricks().filter(move |&brick| {
        // A brick may extend beyond the tile: place it by a voxel inside.
        let Some(voxel) = tile.voxels_of_brick(brick).next() else { return false };
        let min = voxel.index.map(|k| k & !(BRICK_EDGE - 1));
        (0..3).all(|k| min[k] < voxels.end[k] && voxels.min[k].saturating_sub(BRICK_EDGE) < min[k])
    });
    bricks.flat_map(|brick| tile.voxels_of_brick(brick)).filter(|voxel| voxels.contains(voxel.index))
}

/// The voxels whose center may lie in a box, and a few around.
pub(crate) fn voxels_around(grid: &Grid, region: &Aabb) -> VoxelBox {
    // A margin for the few around; voxels have indices up to the ends.
    let to_index =
        |coordinate: f64| coordinate.floor().clamp(f64::from(i32::MIN + 1), f64::from(i32::MAX - 2)) as i32;
    VoxelBox {
        min: grid.to_voxel_units(region.min).map(|coordinate| to_index(coordinate) - 1),
        end: grid.to_voxel_units(region.max).map(|coordinate| to_index(coordinate) + 2),
    }
}
