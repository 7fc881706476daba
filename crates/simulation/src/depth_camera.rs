use super::sweep::Sweep;
use super::{LabelledScan, Sensor, World};
use std::f64::consts::PI;
use voxtile::maths;
use voxtile::scan::Pose;

/// Depth camera without distortion: one ray through the middle of each pixel, row by row.
///
/// Sensor frame: x ahead along the optical axis, y left, z up. Depth is the coordinate x.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DepthCamera {
    /// Columns and rows of the image.
    pub pixels: [u32; 2],
    /// Full horizontal angle of view in degrees, below 180. Pixels are square.
    pub horizontal_deg: f64,
    /// Minimum and maximum depth in metres; other pixels have no point.
    pub depth_m: [f64; 2],
    /// Standard deviation of the depth noise at 1 m, in metres. It grows with the square of the depth.
    pub noise_at_1_m: f64,
}

impl DepthCamera {
    /// Returns a camera of 160 x 120 pixels, 87 x 71 degrees, with depths from 0.3 to 10 m and a noise of 1.5 mm at 1 m
    /// and 15 cm at 10 m.
    pub fn robot() -> Self {
        Self { pixels: [160, 120], horizontal_deg: 87.0, depth_m: [0.3, 10.0], noise_at_1_m: 0.0015 }
    }
}

impl Sensor for DepthCamera {
    fn labelled_scan(
        &self,
        world: &impl World,
        world_from_sensor: &Pose,
        seed: u64,
        scan_number: u64,
    ) -> LabelledScan {
        let [columns, rows] = self.pixels;
        let half = [0.5 * f64::from(columns), 0.5 * f64::from(rows)];
        let (sin, cos) = maths::sin_cos(0.5 * self.horizontal_deg * (PI / 180.0));
        let focal = half[0] * cos / sin;
        let [min_m, max_m] = self.depth_m;
        let corner = length([1.0, half[0] / focal, half[1] / focal]);
        let mut sweep = Sweep::new(world, world_from_sensor, max_m * corner, seed, scan_number);
        for row in 0..rows {
            for column in 0..columns {
                let left = (half[0] - f64::from(column) - 0.5) / focal;
                let up = (half[1] - f64::from(row) - 0.5) / focal;
                let ray = [1.0, left, up];
                let per_depth = length(ray);
                sweep.fire(ray.map(|x| x / per_depth), max_m * per_depth, |distance_m, bell| {
                    let depth_m = distance_m / per_depth;
                    let measured_m = depth_m + self.noise_at_1_m * depth_m * depth_m * bell;
                    (min_m <= measured_m && measured_m <= max_m).then_some(measured_m * per_depth)
                });
            }
        }
        sweep.finish()
    }
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::Building;
    use super::super::route::level_pose;
    use super::*;

    #[test]
    fn depths_are_in_the_range_and_their_noise_grows_with_the_square() {
        let world = Building::new(3);
        let pose = level_pose([2.0, 10.0, 1.4], 0.0);
        let exact_camera = DepthCamera { noise_at_1_m: 0.0, ..DepthCamera::robot() };
        let exact = exact_camera.labelled_scan(&world, &pose, 1, 0).scan.points;
        let noisy_camera = DepthCamera { depth_m: [0.0, 45.0], ..DepthCamera::robot() };
        let noisy = noisy_camera.labelled_scan(&world, &pose, 1, 0).scan.points;
        let exact_far = DepthCamera { depth_m: [0.0, 45.0], ..exact_camera };
        let exact_far = exact_far.labelled_scan(&world, &pose, 1, 0).scan.points;
        assert!(exact.iter().all(|p| (0.3..=10.0).contains(&(p[0] - 2.0))));
        assert!(exact.len() > 10_000 && exact.len() < 160 * 120);
        assert_eq!((noisy.len(), exact_far.len()), (160 * 120, 160 * 120));
        let deviation = |range: [f64; 2]| {
            let in_range = exact_far.iter().zip(&noisy).filter(|(p, _)| {
                let depth_m = p[0] - 2.0;
                range[0] < depth_m && depth_m < range[1]
            });
            let shares: Vec<f64> = in_range.map(|(p, q)| (q[0] - p[0]) / (p[0] - 2.0).powi(2)).collect();
            (shares.iter().map(|x| x * x).sum::<f64>() / shares.len() as f64).sqrt()
        };
        for range in [[0.5, 2.0], [2.0, 5.0], [5.0, 10.0]] {
            assert!((deviation(range) - 0.0015).abs() < 0.0002, "{}", deviation(range));
        }
    }

    #[test]
    fn the_angle_of_view_is_as_requested() {
        let camera = DepthCamera { noise_at_1_m: 0.0, depth_m: [0.0, 40.0], ..DepthCamera::robot() };
        let scan = camera.labelled_scan(&Building::new(3), &level_pose([2.0, 10.0, 1.4], 0.0), 1, 0);
        let azimuth_deg = |p: &[f64; 3]| (p[1] - 10.0).atan2(p[0] - 2.0) * 180.0 / PI;
        let (first, last) = (azimuth_deg(&scan.scan.points[0]), azimuth_deg(&scan.scan.points[159]));
        assert!((first - 43.3).abs() < 0.2 && (last + 43.3).abs() < 0.2, "{first} {last}");
    }

    #[test]
    fn extreme_and_invalid_settings_cause_no_panic() {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            for pixels in [[0, 3], [3, 0], [2, 2]] {
                let camera =
                    DepthCamera { pixels, horizontal_deg: value, depth_m: [value; 2], noise_at_1_m: value };
                camera.labelled_scan(&Building::new(1), &level_pose([value, 0.0, 1.0], 0.0), 1, 0);
            }
        }
    }
}
