//! Computes responses. This may read tiles, so it runs on blocking threads.

use super::comparison::ServedComparison;
use super::distance_slice::distance_slice;
use super::map_state::Shown;
use super::moving::moving;
use super::response::{Answer, Keep};
use super::route::{At, MapId, Thing};
use super::served_map::{Found, Makes, ServedMap};
use hyper::StatusCode;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::query::UnknownAs;
use voxtile::scan::Stop;
use voxtile::space::{Aabb, TileBox, TileIndex, VoxelIndex};
use voxtile::{Error, Point, Queries, Result};
use voxtile_pipeline::AnyMap;
use voxtile_pipeline::answer_at;
use voxtile_render::{ColorMap, Layer, is_unix_time};

/// Maximum number of positions in a trajectory.
pub const TRAJECTORY: usize = 20_000;

/// Returns `maps.json`, the list of maps.
pub fn maps(maps: &[Arc<ServedMap>], comparison: Option<&ServedComparison>) -> Answer {
    let maps: Vec<Value> = maps.iter().enumerate().map(|(number, map)| describe(number, map)).collect();
    let mut answer = json!({ "maps": maps, "color_maps": ColorMap::all() });
    if let Some(comparison) = comparison {
        answer["comparison"] = comparison.describe();
    }
    Answer::json(answer)
}

fn describe(number: usize, map: &ServedMap) -> Value {
    let state = map.now();
    let listed = map.snapshots();
    let snapshots = listed.iter().map(|listed| json!({ "name": listed.name, "tiles": listed.tiles }));
    let mut described = described(number, map.name(), &state.map, &state.map.tile_indices());
    described["generation"] = state.generation.into();
    described["pending_tiles"] = state.pending_tiles.into();
    described["unreadable"] = state.levels.unreadable().into();
    described["snapshots"] = snapshots.collect();
    described
}

/// Returns the name of a map in the page.
pub fn name_of(map: &Path) -> String {
    map.file_name().unwrap_or(map.as_os_str()).to_string_lossy().into_owned()
}

/// Returns what `maps.json` has of a map that never changes, or of some tiles of one.
pub fn described(number: usize, name: &str, map: &AnyMap, tiles: &[TileIndex]) -> Value {
    let config = map.config();
    let edge_m = config.grid.tile_size_m();
    let bounds = TileBox::of(tiles.iter().copied()).map(|tiles| extent_m(tiles, edge_m));
    let layers = config.layers();
    let layers: Vec<_> =
        Layer::ALL.into_iter().filter(|layer| layer.is_in(&layers)).map(Layer::name).collect();
    let mut described = json!({
        "id": number.to_string(),
        "name": name,
        "resolution_m": config.grid.resolution_m(),
        "tile_size_m": edge_m,
        "tiles": tiles.len(),
        "bounds": bounds,
        "scans": map.scan_number(),
    });
    if let Some(crs) = &config.crs {
        described["crs"] = crs.as_str().into();
    }
    if !layers.is_empty() {
        described["layers"] = layers.into();
    }
    described
}

/// Returns the box of some tiles in metres.
pub fn extent_m(tiles: TileBox, edge_m: f64) -> Aabb {
    let corner = |tile: [i32; 3], more: i64| tile.map(|k| (i64::from(k) + more) as f64 * edge_m);
    Aabb { min: corner(tiles.min().to_array(), 0), max: corner(tiles.max().to_array(), 1) }
}

/// Responds to a request for a map; `stop` ends the work early. Returns `None` if it needs levels that are not built yet and may not be built here.
pub fn of_map(
    maps: &[Arc<ServedMap>],
    comparison: Option<&ServedComparison>,
    id: &MapId,
    thing: &Thing,
    version: Option<u64>,
    makes: Makes,
    stop: &Stop,
) -> Option<Answer> {
    let nothing = || Answer::error(StatusCode::NOT_FOUND, "no such map, snapshot or node");
    let Some(map) = maps.get(id.number) else { return Some(nothing()) };
    let answer = if let Some(At::Map(before)) = id.since {
        match comparison.filter(|_| (before, id.number) == (0, 1)) {
            Some(comparison) => comparison.answer(thing, version),
            None => Ok(None),
        }
    } else if thing.takes_levels() {
        match map.shown(id, makes) {
            Ok(Found::Here(shown)) => of_levels(&shown, thing, version),
            Ok(Found::NotMade) => return None,
            Ok(Found::Nothing) => Ok(None),
            Err(error) => Err(error),
        }
    } else {
        map.query_map(id).and_then(|found| match found {
            Some(found) if *thing == Thing::Overview => Ok(Some(Answer::json(found.overview()?))),
            Some(found) => query_result(found.map(), thing, version, stop),
            None => Ok(None),
        })
    };
    Some(match answer {
        Ok(answer) => answer.unwrap_or_else(nothing),
        Err(error) => {
            let status = status_of(&error);
            // Without a client, nothing has failed.
            if status.is_server_error() && !matches!(error, Error::Stopped) {
                log::warn!("{error:#}");
            }
            Answer::error(status, &format!("{error:#}"))
        }
    })
}

