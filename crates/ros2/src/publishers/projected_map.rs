use super::Extent;
use crate::messages::{Header, MapMetaData, OccupancyGrid, Pose};
use voxtile::query::Column;
use voxtile::{Aabb, Grid, MapQueries, MapView};

/// Maximum number of cells along each edge of an empty map, which limits the size of the message.
const MAX_EMPTY_CELLS: f64 = 1000.0;

/// Projects a region to a 2D occupancy grid with the same cells as `voxtile export` for nav2. Without voxels the whole
/// region is unknown: nav2 ignores a grid without cells and would keep the previous one.
///
/// # Errors
///
/// Too many cells, or a tile that cannot be read.
pub fn projected_map(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<OccupancyGrid> {
    let grid = map.config().grid;
    let columns = map.columns_in(region, extent.heights_m)?;
    let mut info = MapMetaData {
        map_load_time: header.stamp,
        resolution: grid.resolution_m() as f32,
        width: 0,
        height: 0,
        origin: Pose::at([0.0; 3]),
    };
    let [width, height] = columns.size();
    if width == 0 {
        let [(x, width), (y, height)] = [0, 1].map(|axis| empty_cells(&grid, region, axis));
        (info.width, info.height) = (width, height);
        info.origin = Pose::at([x, y, 0.0]);
        let data = vec![OccupancyGrid::UNKNOWN; width as usize * height as usize];
        return Ok(OccupancyGrid { header, info, data });
    }
    (info.width, info.height) = (u32::try_from(width)?, u32::try_from(height)?);
    let [x, y] = columns.first().map(|index| grid.corner_m(index));
    info.origin = Pose::at([x, y, 0.0]);
    let data = columns.states().iter().copied().map(cell_of).collect();
    Ok(OccupancyGrid { header, info, data })
}

/// Returns the start, in metres, and the number of cells of an empty region along an axis.
fn empty_cells(grid: &Grid, region: &Aabb, axis: usize) -> (f64, u32) {
    let edge_m = grid.resolution_m();
    let [least_m, most_m] = [region.min[axis], region.max[axis]];
    let middle_m = 0.5 * (least_m + most_m);
    // An infinite region has no center.
    let middle_m = if middle_m.is_finite() { middle_m } else { 0.0 };
    let reach_m = (0.5 * (most_m - least_m)).min(0.5 * MAX_EMPTY_CELLS * edge_m);
    let first = ((middle_m - reach_m) / edge_m).floor();
    let end = ((middle_m + reach_m) / edge_m).ceil();
    (first * edge_m, (end - first).max(1.0) as u32)
}

fn cell_of(column: Column) -> u8 {
    match column {
        Column::Unknown => OccupancyGrid::UNKNOWN,
        Column::Free => OccupancyGrid::FREE,
        Column::Occupied => OccupancyGrid::OCCUPIED,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{MapConfig, OutOfCoreTileMapper};

    #[test]
    fn an_empty_map_is_unknown_in_the_whole_region() {
        let folder = tempfile::tempdir().unwrap();
        let config = MapConfig::new(0.5, 16.0).unwrap();
        let map = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        let of = |radius_m: f64| {
            let extent = Extent { radius_m, heights_m: [f64::NEG_INFINITY, f64::INFINITY] };
            projected_map(&map, &extent.around([10.0, -20.0, 0.0]), &extent, Header::default()).unwrap()
        };
        let projected = of(2.2);
        assert_eq!((projected.info.width, projected.info.height, projected.data.len()), (10, 10, 100));
        assert_eq!(projected.info.origin, Pose::at([7.5, -22.5, 0.0]));
        assert!(projected.data.iter().all(|cell| *cell == OccupancyGrid::UNKNOWN));
        for (radius_m, least, most) in [(1e-9, 1, 2), (1e9, 1000, 1001), (f64::INFINITY, 1000, 1001)] {
            let projected = of(radius_m);
            assert!((least..=most).contains(&projected.info.width), "{radius_m}: {}", projected.info.width);
            assert_eq!(projected.data.len(), projected.info.width as usize * projected.info.height as usize);
        }
    }
}
