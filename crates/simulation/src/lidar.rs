use super::sweep::Sweep;
use super::{LabelledScan, Sensor, World};
use std::f64::consts::PI;
use voxtile::maths;
use voxtile::scan::{Pose, Scan};

/// Spinning lidar: beams at fixed elevations, each fired at equal angles over a full turn.
///
/// Sensor frame: x ahead, y left, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lidar {
    /// Number of beams.
    pub beams: u32,
    /// Number of rays of each beam per turn.
    pub rays_per_beam: u32,
    /// Elevation of the lowest and the highest beam in degrees, positive upwards; the others are evenly spaced.
    pub elevation_deg: [f64; 2],
    /// Maximum range in metres, at most [`Scene::MAX_RADIUS_M`](super::Scene::MAX_RADIUS_M).
    pub max_range_m: f64,
    /// Standard deviation of the range noise in metres; 0 for exact ranges.
    pub range_noise_m: f64,
    /// Whether a ray without a hit returns a point at the sensor's position. Maps count such points and ignore them.
    pub reports_misses: bool,
}

impl Lidar {
    /// Returns the lidar of the *street* workload: 64 beams of 1024 rays. In a [`City`](super::City) its mean range is
    /// about 12 m.
    pub fn street() -> Self {
        Self {
            beams: 64,
            rays_per_beam: 1024,
            elevation_deg: [-28.0, 8.0],
            max_range_m: 60.0,
            range_noise_m: 0.02,
            reports_misses: false,
        }
    }

    /// Returns the lidar of the *indoor* workload: 90 000 rays. In a [`Building`](super::Building) its mean range is
    /// about 2.3 m.
    pub fn indoor() -> Self {
        Self {
            beams: 100,
            rays_per_beam: 900,
            elevation_deg: [-70.0, 70.0],
            max_range_m: 20.0,
            range_noise_m: 0.01,
            reports_misses: false,
        }
    }

    /// Returns a small lidar for demos: 16 beams of 360 rays.
    pub fn demo() -> Self {
        Self { beams: 16, rays_per_beam: 360, max_range_m: 40.0, ..Self::street() }
    }

    /// Returns the street lidar with about `rays` rays per turn (at least 1): 64 beams from 32 768 rays, 32 beams from
    /// 4096, else 16.
    pub fn of_rays(rays: u32) -> Self {
        let beams = match rays {
            32_768.. => 64,
            4_096.. => 32,
            _ => 16,
        };
        Self { beams, rays_per_beam: (rays.saturating_add(beams / 2) / beams).max(1), ..Self::street() }
    }

    /// Returns a lidar with about `rays` rays per turn for a mast of height [`Lidar::MAST_M`]. It looks down on the
    /// city, up to [`Scene::MAX_RADIUS_M`](super::Scene::MAX_RADIUS_M).
    pub fn mast(rays: u32) -> Self {
        Self { elevation_deg: [-40.0, -4.0], max_range_m: super::Scene::MAX_RADIUS_M, ..Self::of_rays(rays) }
    }

    /// Height of the mast of [`Lidar::mast`] above the ground, in metres: above all roofs.
    pub const MAST_M: f64 = 50.0;

    /// Returns the scan from a pose: points in the world frame, intensities from 0 to 255.
    ///
    /// Points are ordered by angle, with all beams of one angle together. The noise depends on `seed` and
    /// `scan_number`, so two scans from the same pose differ.
    pub fn scan(&self, world: &impl World, world_from_sensor: &Pose, seed: u64, scan_number: u64) -> Scan {
        self.labelled_scan(world, world_from_sensor, seed, scan_number).scan
    }

    /// Returns sine and cosine of a beam's elevation.
    fn elevation(&self, beam: u32) -> (f64, f64) {
        let [low, high] = self.elevation_deg;
        let share = if self.beams > 1 { f64::from(beam) / f64::from(self.beams - 1) } else { 0.5 };
        maths::sin_cos((low + (high - low) * share) * (PI / 180.0))
    }
}

