use super::sweep::Sweep;
use super::{LabelledScan, Sensor, World};
use std::f64::consts::PI;
use voxtile::maths;
use voxtile::scan::Pose;

/// Solid-state lidar with a non-repetitive pattern in a cone ahead: two prisms turn at different speeds and deflect one
/// beam. Scan k continues the pattern of scan k - 1.
///
/// Sensor frame: x ahead, y left, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolidStateLidar {
    /// Number of rays of a scan.
    pub rays: u32,
    /// Full horizontal and vertical angle of the elliptic cone, in degrees.
    pub cone_deg: [f64; 2],
    /// Turns of the two prisms from one ray to the next.
    pub turns_per_ray: [f64; 2],
    /// Maximum range in metres, at most [`Scene::MAX_RADIUS_M`](super::Scene::MAX_RADIUS_M).
    pub max_range_m: f64,
    /// Standard deviation of the range noise in metres; 0 for exact ranges.
    pub range_noise_m: f64,
}

impl SolidStateLidar {
    /// Returns a lidar of 24 000 rays in a cone of 70 x 25 degrees, up to 100 m.
    pub fn forward() -> Self {
        Self {
            rays: 24_000,
            cone_deg: [70.0, 25.0],
            // 240 000 rays per second.
            turns_per_ray: [121.567 / 240_000.0, -77.323 / 240_000.0],
            max_range_m: 100.0,
            range_noise_m: 0.02,
        }
    }

    /// Returns the direction of a ray in the sensor frame, given its number since the start of the pattern.
    fn direction(&self, ray: u64) -> [f64; 3] {
        let prisms = self.turns_per_ray.map(|turns| {
            // Numbers are exact up to 2^53 rays.
            maths::sin_cos(2.0 * PI * (ray as f64 * turns).rem_euclid(1.0))
        });
        // Each prism deflects by half of the largest angle.
        let half_rad = self.cone_deg.map(|angle| 0.25 * angle * (PI / 180.0));
        let (sin_azimuth, cos_azimuth) = maths::sin_cos(half_rad[0] * (prisms[0].1 + prisms[1].1));
        let (up, flat) = maths::sin_cos(half_rad[1] * (prisms[0].0 + prisms[1].0));
        [flat * cos_azimuth, flat * sin_azimuth, up]
    }
}

impl Sensor for SolidStateLidar {
    fn labelled_scan(
        &self,
        world: &impl World,
        world_from_sensor: &Pose,
        seed: u64,
        scan_number: u64,
    ) -> LabelledScan {
        let mut sweep = Sweep::new(world, world_from_sensor, self.max_range_m, seed, scan_number);
        let first = scan_number.wrapping_mul(u64::from(self.rays));
        for ray in 0..u64::from(self.rays) {
            let measure =
                |distance_m: f64, bell: f64| Some((distance_m + self.range_noise_m * bell).max(0.0));
            sweep.fire(self.direction(first.wrapping_add(ray)), self.max_range_m, measure);
        }
        sweep.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::City;
    use super::super::route::level_pose;
    use super::*;

    #[test]
    fn rays_stay_in_the_cone_and_fill_it() {
        let lidar = SolidStateLidar::forward();
        let mut cells = std::collections::BTreeSet::new();
        let mut after_one_scan = 0;
        for ray in 0..240_000 {
            if ray == 24_000 {
                after_one_scan = cells.len();
            }
            let [x, y, z] = lidar.direction(ray);
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-12);
            let (azimuth_deg, elevation_deg) = (y.atan2(x) * 180.0 / PI, z.asin() * 180.0 / PI);
            let radius = (azimuth_deg / 35.0).hypot(elevation_deg / 12.5);
            assert!(radius < 1.0 + 1e-9, "{radius}");
            if radius < 0.99 {
                cells.insert(((azimuth_deg / 2.0).floor() as i32, elevation_deg.floor() as i32));
            }
        }
        // An ellipse of 35 x 25 cells has an area of 687.
        assert!((300..600).contains(&after_one_scan), "{after_one_scan}");
        assert!(cells.len() > 670, "{}", cells.len());
    }

    #[test]
    fn scans_do_not_repeat() {
        let lidar = SolidStateLidar { range_noise_m: 0.0, ..SolidStateLidar::forward() };
        let scan = |number| lidar.labelled_scan(&City::new(1), &level_pose([2.0, 30.0, 1.8], 1.5), 1, number);
        assert_eq!(scan(3), scan(3));
        assert_ne!(scan(3).scan.points, scan(4).scan.points);
    }

    #[test]
    fn extreme_and_invalid_settings_cause_no_panic() {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            let lidar = SolidStateLidar {
                rays: 3,
                cone_deg: [value; 2],
                turns_per_ray: [value; 2],
                max_range_m: value,
                range_noise_m: value,
            };
            lidar.labelled_scan(&City::new(1), &level_pose([value, 0.0, 1.0], 0.0), 1, u64::MAX);
        }
    }
}