/// Returns the HTTP status of an error, which depends on its cause: the request, a temporary condition, a bucket, or
/// the map.
fn status_of(error: &Error) -> StatusCode {
    match error {
        Error::InvalidArgument { .. } | Error::TooLarge { .. } => StatusCode::BAD_REQUEST,
        Error::Changed { .. } | Error::Expired | Error::Stopped => StatusCode::SERVICE_UNAVAILABLE,
        Error::NoAnswer { .. } => StatusCode::GATEWAY_TIMEOUT,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

/// Responds from the levels. `version` is the requested version: a response with a newer state must not be cached under
/// it.
fn of_levels(shown: &Shown, thing: &Thing, version: Option<u64>) -> Result<Option<Answer>> {
    let keep = match thing {
        Thing::Node(key, _) | Thing::LayeredNode(key, _) | Thing::Subtree(key)
            if version.is_some() && shown.version(*key)? == version =>
        {
            Keep::ForEver
        }
        _ => Keep::No,
    };
    let kept = |answer: Answer| Answer { keep, ..answer };
    Ok(match thing {
        Thing::Tileset => Some(Answer::json(shown.tileset()?)),
        Thing::Subtree(key) => shown.subtree(*key)?.map(Answer::json).map(kept),
        Thing::Node(key, kind) => shown.node(*key, *kind)?.map(|bytes| Answer::bytes(bytes, keep)),
        Thing::LayeredNode(key, layer) => {
            shown.layered_node(*key, *layer)?.map(|bytes| Answer::bytes(bytes, keep))
        }
        Thing::Layers => Some(Answer::json(shown.state().layer_legends()?)),
        Thing::Query(_)
        | Thing::Raycast(..)
        | Thing::Trajectory
        | Thing::Overview
        | Thing::Moving
        | Thing::Distances(..)
        | Thing::Changes => None,
    })
}

/// Responds from the map alone, without levels. `version` is that of the marks that the client has.
fn query_result(map: &AnyMap, thing: &Thing, version: Option<u64>, stop: &Stop) -> Result<Option<Answer>> {
    let answer = match thing {
        Thing::Query(point) => query(map, *point)?,
        Thing::Raycast(from, to) => raycast(map, *from, *to)?,
        Thing::Trajectory => trajectory(map, TRAJECTORY, None)?,
        Thing::Moving => return Ok(Some(Answer::bytes(moving(map, version)?, Keep::No))),
        Thing::Distances(around, cap_m) => {
            let bytes = distance_slice(map, *around, *cap_m, stop)?;
            return Ok(Some(Answer::bytes(bytes, Keep::No)));
        }
        Thing::Tileset
        | Thing::Subtree(_)
        | Thing::Node(..)
        | Thing::LayeredNode(..)
        | Thing::Layers
        | Thing::Overview
        | Thing::Changes => return Ok(None),
    };
    Ok(Some(Answer::json(answer)))
}

/// Returns the number of scans, and positions and times of at most `most`, if wanted only those in a box: with the
/// index of the first position of each part of the trajectory, if there are several.
pub fn trajectory(map: &AnyMap, most: usize, within: Option<&Aabb>) -> Result<Value> {
    let scans = match map {
        AnyMap::Map(map) => map.scans()?,
        AnyMap::Octree(_) => Vec::new(),
    };
    // A part ends where the sensor leaves the box.
    let (mut part, mut was_within) = (0, false);
    let within = scans.into_iter().filter_map(|scan| {
        let is_within = within.is_none_or(|within| within.contains(scan.origin_m));
        part += usize::from(is_within && !was_within);
        was_within = is_within;
        is_within.then_some((part, scan))
    });
    let scans: Vec<_> = within.collect();
    let step = scans.len().div_ceil(most).max(1);
    let last = scans.last().filter(|_| scans.len() % step != 1 && step > 1);
    let some: Vec<_> = scans.iter().step_by(step).chain(last).collect();
    let points: Vec<Point> = some.iter().map(|(_, scan)| scan.origin_m).collect();
    let mut answer = json!({ "scans": scans.len(), "points": points });
    let firsts: Vec<usize> = (0..some.len())
        .filter(|&k| k.checked_sub(1).is_none_or(|before| some[before].0 != some[k].0))
        .collect();
    if firsts.len() > 1 {
        answer["parts"] = firsts.into();
    }
    let times_s: Option<Vec<f64>> = some.iter().map(|(_, scan)| Some(scan.stamp_ns? as f64 * 1e-9)).collect();
    if let Some(times_s) = times_s.filter(|times_s| !times_s.is_empty()) {
        answer["is_unix_time"] = times_s.iter().copied().all(is_unix_time).into();
        answer["times_s"] = times_s.into();
    }
    Ok(answer)
}

/// Returns the result of `voxtile query --json`, with the indices of voxel and tile.
fn query(map: &AnyMap, point: Point) -> Result<Value> {
    let grid = map.config().grid;
    let mut answer = json!(answer_at(map, point)?);
    if let (Some(voxel), Some(object)) = (grid.voxel_of(point), answer.as_object_mut()) {
        object.insert("voxel_m".into(), json!(extent(&grid, voxel)));
        object.insert("tile".into(), json!(grid.tile_of_voxel(voxel).to_array()));
    }
    Ok(answer)
}

fn extent(grid: &voxtile::Grid, voxel: VoxelIndex) -> Aabb {
    Aabb { min: voxel.map(|k| grid.corner_m(k)), max: voxel.map(|k| grid.corner_m(k.saturating_add(1))) }
}

/// Returns whether one point is visible from another; the voxel of the second may be occupied.
fn raycast(map: &AnyMap, from: Point, to: Point) -> Result<Value> {
    let grid = map.config().grid;
    let is_end = |center: Point| grid.voxel_of(center) == grid.voxel_of(to);
    let hit = map.cast_segment(from, to, UnknownAs::Free)?;
    let first = map.cast_segment(from, to, UnknownAs::Obstacle)?;
    let blocked = hit.filter(|hit| !is_end(hit.center_m));
    let unknown = first.filter(|hit| hit.probability.is_none() && !is_end(hit.center_m));
    Ok(json!({
        "from_m": from,
        "to_m": to,
        "visible": blocked.is_none(),
        "hit": blocked,
        // Distance from which the line of sight is unknown; null if it is completely known.
        "unknown_from_m": unknown.map(|hit| hit.distance_m),
    }))
}
