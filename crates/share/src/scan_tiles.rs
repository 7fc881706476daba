use voxtile::RayConfig;
use voxtile::scan::{MAX_RAY_STEPS, Scan};
use voxtile::space::{Grid, LAST_VOXEL_INDEX, Point, TileBox, VoxelIndex};

/// Returns a box around the tiles that a scan may change; `None` if the origin has no voxel index.
pub(super) fn tiles_of_scan(scan: &Scan, grid: &Grid, rays: &RayConfig) -> Option<TileBox> {
    let ends = Ends::new(scan.origin, grid, rays)?;
    let (mut low, mut high) = (ends.start, ends.start);
    for end in scan.points.iter().filter_map(|&point| ends.farthest(point)) {
        low = std::array::from_fn(|k| low[k].min(end[k]));
        high = std::array::from_fn(|k| high[k].max(end[k]));
    }
    // One extra voxel on each side, for rounding.
    let low = low.map(|k| k.saturating_sub(1));
    let high = high.map(|k| k.saturating_add(1).min(LAST_VOXEL_INDEX));
    Some(TileBox::new(grid.tile_of_voxel(low), grid.tile_of_voxel(high)))
}

/// Computes the ends of rays from one origin.
struct Ends<'a> {
    grid: &'a Grid,
    origin: Point,
    start: VoxelIndex,
    /// Maximum length in metres of a ray with a return, and of a ray without a return.
    cuts_m: [f64; 2],
}

impl<'a> Ends<'a> {
    fn new(origin: Point, grid: &'a Grid, rays: &RayConfig) -> Option<Self> {
        let start = grid.voxel_of(origin)?;
        let max_m = rays.max_range_m.unwrap_or(f64::INFINITY);
        let cuts_m = [max_m, rays.no_return_range_m.map_or(max_m, |range_m| range_m.min(max_m))];
        Some(Self { grid, origin, start, cuts_m })
    }

    /// Returns the last voxel of the ray to a point, or of a longer ray; `None` if the map skips the point.
    ///
    /// The point itself may have no voxel index: the end of the cut ray may have one.
    fn farthest(&self, point: Point) -> Option<VoxelIndex> {
        let offset: Point = std::array::from_fn(|k| point[k] - self.origin[k]);
        let length_m = offset.iter().map(|d| d * d).sum::<f64>().sqrt();
        if !length_m.is_finite() {
            return None;
        }
        // Try the longer ray first, because the result may be longer than the actual ray.
        self.cuts_m.iter().find_map(|&cut_m| {
            let end = if length_m > cut_m { self.at(offset, cut_m / length_m) } else { point };
            self.grid.voxel_of(end).filter(|&last| self.steps_to(last) <= MAX_RAY_STEPS)
        })
    }

    fn at(&self, offset: Point, share: f64) -> Point {
        std::array::from_fn(|k| self.origin[k] + offset[k] * share)
    }

    fn steps_to(&self, voxel: VoxelIndex) -> u64 {
        (0..3).map(|k| u64::from(self.start[k].abs_diff(voxel[k]))).sum()
    }
}
