use super::occupied_voxels::MAX_VOXELS;
use crate::messages::{Header, PointCloud2};
use anyhow::ensure;
use voxtile::Aabb;
use voxtile_local::{LocalView, Obstacle};

/// Returns the centers of the obstacles of a local map in a box.
///
/// # Errors
///
/// More obstacles than a message may contain.
pub fn local_obstacles(
    view: &LocalView,
    region: &Aabb,
    obstacle: Obstacle,
    header: Header,
) -> anyhow::Result<PointCloud2> {
    let centers_m = view.points_in(region, obstacle);
    let count = centers_m.len();
    ensure!(
        count <= MAX_VOXELS,
        "{count} voxels exceed the limit of {MAX_VOXELS} per message: use a smaller --publish-radius"
    );
    Ok(PointCloud2::of_points(header, centers_m))
}
