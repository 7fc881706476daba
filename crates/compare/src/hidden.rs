use crate::bits::Bits;
use crate::viewpoints::Viewpoints;
use voxtile::mapper::MapView;
use voxtile::{Point, Queries, Result, UnknownAs};

/// Maximum length of a segment in voxels; a longer one could cross more voxels than a query allows.
const MAX_SEGMENT_VOXELS: f64 = 300_000.0;

/// Returns which of some unknown voxels of a map are hidden: from each of the nearest positions of its sensor within the
/// range, and there is at least one, an occupied voxel is in between. The others are out of view.
///
/// # Errors
///
/// A tile cannot be read.
pub(crate) fn hidden(map: &impl MapView, viewpoints: &Viewpoints, unknown: &Bits) -> Result<Bits> {
    let (grid, cube) = (map.config().grid, unknown.cube());
    let mut hidden = Bits::new(cube);
    let mut near = viewpoints.near(&cube.bounds_m(&grid));
    near.retain(|position| grid.voxel_of(*position).is_some());
    if near.is_empty() {
        return Ok(hidden);
    }
    let range_m = MAX_SEGMENT_VOXELS * grid.resolution_m();
    // Neighbors are mostly visible from the same position.
    let mut latest = None;
    for run in unknown.runs() {
        for x in run.x..run.end {
            let place = [x, run.y, run.z].map(usize::from);
            let center_m = grid.center_m(cube.voxel_at(place));
            let mut positions = viewpoints.nearest(&near, center_m, range_m);
            if let Some(at) = positions.iter().position(|position| Some(*position) == latest) {
                positions.swap(0, at);
            }
            match first_clear(map, center_m, &positions)? {
                None if !positions.is_empty() => hidden.insert(place),
                None => {}
                clear => latest = clear,
            }
        }
    }
    Ok(hidden)
}

/// Returns the first position from which nothing is in front of a point.
fn first_clear(map: &impl MapView, point: Point, positions: &[Point]) -> Result<Option<Point>> {
    for position in positions {
        if !is_blocked(map, point, *position)? {
            return Ok(Some(*position));
        }
    }
    Ok(None)
}

/// Returns whether an occupied voxel is between a point and a position of the sensor, apart from the sensor's own voxel.
fn is_blocked(map: &impl MapView, point: Point, position: Point) -> Result<bool> {
    let own = map.config().grid.voxel_of(position);
    let hit = map.cast_segment(point, position, UnknownAs::Free)?;
    Ok(hit.is_some_and(|hit| Some(hit.voxel) != own))
}
