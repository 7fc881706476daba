use super::Extent;
use crate::messages::{Color, Header, Marker, MarkerArray, PointCloud2};
use anyhow::bail;
use voxtile::{Aabb, MapQueries, MapView, VoxelIndex};

/// Maximum number of voxels in a message: larger messages are not delivered over DDS.
pub(super) const MAX_VOXELS: usize = 4 << 20;
const COLOR: Color = Color { r: 0.0, g: 0.0, b: 1.0, a: 1.0 };

/// Returns the occupied voxels of a region that overlap the range of heights.
///
/// # Errors
///
/// More voxels than a message may contain, or a tile that cannot be read.
pub fn occupied_voxels(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
) -> anyhow::Result<Vec<VoxelIndex>> {
    let grid = map.config().grid;
    let (mut voxels, mut count) = (Vec::new(), 0);
    map.for_each_occupied(None, Some(region), |voxel| {
        if extent.reaches(grid.center_m(voxel.index)[2], grid.resolution_m()) {
            count += 1;
            if count <= MAX_VOXELS {
                voxels.push(voxel.index);
            }
        }
    })?;
    if count > MAX_VOXELS {
        bail!(
            "{count} occupied voxels exceed the limit of {MAX_VOXELS} per message: use a smaller --publish-radius"
        );
    }
    Ok(voxels)
}

fn centers_m(map: &impl MapView, region: &Aabb, extent: &Extent) -> anyhow::Result<Vec<[f64; 3]>> {
    let grid = map.config().grid;
    Ok(occupied_voxels(map, region, extent)?.into_iter().map(|voxel| grid.center_m(voxel)).collect())
}

/// Returns the occupied voxels as a cloud.
pub fn cloud(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<PointCloud2> {
    Ok(PointCloud2::of_points(header, centers_m(map, region, extent)?))
}

/// Returns the occupied voxels as cubes.
pub fn markers(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<MarkerArray> {
    let edge_m = map.config().grid.resolution_m();
    let centers_m = centers_m(map, region, extent)?;
    Ok(MarkerArray { markers: vec![Marker::of_cubes(header, edge_m, COLOR, centers_m)] })
}
