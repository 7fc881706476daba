use crate::distance::{Distance, DistanceAndGradient};
use crate::voxel_distance::{BEYOND, UNKNOWN, VoxelDistance};
use voxtile::{Grid, Point, VoxelIndex};

/// Position of a point between the centers of eight voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between {
    /// The lowest of the eight voxels.
    pub(crate) lowest: VoxelIndex,
    /// Position between the lower and the upper centers, from 0 to 1.
    part: [f64; 3],
}

impl Between {
    /// Returns `None` for a point that is not finite or outside of the range of indices.
    #[inline]
    pub(crate) fn of(grid: &Grid, point_m: Point) -> Option<Self> {
        let units = grid.to_voxel_units(point_m).map(|k| k - 0.5);
        let lowest = Grid::voxel_of_units(units)?;
        Some(Self { lowest, part: std::array::from_fn(|k| units[k] - f64::from(lowest[k])) })
    }

    /// Interpolates the distances of the eight voxels, in the order x, then y, then z. The gradient is per metre.
    #[inline]
    pub(crate) fn interpolate(&self, corners: [VoxelDistance; 8], scale: &Scale) -> DistanceAndGradient {
        let without = |distance| DistanceAndGradient { distance, gradient: [0.0; 3] };
        let (mut beyond, mut deep) = (0, 0);
        for VoxelDistance(number) in corners {
            match number {
                UNKNOWN => return without(Distance::Unknown),
                BEYOND => beyond += 1,
                number if number <= -BEYOND => deep += 1,
                _ => {}
            }
        }
        if beyond == 8 {
            return without(Distance::Beyond);
        }
        if deep == 8 {
            return without(Distance::DeepInside);
        }
        let value = corners.map(|corner| scale.metres(corner));
        let [x, y, z] = self.part;
        let mix = |low: f64, high: f64, part: f64| low + (high - low) * part;
        // Along x on four edges, then along y on two, then along z.
        let along_x: [f64; 4] = std::array::from_fn(|k| mix(value[2 * k], value[2 * k + 1], x));
        let along_y = [mix(along_x[0], along_x[1], y), mix(along_x[2], along_x[3], y)];
        let step: [f64; 4] = std::array::from_fn(|k| value[2 * k + 1] - value[2 * k]);
        let gradient = [
            mix(mix(step[0], step[1], y), mix(step[2], step[3], y), z),
            mix(along_x[1] - along_x[0], along_x[3] - along_x[2], z),
            along_y[1] - along_y[0],
        ];
        DistanceAndGradient {
            distance: Distance::Within(mix(along_y[0], along_y[1], z)),
            gradient: gradient.map(|step_m| step_m * scale.per_metre),
        }
    }
}

/// Conversion of stored distances to metres.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    resolution_m: f64,
    max_distance_m: f64,
    per_metre: f64,
}

impl Scale {
    pub(crate) fn new(resolution_m: f64, max_distance_m: f64) -> Self {
        Self { resolution_m, max_distance_m, per_metre: 1.0 / resolution_m }
    }

    pub(crate) fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    pub(crate) fn max_distance_m(&self) -> f64 {
        self.max_distance_m
    }

    /// A distance that is not unknown, in metres; the cap beyond it.
    #[inline]
    fn metres(&self, VoxelDistance(number): VoxelDistance) -> f64 {
        if number >= BEYOND {
            return self.max_distance_m;
        }
        if number <= -BEYOND {
            return -self.max_distance_m;
        }
        let voxels = f64::from(number.unsigned_abs()).sqrt();
        if number < 0 { -voxels * self.resolution_m } else { voxels * self.resolution_m }
    }
}
