use super::Occupancy;
use super::points_by_tile::PointsByTile;
use crate::error::Result;
use crate::mapper::MapView;
use crate::sensor::Evidence;
use crate::space::{Grid, Point, TileIndex, VoxelKey};
use crate::tile::{Tile, Voxel, VoxelBatch};
use rayon::prelude::*;

#[inline]
pub(super) fn voxel_at<V: MapView + ?Sized>(view: &V, point: Point) -> Result<Option<Voxel>> {
    let grid = &view.config().grid;
    let Some(index) = grid.voxel_of(point) else { return Ok(None) };
    Ok(view.evidence(index)?.map(|evidence| Voxel { index, evidence }))
}

/// Number of points that one core processes at a time.
const POINTS_AT_A_TIME: usize = 4096;

/// Number of points that are grouped by tile before tiles are loaded.
const MAX_GROUPED: usize = 1 << 22;

/// Returns the results for many points, computed from the evidence of their voxels; each core creates an `answer`
/// function for some of them.
fn at_points<V: MapView, A: Copy + Send + Sync, F: FnMut(Evidence) -> A>(
    view: &V,
    points: &[Point],
    unknown: A,
    answer: impl Fn() -> F + Sync,
) -> Result<Vec<A>> {
    let mut answers = vec![unknown; points.len()];
    if view.resident_tile(TileIndex::default()).is_some() {
        let chunks = points.par_chunks(POINTS_AT_A_TIME).zip(answers.par_chunks_mut(POINTS_AT_A_TIME));
        chunks.for_each(|(points, answers)| in_memory(view, points, answers, answer()));
        return Ok(answers);
    }
    for (points, answers) in points.chunks(MAX_GROUPED).zip(answers.chunks_mut(MAX_GROUPED)) {
        by_tile(view, points, answers, &answer)?;
    }
    Ok(answers)
}

/// Processes points in their order if all tiles are in memory.
fn in_memory<V: MapView, A>(
    view: &V,
    points: &[Point],
    answers: &mut [A],
    mut answer: impl FnMut(Evidence) -> A,
) {
    let grid = view.config().grid;
    let mut voxels = VoxelBatch::new();
    for (points, answers) in
        points.chunks(VoxelBatch::MAX_VOXELS).zip(answers.chunks_mut(VoxelBatch::MAX_VOXELS))
    {
        let mut places = [0_u8; VoxelBatch::MAX_VOXELS];
        let mut count = 0;
        for (place, &point) in points.iter().enumerate() {
            let Some(voxel) = grid.voxel_of(point) else { continue };
            let Some(tile) = view.resident_tile(grid.tile_of_voxel(voxel)) else { continue };
            voxels.push(tile.table(), VoxelKey::from_index(voxel));
            places[count] = place as u8;
            count += 1;
        }
        let mut places = places.iter();
        voxels.take(|evidence| {
            if let (Some(&place), Some(evidence)) = (places.next(), evidence) {
                answers[usize::from(place)] = answer(evidence);
            }
        });
    }
}

/// Some of a tile's points, consecutive in the order of one group.
struct PartOfTile<'a, A> {
    tile: TileIndex,
    group: &'a PointsByTile,
    /// Points of the group.
    points: &'a [Point],
    /// Number of points before the group.
    before: usize,
    /// Position of the part's first point in the group's order.
    first: usize,
    /// Results of the part, in the group's order.
    answers: &'a mut [A],
}

/// Processes points tile by tile: each tile is loaded once per group of parts.
fn by_tile<V: MapView, A: Copy + Send + Sync, F: FnMut(Evidence) -> A>(
    view: &V,
    points: &[Point],
    answers: &mut [A],
    answer: impl Fn() -> F + Sync,
) -> Result<()> {
    /// Number of parts of a tile that one core processes at a time.
    const PARTS_AT_A_TIME: usize = 8;
    const OF_GROUP: usize = PointsByTile::MAX_POINTS;
    let grid = view.config().grid;
    let groups: Vec<PointsByTile> =
        points.par_chunks(OF_GROUP).map(|points| PointsByTile::of(&grid, points)).collect();
    let of_groups = groups.iter().zip(points.chunks(OF_GROUP)).zip(answers.chunks_mut(OF_GROUP));
    let mut parts: Vec<PartOfTile<'_, A>> = Vec::new();
    for (number, ((group, points), mut answers)) in of_groups.enumerate() {
        let mut first = 0;
        for &(tile, count) in group.tiles() {
            let of_tile;
            (of_tile, answers) = answers.split_at_mut(count as usize);
            for answers in of_tile.chunks_mut(POINTS_AT_A_TIME) {
                let count = answers.len();
                parts.push(PartOfTile { tile, group, points, before: number * OF_GROUP, first, answers });
                first += count;
            }
        }
    }
    parts.sort_by_key(|part| part.tile);
    let tasks: Vec<_> = parts
        .chunk_by_mut(|a, b| a.tile == b.tile)
        .flat_map(|of_tile| of_tile.chunks_mut(PARTS_AT_A_TIME))
        .collect();
    let failed = tasks.into_par_iter().filter_map(|parts| {
        let first = parts.first()?;
        match view.tile(first.tile) {
            Ok(tile) => {
                let tile = tile?;
                let mut answer = answer();
                parts.iter_mut().for_each(|part| part.answer(&grid, &tile, &mut answer));
                None
            }
            Err(error) => Some((first.before + first.group.number_at(first.first), error)),
        }
    });
    if let Some((_, error)) = failed.min_by_key(|(first_point, _)| *first_point) {
        return Err(error);
    }
    let of_groups = groups.par_iter().zip(answers.par_chunks_mut(OF_GROUP));
    of_groups.for_each(|(group, answers)| group.put_in_order_of_points(answers));
    Ok(())
}

impl<A> PartOfTile<'_, A> {
    fn answer(&mut self, grid: &Grid, tile: &Tile, mut answer: impl FnMut(Evidence) -> A) {
        let mut voxels = VoxelBatch::new();
        let mut place = self.first;
        for answers in self.answers.chunks_mut(VoxelBatch::MAX_VOXELS) {
            for place in place..place + answers.len() {
                // Each of them has a voxel, because it is in a tile.
                let voxel = grid.voxel_of(self.points[self.group.number_at(place)]).unwrap_or_default();
                voxels.push(tile.table(), VoxelKey::from_index(voxel));
            }
            place += answers.len();
            let mut answers = answers.iter_mut();
            voxels.take(|evidence| {
                if let (Some(to), Some(evidence)) = (answers.next(), evidence) {
                    *to = answer(evidence);
                }
            });
        }
    }
}

pub(super) fn occupancy_at_points<V: MapView>(view: &V, points: &[Point]) -> Result<Vec<Occupancy>> {
    let config = view.config();
    at_points(view, points, Occupancy::Unknown, || |evidence| Occupancy::of(config, Some(evidence)))
}

pub(super) fn evidence_at_points<V: MapView>(view: &V, points: &[Point]) -> Result<Vec<Option<Evidence>>> {
    at_points(view, points, None, || Some)
}
