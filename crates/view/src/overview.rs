use serde_json::{Value, json};
use voxtile::space::{Aabb, TileIndex};
use voxtile::{Point, Result};
use voxtile_pipeline::AnyMap;
use voxtile_render::{Roof, height_range_m};

/// Returns `overview.json`, what the first view of some tiles needs. Positions of the sensor count in a box only, if
/// there is one. Reads at most some hundred tiles, which takes up to a second or so.
pub fn overview(map: &AnyMap, tiles: &[TileIndex], within: Option<&Aabb>) -> Result<Value> {
    let path: Vec<Point> = match map {
        AnyMap::Map(map) => map.scans()?.into_iter().map(|scan| scan.origin_m).collect(),
        AnyMap::Octree(_) => Vec::new(),
    };
    let path: Vec<Point> =
        path.into_iter().filter(|at| within.is_none_or(|within| within.contains(*at))).collect();
    let ceiling_m = Roof::of(map, &path)?.and_then(|roof| roof.oblique_cut_m());
    Ok(json!({ "ceiling_m": ceiling_m, "heights_m": height_range_m(map, tiles)? }))
}
