use super::filtered_tiles::for_each_from;
use super::ray::brick_of;
use crate::config::MapConfig;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::maths::least_logit;
use crate::space::{
    Aabb, BRICK_EDGE, BrickCode, BrickMask, Grid, TileBox, TileIndex, VoxelBox, VoxelIndex, mask_of_box,
};
use crate::tile::{BrickView, Tile, Voxel};

/// A question about a box in at most this many tiles keeps them in memory, because the next box is probably near. Larger
/// boxes are for exports.
const MAX_KEPT_TILES: usize = 8;

/// Returns a tile of a box that has so many tiles.
fn tile_of_box<V: MapView + ?Sized>(view: &V, index: TileIndex, tiles: usize) -> Result<Option<TileRef<'_>>> {
    if tiles <= MAX_KEPT_TILES { view.tile(index) } else { view.tile_uncached(index) }
}

pub(super) fn evidence_in<'a, V: MapView + ?Sized>(
    view: &'a V,
    region: &Aabb,
) -> impl Iterator<Item = Result<Voxel>> + use<'a, V> {
    let voxels = view.config().grid.voxels_in(region);
    let tiles = tiles_in(view, &voxels);
    let count = tiles.len();
    tiles.into_iter().flat_map(move |index| {
        let tile = match tile_of_box(view, index, count) {
            Ok(tile) => tile,
            Err(error) => return vec![Err(error)],
        };
        tile.map_or(Vec::new(), |tile| voxels_in(&tile, &voxels).map(Ok).collect())
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
    let Some(region) = region else {
        return for_each_from(view, &view.tile_indices(), threshold, &mut visit, |index, visit| {
            let tile = view.tile_uncached(index)?;
            tile.into_iter().for_each(|tile| tile.voxels_from(threshold).for_each(&mut *visit));
            Ok(())
        });
    };
    let voxels = view.config().grid.voxels_in(region);
    let tiles = tiles_in(view, &voxels);
    let visit_tile = |index: TileIndex, visit: &mut dyn FnMut(Voxel)| {
        let Some(tile) = tile_of_box(view, index, tiles.len())? else { return Ok(()) };
        let bricks = bricks_in(&tile, &voxels).filter(|brick| brick.may_hold(&tile, threshold));
        bricks.flat_map(|brick| brick.voxels_from(&tile, threshold)).for_each(visit);
        Ok(())
    };
    if tiles.len() <= MAX_KEPT_TILES {
        return tiles.iter().try_for_each(|&index| visit_tile(index, &mut visit));
    }
    let mut visit_inside = |voxel: Voxel| {
        if voxels.contains(voxel.index) {
            visit(voxel);
        }
    };
    for_each_from(view, &tiles, threshold, &mut visit_inside, |index, visit| visit_tile(index, visit))
}

pub(super) fn cached_occupied_voxels(
    view: &impl MapView,
    min_probability: Option<f64>,
) -> Result<Vec<Voxel>> {
    let threshold = min_log_odds(view.config(), min_probability);
    let mut voxels = Vec::new();
    for index in view.cached_tile_indices() {
        if let Some(tile) = view.tile_uncached(index)? {
            voxels.extend(tile.voxels_from(threshold));
        }
    }
    Ok(voxels)
}

/// Converts the minimum probability to log-odds; at 0 and below all observed voxels pass, above 1 none.
fn min_log_odds(config: &MapConfig, min_probability: Option<f64>) -> f64 {
    match min_probability {
        None => config.occupied_log_odds(),
        Some(probability) if probability <= 0.0 => f64::NEG_INFINITY,
        Some(probability) if probability >= 1.0 => f64::INFINITY,
        Some(probability) => least_logit(probability),
    }
}

/// The tiles of the map that overlap a box of voxels, in order.
pub(super) fn tiles_in<V: MapView + ?Sized>(view: &V, voxels: &VoxelBox) -> Vec<TileIndex> {
    tiles_of_list_in(view, voxels, &mut None)
}

/// Like [`tiles_in`], for several boxes: if the tiles of the map have to be listed, the list is stored in `all` for
/// reuse.
pub(super) fn tiles_of_list_in<V: MapView + ?Sized>(
    view: &V,
    voxels: &VoxelBox,
    all: &mut Option<Vec<TileIndex>>,
) -> Vec<TileIndex> {
    /// Looking up this many tiles is cheaper than listing all tiles of a large map.
    const MAX_LOOKED_UP: u64 = 4096;
    let Some(tiles) = tile_box_around(view, voxels) else { return Vec::new() };
    if tiles.count() <= MAX_LOOKED_UP {
        return tiles.tiles().filter(|&tile| view.has_tile(tile)).collect();
    }
    let all = all.get_or_insert_with(|| view.tile_indices());
    all.iter().copied().filter(|&tile| tiles.contains(tile)).collect()
}

/// Returns the smallest box of tiles around a box of voxels, within the bounds of the map. Some of the tiles may be
/// missing.
fn tile_box_around<V: MapView + ?Sized>(view: &V, voxels: &VoxelBox) -> Option<TileBox> {
    if voxels.is_empty() {
        return None;
    }
    let grid = &view.config().grid;
    let (first, last) = (voxels.min, voxels.end.map(|end| end - 1));
    let wanted = TileBox::new(grid.tile_of_voxel(first), grid.tile_of_voxel(last));
    view.tile_bounds()?.intersection(wanted)
}

/// The observed voxels of a tile within a box, in Morton order.
pub(super) fn voxels_in(tile: &Tile, voxels: &VoxelBox) -> impl Iterator<Item = Voxel> {
    bricks_in(tile, voxels).flat_map(move |brick| brick.voxels_from(tile, f64::NEG_INFINITY))
}

/// Brick of a tile, restricted to its voxels in a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct BrickPart {
    code: BrickCode,
    /// All voxels of the brick, including those outside the box and the tile.
    pub(super) voxels: VoxelBox,
    mask: BrickMask,
}

