use super::{INFLATION_M, PlannersMap, RESOLUTION_M};
use std::collections::HashSet;
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile::{Result, Scan};
use voxtile_local::{LocalMap, LocalParameters, LocalView};

/// A window of fixed size around the robot, as in array-based planners. Voxels outside the window are dropped.
///
/// For each scan, a local map is rebuilt from the voxels of the window. This takes another time than an array would, so
/// it is not measured.
pub struct Window {
    grid: Grid,
    occupied: HashSet<VoxelIndex>,
    inflated: LocalMap,
}

const EDGE_M: f64 = 16.0;

impl Window {
    pub fn new() -> Result<Self> {
        let grid = Grid::new(RESOLUTION_M, 64.0 * RESOLUTION_M)?;
        Ok(Self { grid, occupied: HashSet::new(), inflated: empty()? })
    }
}

fn empty() -> Result<LocalMap> {
    let parameters = LocalParameters::passive_perception().with_max_voxels(None);
    LocalMap::new(RESOLUTION_M, parameters.with_inflation_radius(INFLATION_M))
}

impl PlannersMap for Window {
    fn insert(&mut self, scan: &Scan) -> Result<()> {
        let is_inside = |point: Point| (0..3).all(|k| (point[k] - scan.origin[k]).abs() <= EDGE_M / 2.0);
        let seen = scan.points.iter().filter(|point| is_inside(**point));
        self.occupied.extend(seen.filter_map(|point| self.grid.voxel_of(*point)));
        self.occupied.retain(|voxel| is_inside(self.grid.center_m(*voxel)));
        let mut centers: Vec<Point> = self.occupied.iter().map(|voxel| self.grid.center_m(*voxel)).collect();
        // Sorted, as the order of a hash set differs between runs.
        centers.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        self.inflated = empty()?;
        self.inflated.insert_relayed(scan.origin, &centers).map(drop)
    }

    fn view(&self) -> &LocalView {
        self.inflated.view()
    }

    fn bytes(&self) -> usize {
        // Size of an array with a count of inflation and a log-odds, two bytes each, per voxel of the window.
        ((EDGE_M / RESOLUTION_M).powi(3) * 4.0) as usize
    }
}
