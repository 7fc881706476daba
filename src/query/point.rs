use super::Occupancy;
use crate::error::Result;
use crate::mapper::{MapView, TileRef};
use crate::space::{Point, TileIndex};
use crate::tile::Voxel;

pub(super) fn voxel_at(view: &impl MapView, point: Point) -> Result<Option<Voxel>> {
    let grid = &view.config().grid;
    let Some(index) = grid.voxel_of(point) else { return Ok(None) };
    let tile = view.tile(grid.tile_of_voxel(index))?;
    Ok(tile.and_then(|tile| tile.evidence(index)).map(|evidence| Voxel { index, evidence }))
}

pub(super) fn occupancy_at_points(view: &impl MapView, points: &[Point]) -> Result<Vec<Occupancy>> {
    let config = view.config();
    let mut answers = vec![Occupancy::Unknown; points.len()];
    let voxel_of = |number: usize| config.grid.voxel_of(points[number]);
    let tile_of = |number: usize| voxel_of(number).map(|voxel| (config.grid.tile_of_voxel(voxel), number));
    let mut by_tile: Vec<(TileIndex, usize)> = (0..points.len()).filter_map(tile_of).collect();
    by_tile.sort_unstable();
    let mut tile: Option<(TileIndex, Option<TileRef<'_>>)> = None;
    for (index, number) in by_tile {
        if tile.as_ref().is_none_or(|(current, _)| *current != index) {
            // Let go of the one before first, so that it can be pushed out.
            drop(tile.take());
            tile = Some((index, view.tile(index)?));
        }
        if let (Some((_, Some(tile))), Some(voxel)) = (&tile, voxel_of(number)) {
            answers[number] = Occupancy::of(config, tile.evidence(voxel));
        }
    }
    Ok(answers)
}
