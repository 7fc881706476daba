use super::nearest_in_brick::Nearest;
use super::region::{BrickPart, tiles_of_list_in, voxels_around};
use super::{Hit, Occupancy};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Aabb, BRICK_EDGE, Grid, Point, TileBox, TileIndex, VoxelBox, VoxelIndex};
use crate::tile::{MarkedBlock, Table, Tile};

/// Radius of the first ball that is searched, in edges of a brick. The radius is doubled for each further ball.
const FIRST_BRICKS: f64 = 2.0;

pub(super) fn nearest_occupied<V: MapView + ?Sized>(
    view: &V,
    point: Point,
    max_distance_m: f64,
) -> Result<Option<Hit>> {
    check(point, max_distance_m)?;
    // Small balls first, so that a near voxel is found without examining the rest of the map.
    let grid = &view.config().grid;
    let brick_m = f64::from(BRICK_EDGE) * grid.resolution_m();
    // Limited to the distance of the farthest tile, because larger balls contain no more voxels.
    let Some(tiles) = view.tile_bounds() else { return Ok(None) };
    let max_distance_m = max_distance_m.min(distance_to_farthest_m(grid, &tiles, point));
    let radii_m = std::iter::successors(Some(FIRST_BRICKS * brick_m), |radius_m| Some(2.0 * radius_m));
    let mut all_tiles = None;
    for radius_m in radii_m.take_while(|radius_m| *radius_m < max_distance_m) {
        if let Some(nearest) = nearest_in_ball(view, point, radius_m, &mut all_tiles)? {
            return Ok(Some(nearest));
        }
    }
    nearest_in_ball(view, point, max_distance_m, &mut all_tiles)
}

/// Returns an upper bound of the distance between a point and the voxels in a box of tiles.
fn distance_to_farthest_m(grid: &Grid, tiles: &TileBox, point: Point) -> f64 {
    let [low, high] = [grid.voxels_of_tile(tiles.min()).min, grid.voxels_of_tile(tiles.max()).end];
    // A margin of one voxel for rounding.
    let border_m = |voxel: i32, margin: f64| (f64::from(voxel) + margin) * grid.resolution_m();
    let farthest_m = |k: usize| {
        let (low_m, high_m) = (border_m(low[k], -1.0), border_m(high[k], 1.0));
        (low_m - point[k]).abs().max((high_m - point[k]).abs())
    };
    (0..3).map(|k| farthest_m(k).powi(2)).sum::<f64>().sqrt()
}

/// Checks the arguments of a nearest-voxel query.
///
/// # Errors
///
/// Fails with [`Error::InvalidArgument`] if the point is not finite or the distance is invalid.
pub(super) fn check(point: Point, max_distance_m: f64) -> Result<()> {
    if max_distance_m >= 0.0 && point.iter().all(|coordinate| coordinate.is_finite()) {
        return Ok(());
    }
    Err(Error::argument("nearest occupied", "needs a finite point and a distance of at least 0 m"))
}

/// Blocks and bricks of a ball, nearest first; kept between tiles, so that they are allocated once.
#[derive(Default)]
struct NearestFirst {
    blocks: Vec<(f64, MarkedBlock)>,
    bricks: Vec<(f64, u32, VoxelIndex)>,
}

fn nearest_in_ball<V: MapView + ?Sized>(
    view: &V,
    point: Point,
    max_distance_m: f64,
    all_tiles: &mut Option<Vec<TileIndex>>,
) -> Result<Option<Hit>> {
    let config = view.config();
    let grid = config.grid;
    let mut nearest = Nearest::new(grid, point, config.occupied_log_odds(), max_distance_m);
    let around = |radius_m: f64| {
        voxels_around(&grid, &Aabb { min: point.map(|c| c - radius_m), max: point.map(|c| c + radius_m) })
    };
    let mut tiles: Vec<(f64, TileIndex)> = tiles_of_list_in(view, &around(max_distance_m), all_tiles)
        .into_iter()
        .map(|index| (nearest.least_square(&grid.voxels_of_tile(index)), index))
        .collect();
    tiles.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut nearest_first = NearestFirst::default();
    for (square, index) in tiles {
        if nearest.is_too_far(square) {
            break;
        }
        if let Some(tile) = view.tile(index)? {
            let around = around(nearest.limit_m()).intersection(&tile.voxel_box());
            nearest_first.look_at(&mut nearest, &tile, &around);
        }
    }
    let found = nearest.into_best();
    Ok(found.map(|(hit, evidence)| Hit {
        probability: Occupancy::of(config, Some(evidence)).probability(),
        ..hit
    }))
}

impl NearestFirst {
    /// Examines the voxels of a tile in a box around the ball.
    fn look_at(&mut self, nearest: &mut Nearest, tile: &Tile, around: &VoxelBox) {
        let (table, Self { blocks, bricks }) = (tile.table(), self);
        // Most bricks are free space and are skipped without examining their voxels.
        blocks.clear();
        let are_marked = table.visit_marked(around, nearest.threshold(), |block| {
            let square = nearest.least_square(&block.voxels());
            if !nearest.is_too_far(square) {
                blocks.push((square, block));
            }
        });
        if !are_marked {
            bricks.clear();
            bricks.extend(bricks_around(tile, around).filter_map(|brick| {
                Some((nearest.least_square(&brick.voxels), brick.number_in(tile)?, brick.voxels.min))
            }));
            return look_at_bricks(bricks, nearest, table);
        }
        blocks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for (square, block) in blocks {
            if nearest.is_too_far(*square) {
                break;
            }
            bricks.clear();
            nearest.for_each_brick(block, |square, place| {
                let number = table.number_in_block(block, place);
                bricks.extend(number.map(|number| (square, number, block.lowest_of(place))));
            });
            look_at_bricks(bricks, nearest, table);
        }
    }
}

/// Examines the voxels of bricks: lower bound of their squared distances, number, lowest voxel.
fn look_at_bricks(bricks: &mut [(f64, u32, VoxelIndex)], nearest: &mut Nearest, table: &Table) {
    bricks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    for &(square, number, lowest) in &*bricks {
        if nearest.is_too_far(square) {
            break;
        }
        if let Some(brick) = table.numbered(number) {
            nearest.look_at(brick, lowest);
        }
    }
}

/// Returns the bricks of a tile that may have voxels in a box, unclipped and in no particular order.
fn bricks_around(tile: &Tile, voxels: &VoxelBox) -> impl Iterator<Item = BrickPart> {
    let low = voxels.min.map(|k| k & !(BRICK_EDGE - 1));
    let along = move |k: usize| (low[k]..voxels.end[k]).step_by(BRICK_EDGE as usize);
    let edges: [usize; 3] = std::array::from_fn(|k| if voxels.is_empty() { 0 } else { along(k).count() });
    // A large ball may cover more brick positions than the tile has bricks. Then list the bricks of the tile.
    let is_large = edges.iter().product::<usize>() > tile.table().brick_count();
    let listed =
        is_large.then(|| tile.table().bricks().filter_map(|brick| tile.voxels_of_brick(brick).next()));
    let listed = listed.into_iter().flatten().map(|voxel| BrickPart::whole(voxel.index));
    let places = (!is_large && !voxels.is_empty())
        .then(|| along(0).flat_map(move |x| along(1).flat_map(move |y| along(2).map(move |z| [x, y, z]))));
    listed.chain(places.into_iter().flatten().map(BrickPart::whole))
}
