use crate::config::{MapConfig, OctreeConfig};
use crate::error::Result;
use crate::scan::{PutAside, Scan, ScanTracer, ScanUpdates};

/// What a scan says about voxels, in the form that the map's tiles want. What exceeds so many bytes is put aside.
pub(super) fn trace(
    tracer: &mut ScanTracer,
    config: &MapConfig,
    scan: &Scan,
    most_bytes: usize,
    put_aside: &mut PutAside<'_>,
) -> Result<ScanUpdates> {
    let MapConfig { grid, sensor_model, rays, .. } = config;
    match config.octree {
        OctreeConfig::Bricks => {
            tracer.trace_putting_aside(grid, sensor_model, rays, scan, most_bytes, put_aside)
        }
        // A voxel cache is about the order in which rays update voxels, and so is what it is compared with.
        OctreeConfig::Pointers(_) => tracer.trace_in_order(grid, sensor_model, rays, scan),
    }
}