impl Sensor for Lidar {
    fn labelled_scan(
        &self,
        world: &impl World,
        world_from_sensor: &Pose,
        seed: u64,
        scan_number: u64,
    ) -> LabelledScan {
        let mut sweep = Sweep::new(world, world_from_sensor, self.max_range_m, seed, scan_number);
        let elevations: Vec<(f64, f64)> = (0..self.beams).map(|beam| self.elevation(beam)).collect();
        for column in 0..self.rays_per_beam {
            let azimuth_rad = 2.0 * PI * f64::from(column) / f64::from(self.rays_per_beam);
            let (sin_azimuth, cos_azimuth) = maths::sin_cos(azimuth_rad);
            for &(up, flat) in &elevations {
                let direction = [flat * cos_azimuth, flat * sin_azimuth, up];
                let measure =
                    |distance_m: f64, bell: f64| Some((distance_m + self.range_noise_m * bell).max(0.0));
                if !sweep.fire(direction, self.max_range_m, measure) && self.reports_misses {
                    sweep.push_miss();
                }
            }
        }
        sweep.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::route::level_pose;
    use super::super::{Building, City};
    use super::*;
    use voxtile::space::Point;

    #[test]
    fn without_noise_every_point_lies_on_a_surface() {
        let lidar = Lidar { range_noise_m: 0.0, beams: 8, ..Lidar::street() };
        let pose = level_pose([2.0, 30.0, 1.8], 1.2);
        let scan = lidar.scan(&City::new(3), &pose, 1, 0);
        let scene = super::super::World::scene(&City::new(3), scan.origin, 90.0);
        assert!(scan.points.len() > 3_000);
        for point in &scan.points {
            let box_m = scene.solids().iter().map(|solid| solid.bounds.distance_squared(*point).sqrt());
            let nearest_m = box_m.fold(point[2].abs(), f64::min);
            assert!(nearest_m < 1e-9, "{point:?} is {nearest_m} m from any surface");
        }
    }

    #[test]
    fn rays_without_a_hit_give_a_point_only_on_request() {
        let lidar = Lidar { elevation_deg: [80.0, 90.0], beams: 4, ..Lidar::street() };
        let pose = level_pose([0.0, 0.0, 1.8], 0.0);
        let city = City::new(3);
        assert_eq!(lidar.scan(&city, &pose, 1, 0).points, Vec::<Point>::new());
        let scan = Lidar { reports_misses: true, ..lidar }.scan(&city, &pose, 1, 0);
        assert_eq!(scan.points, vec![scan.origin; 4 * 1024]);
    }

    #[test]
    fn intensities_are_integers_of_a_byte_and_vary() {
        let scan = Lidar::indoor().scan(&Building::new(3), &level_pose([2.0, 10.0, 1.4], 0.0), 1, 0);
        let intensities = scan.intensities.expect("a lidar has intensities");
        assert_eq!(intensities.len(), scan.points.len());
        assert!(intensities.iter().all(|i| (0.0..=255.0).contains(i) && i.fract() == 0.0));
        let bright = intensities.iter().filter(|&&i| i > 100.0).count();
        assert!(bright > intensities.len() / 10 && bright < intensities.len());
    }

    #[test]
    fn a_lidar_has_about_the_requested_number_of_rays() {
        for rays in [0, 1, 100, 4_000, 8_000, 65_536, 1_000_000] {
            let lidar = Lidar::of_rays(rays);
            let has = lidar.beams * lidar.rays_per_beam;
            assert!(has.abs_diff(rays) <= lidar.beams, "{has} for {rays}");
        }
        assert_eq!(Lidar::of_rays(u32::MAX).beams, 64);
    }

    #[test]
    fn extreme_and_invalid_settings_cause_no_panic() {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            let lidar = Lidar {
                beams: 1,
                rays_per_beam: 3,
                elevation_deg: [value; 2],
                max_range_m: value,
                range_noise_m: value,
                ..Lidar::demo()
            };
            lidar.scan(&City::new(1), &level_pose([value, 0.0, 1.0], 0.0), 1, 0);
        }
        let nothing = Lidar { beams: 0, ..Lidar::demo() };
        assert!(nothing.scan(&City::new(1), &level_pose([0.0, 0.0, 1.0], 0.0), 1, 0).points.is_empty());
    }
}
