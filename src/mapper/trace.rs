use crate::config::{MapConfig, OctreeConfig};
use crate::error::Result;
use crate::scan::{Scan, ScanTracer, ScanUpdates};

/// What a scan says about voxels, in the form that the map's tiles want.
pub(super) fn trace(tracer: &mut ScanTracer, config: &MapConfig, scan: &Scan) -> Result<ScanUpdates> {
    let MapConfig { grid, sensor_model, rays, .. } = config;
    match config.octree {
        OctreeConfig::Bricks => tracer.trace(grid, sensor_model, rays, scan),
        // A voxel cache is about the order in which rays update voxels, and so is what it is compared with.
        OctreeConfig::Pointers(_) => tracer.trace_in_order(grid, sensor_model, rays, scan),
    }
}
