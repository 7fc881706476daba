use super::Occupancy;
use super::tile_cursor::TileCursor;
use crate::error::Result;
use crate::mapper::MapView;
use crate::space::{Point, VoxelIndex};
use crate::tile::Voxel;

#[inline]
pub(super) fn voxel_at(view: &impl MapView, point: Point) -> Result<Option<Voxel>> {
    let grid = &view.config().grid;
    let Some(index) = grid.voxel_of(point) else { return Ok(None) };
    Ok(view.evidence(index)?.map(|evidence| Voxel { index, evidence }))
}

pub(super) fn occupancy_at_points(view: &impl MapView, points: &[Point]) -> Result<Vec<Occupancy>> {
    let config = view.config();
    let mut answers = vec![Occupancy::Unknown; points.len()];
    let voxels =
        points.iter().enumerate().filter_map(|(number, &point)| Some((config.grid.voxel_of(point)?, number)));
    let mut by_tile: Vec<(VoxelIndex, usize)> = voxels.collect();
    by_tile.sort_unstable_by_key(|&(voxel, number)| (config.grid.tile_of_voxel(voxel), number));
    let mut tiles = TileCursor::new(view);
    for (voxel, number) in by_tile {
        let evidence = tiles.tile_of(voxel)?.and_then(|tile| tile.evidence(voxel));
        answers[number] = Occupancy::of(config, evidence);
    }
    Ok(answers)
}
