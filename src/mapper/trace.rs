use crate::config::{MapConfig, OctreeConfig};
use crate::error::Result;
use crate::scan::{MappedTiles, Overflow, ScanPoints, ScanTracer, ScanUpdates, UpdateOrder};
use crate::space::TileSelection;

/// What a scan says about the voxels of a selection of tiles or of all, in the form that the map's tiles want. What
/// there is no room for overflows, if there is a limit.
pub(super) fn trace(
    tracer: &mut ScanTracer,
    config: &MapConfig,
    scan: &dyn ScanPoints,
    tiles: Option<&TileSelection>,
    overflow: Option<Overflow<'_>>,
) -> Result<ScanUpdates> {
    let MapConfig { grid, sensor_model, rays, .. } = config;
    let order = match config.octree {
        OctreeConfig::Bricks => UpdateOrder::OfVoxels,
        // A voxel cache is about the order in which rays update voxels, and so is what it is compared with.
        OctreeConfig::Pointers(_) => UpdateOrder::OfRays,
    };
    let mapped = MappedTiles { grid, selection: tiles };
    tracer.trace_points(mapped, sensor_model, rays, scan, order, overflow)
}
