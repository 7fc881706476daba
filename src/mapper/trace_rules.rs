use crate::config::{MapConfig, OctreeConfig};
use crate::scan::{MappedTiles, TraceRules, UpdateOrder};
use crate::space::TileSelection;

/// Returns the rules for tracing scans within the selected tiles, or in all tiles. The order of the updates is the one
/// that the map's octrees need.
pub(super) fn trace_rules<'a>(config: &'a MapConfig, tiles: Option<&'a TileSelection>) -> TraceRules<'a> {
    let MapConfig { grid, sensor_model: model, rays, .. } = config;
    let order = match config.octree {
        OctreeConfig::Bricks => UpdateOrder::OfVoxels,
        // The voxel cache, and the mode that it is compared with, depend on the order in which rays update voxels.
        OctreeConfig::Pointers(_) => UpdateOrder::OfRays,
    };
    let mapped = MappedTiles { grid, selection: tiles };
    TraceRules { mapped, model, rays, order, layers: config.layers() }
}