impl BrickPart {
    /// Creates a whole brick from its lowest voxel.
    pub(super) fn whole(lowest: VoxelIndex) -> Self {
        Self { code: BrickCode::of_voxel(lowest), voxels: brick_of(lowest), mask: [u64::MAX; 8] }
    }

    fn of(voxel: VoxelIndex, within: &VoxelBox) -> Self {
        let part = Self { code: BrickCode::of_voxel(voxel), voxels: brick_of(voxel), mask: [u64::MAX; 8] };
        Self { mask: part.mask_in(within), ..part }
    }

    /// Mask of the brick's voxels in a box.
    pub(super) fn mask_in(&self, within: &VoxelBox) -> BrickMask {
        let local = |corner: VoxelIndex| {
            std::array::from_fn(|k| corner[k].saturating_sub(self.voxels.min[k]).clamp(0, BRICK_EDGE))
        };
        mask_of_box(local(within.min), local(within.end))
    }

    /// Returns whether there may be voxels whose log-odds are at least a threshold.
    pub(super) fn may_hold(&self, tile: &Tile, threshold: f64) -> bool {
        self.look(tile).is_some_and(|brick| !brick.is_below(threshold))
    }

    /// The observed voxels whose log-odds are at least a threshold, in Morton order.
    pub(super) fn voxels_from(self, tile: &Tile, threshold: f64) -> impl Iterator<Item = Voxel> {
        let mut mask = self.mask;
        if threshold > f64::NEG_INFINITY
            && let Some(brick) = self.look(tile)
        {
            let from_threshold = brick.mask_from(threshold);
            mask.iter_mut().zip(from_threshold).for_each(|(word, wanted)| *word &= wanted);
        }
        let found = tile.table().voxels_of_mask(self.code, mask);
        found.map(|(code, evidence)| Voxel { index: tile.index_of(code), evidence })
    }

    pub(super) fn look<'a>(&self, tile: &'a Tile) -> Option<BrickView<'a>> {
        self.number_in(tile).and_then(|number| tile.table().numbered(number))
    }

    /// Number of the brick in the tile's table.
    pub(super) fn number_in(&self, tile: &Tile) -> Option<u32> {
        tile.table().number_of_brick(self.code)
    }
}

/// The bricks of a tile that may have voxels in a box, in Morton order.
pub(super) fn bricks_in(tile: &Tile, voxels: &VoxelBox) -> impl Iterator<Item = BrickPart> {
    let within = tile.voxel_box().intersection(voxels);
    let corners: [Vec<i32>; 3] = std::array::from_fn(|k| {
        let first = within.min[k] & !(BRICK_EDGE - 1);
        (first..within.end[k]).step_by(BRICK_EDGE as usize).collect()
    });
    let count = corners.iter().map(|corners| corners.len()).product::<usize>();
    let mut parts: Vec<BrickPart> = if count <= tile.table().brick_count() {
        let [x, y, z] = &corners;
        let corners = x.iter().flat_map(|x| y.iter().flat_map(move |y| z.iter().map(move |z| [*x, *y, *z])));
        let parts = corners.map(|corner| {
            // A brick may extend beyond the tile, so it is identified by a voxel inside.
            let inside = std::array::from_fn(|k| corner[k].max(within.min[k]));
            BrickPart::of(inside, &within)
        });
        parts.filter(|part| tile.table().has_brick(part.code)).collect()
    } else {
        let firsts = tile.table().bricks().filter_map(|brick| tile.voxels_of_brick(brick).next());
        let parts = firsts.map(|voxel| BrickPart::of(voxel.index, &within));
        parts.filter(|part| part.mask != [0; 8]).collect()
    };
    parts.sort_unstable_by_key(|part| part.code);
    parts.into_iter()
}

/// The voxels whose center may be in a box, and a few around them.
pub fn voxels_around(grid: &Grid, region: &Aabb) -> VoxelBox {
    // A margin of one or two voxels allows for rounding. Indices are limited to the range of `i32`.
    let to_index =
        |coordinate: f64| coordinate.floor().clamp(f64::from(i32::MIN + 1), f64::from(i32::MAX - 2)) as i32;
    VoxelBox {
        min: grid.to_voxel_units(region.min).map(|coordinate| to_index(coordinate) - 1),
        end: grid.to_voxel_units(region.max).map(|coordinate| to_index(coordinate) + 2),
    }
}
