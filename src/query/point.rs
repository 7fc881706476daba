use super::Occupancy;
use super::points_by_tile::PointsByTile;
use super::queries::on_all_cores;
use crate::error::Result;
use crate::mapper::MapView;
use crate::sensor::Evidence;
use crate::space::{Point, TileIndex};
use crate::tile::Voxel;

#[inline]
pub(super) fn voxel_at<V: MapView + ?Sized>(view: &V, point: Point) -> Result<Option<Voxel>> {
    let grid = &view.config().grid;
    let Some(index) = grid.voxel_of(point) else { return Ok(None) };
    Ok(view.evidence(index)?.map(|evidence| Voxel { index, evidence }))
}

/// Points that are answered by one core at a time.
const POINTS_AT_A_TIME: usize = 4096;

/// What each of many points is answered, from the evidence of its voxel. Each tile is loaded once for so many of its
/// points.
fn at_points<V: MapView, A: Copy + Send>(
    view: &V,
    points: &[Point],
    unknown: A,
    answer: impl Fn(Evidence) -> A + Sync,
) -> Result<Vec<A>> {
    let grid = view.config().grid;
    let mut answers = vec![unknown; points.len()];
    for (points, answers) in
        points.chunks(PointsByTile::MOST_POINTS).zip(answers.chunks_mut(PointsByTile::MOST_POINTS))
    {
        let by_tile = PointsByTile::of(&grid, points);
        let chunks: Vec<(TileIndex, &[u32])> = by_tile.chunks(POINTS_AT_A_TIME).collect();
        let answered = on_all_cores(&chunks, |&(tile, numbers)| {
            let Some(tile) = view.tile(tile)? else { return Ok(Vec::new()) };
            let evidence = |number: u32| tile.evidence(grid.voxel_of(points[number as usize])?);
            Ok(numbers.iter().map(|&number| evidence(number).map(&answer)).collect::<Vec<_>>())
        })?;
        for (&(_, numbers), answered) in chunks.iter().zip(answered) {
            for (&number, answer) in numbers.iter().zip(answered) {
                answers[number as usize] = answer.unwrap_or(unknown);
            }
        }
    }
    Ok(answers)
}

pub(super) fn occupancy_at_points<V: MapView>(view: &V, points: &[Point]) -> Result<Vec<Occupancy>> {
    let config = view.config();
    at_points(view, points, Occupancy::Unknown, |evidence| Occupancy::of(config, Some(evidence)))
}

pub(super) fn evidence_at_points<V: MapView>(view: &V, points: &[Point]) -> Result<Vec<Option<Evidence>>> {
    at_points(view, points, None, Some)
}
