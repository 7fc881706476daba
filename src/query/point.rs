use super::Occupancy;
use super::queries::on_all_cores;
use super::tile_cursor::TileCursor;
use crate::error::Result;
use crate::mapper::MapView;
use crate::space::{Point, VoxelIndex};
use crate::tile::Voxel;

#[inline]
pub(super) fn voxel_at<V: MapView + ?Sized>(view: &V, point: Point) -> Result<Option<Voxel>> {
    let grid = &view.config().grid;
    let Some(index) = grid.voxel_of(point) else { return Ok(None) };
    Ok(view.evidence(index)?.map(|evidence| Voxel { index, evidence }))
}

/// Points that are answered by one core at a time.
const POINTS_AT_A_TIME: usize = 4096;

/// Each tile is loaded once, or once for so many of its points.
pub(super) fn occupancy_at_points<V: MapView>(view: &V, points: &[Point]) -> Result<Vec<Occupancy>> {
    let config = view.config();
    let voxels =
        points.iter().enumerate().filter_map(|(number, &point)| Some((config.grid.voxel_of(point)?, number)));
    let mut by_tile: Vec<(VoxelIndex, usize)> = voxels.collect();
    by_tile.sort_unstable_by_key(|&(voxel, number)| (config.grid.tile_of_voxel(voxel), number));
    let chunks: Vec<&[(VoxelIndex, usize)]> = by_tile.chunks(POINTS_AT_A_TIME).collect();
    let answered = on_all_cores(&chunks, |chunk| {
        let mut tiles = TileCursor::new(view);
        let answer = |&(voxel, number): &(VoxelIndex, usize)| {
            let evidence = tiles.tile_of(voxel)?.and_then(|tile| tile.evidence(voxel));
            Ok((number, Occupancy::of(config, evidence)))
        };
        chunk.iter().map(answer).collect::<Result<Vec<_>>>()
    })?;
    let mut answers = vec![Occupancy::Unknown; points.len()];
    for (number, occupancy) in answered.into_iter().flatten() {
        answers[number] = occupancy;
    }
    Ok(answers)
}
