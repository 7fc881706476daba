use super::Extent;
use crate::messages::{Header, MapMetaData, OccupancyGrid, Pose};
use voxtile::{Aabb, MapQueries, MapView, Voxel};
use voxtile_clouds::write::{Column, FlatMap, VoxelRow, VoxelsHead};

/// The voxels of a region from above, cell by cell what `voxtile export` writes for nav2.
///
/// # Errors
///
/// Too many cells; a tile that cannot be read.
pub fn projected_map(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<OccupancyGrid> {
    let config = map.config();
    let grid = config.grid;
    let row_of = |voxel: &Voxel| VoxelRow {
        index: voxel.index,
        center_m: grid.center_m(voxel.index),
        probability: voxel.evidence.probability(),
        log_odds: voxel.evidence.log_odds,
        observation_count: voxel.evidence.observation_count,
        tile: grid.tile_of_voxel(voxel.index).to_array(),
    };
    let mut head = VoxelsHead {
        voxels: 0,
        resolution_m: grid.resolution_m(),
        bounds_m: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        occupied_from: config.occupancy_threshold,
    };
    map.for_each_voxel_in(region, |voxel| {
        let center_m = grid.center_m(voxel.index);
        let [least, most] = head.bounds_m;
        head.bounds_m = [
            std::array::from_fn(|k| least[k].min(center_m[k])),
            std::array::from_fn(|k| most[k].max(center_m[k])),
        ];
        head.voxels += 1;
    })?;
    let mut info = MapMetaData {
        map_load_time: header.stamp,
        resolution: grid.resolution_m() as f32,
        width: 0,
        height: 0,
        origin: Pose::at([0.0; 3]),
    };
    if head.voxels == 0 {
        return Ok(OccupancyGrid { header, info, data: Vec::new() });
    }
    let mut flat = FlatMap::new(&head, extent.heights_m);
    let mut put = Ok(());
    map.for_each_voxel_in(region, |voxel| {
        if put.is_ok() {
            put = flat.put(&row_of(&voxel));
        }
    })?;
    put?;
    let [width, height] = flat.size()?;
    let [x, y, _] = flat.corner_m()?;
    (info.width, info.height) = (u32::try_from(width)?, u32::try_from(height)?);
    info.origin = Pose::at([x, y, 0.0]);
    // The picture begins at the top, the message at the bottom.
    let rows = flat.columns()?.chunks(width.max(1)).rev();
    let data = rows.flatten().copied().map(cell_of).collect();
    Ok(OccupancyGrid { header, info, data })
}

fn cell_of(column: Column) -> u8 {
    match column {
        Column::Unknown => OccupancyGrid::UNKNOWN,
        Column::Free => OccupancyGrid::FREE,
        Column::Occupied => OccupancyGrid::OCCUPIED,
    }
}
