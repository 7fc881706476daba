use crate::config::{MapConfig, OctreeConfig};
use crate::scan::{MappedTiles, TraceRules, UpdateOrder};
use crate::space::TileSelection;

/// How scans are traced, for a selection of tiles or for all, so that the updates have the form that the map's tiles
/// want.
pub(super) fn trace_rules<'a>(config: &'a MapConfig, tiles: Option<&'a TileSelection>) -> TraceRules<'a> {
    let MapConfig { grid, sensor_model: model, rays, .. } = config;
    let order = match config.octree {
        OctreeConfig::Bricks => UpdateOrder::OfVoxels,
        // A voxel cache is about the order in which rays update voxels, and so is what it is compared with.
        OctreeConfig::Pointers(_) => UpdateOrder::OfRays,
    };
    let mapped = MappedTiles { grid, selection: tiles };
    TraceRules { mapped, model, rays, order }
}
