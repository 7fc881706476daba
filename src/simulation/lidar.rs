use super::random::normal;
use super::scene::World;
use crate::maths::sin_cos;
use crate::scan::Scan;
use crate::space::Point;
use nalgebra::{Isometry3, Vector3};

/// A spinning lidar: beams at fixed elevations, each with so many rays a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lidar {
    /// Number of beams, one above the other.
    pub beams: u32,
    /// Rays of each beam a turn.
    pub rays_per_beam: u32,
    /// Elevation of the lowest beam in degrees.
    pub lowest_deg: f64,
    /// Elevation of the highest beam in degrees.
    pub highest_deg: f64,
    /// Nothing farther than this is seen, in metres.
    pub max_range_m: f64,
    /// Standard deviation of a measured range, in metres.
    pub range_noise_m: f64,
}

impl Lidar {
    /// A small one for a first look: 32 beams of 512 rays.
    pub fn demo() -> Self {
        Self { beams: 32, rays_per_beam: 512, lowest_deg: -25.0, highest_deg: 30.0, ..Self::street() }
    }

    /// 64 beams of 1024 rays, on a car in a street.
    pub fn street() -> Self {
        Self {
            beams: 64,
            rays_per_beam: 1024,
            lowest_deg: -22.5,
            highest_deg: 16.5,
            max_range_m: 100.0,
            range_noise_m: 0.01,
        }
    }

    /// 90 000 rays in every direction but straight up and down, carried through a building.
    pub fn indoor() -> Self {
        Self {
            beams: 90,
            rays_per_beam: 1000,
            lowest_deg: -60.0,
            highest_deg: 60.0,
            max_range_m: 50.0,
            range_noise_m: 0.005,
        }
    }

    /// What the lidar sees at a pose, in the world frame, intensities from 0 to 255. Rays that meet nothing give no
    /// point. `noise_seed` decides the noise.
    pub fn scan(&self, world: &impl World, world_from_sensor: &Isometry3<f64>, noise_seed: u64) -> Scan {
        let origin: Point = world_from_sensor.translation.vector.into();
        let scene = world.scene(origin, self.max_range_m);
        let mut scan = Scan { origin, points: Vec::new(), intensities: None };
        let mut intensities = Vec::new();
        let elevations: Vec<_> = (0..self.beams).map(|beam| sin_cos(self.elevation_rad(beam))).collect();
        for ray in 0..self.rays_per_beam {
            let azimuth_rad = std::f64::consts::TAU * f64::from(ray) / f64::from(self.rays_per_beam);
            let (sin_azimuth, cos_azimuth) = sin_cos(azimuth_rad);
            for (beam, &(sin_elevation, cos_elevation)) in elevations.iter().enumerate() {
                let in_sensor =
                    Vector3::new(cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation);
                let direction: Point = (world_from_sensor.rotation * in_sensor).into();
                let Some(echo) = scene.cast(origin, direction, self.max_range_m) else { continue };
                let noise_m = self.range_noise_m * normal(noise_seed, i64::from(ray), beam as i64);
                let range_m = echo.distance_m + noise_m;
                scan.points.push(std::array::from_fn(|k| origin[k] + direction[k] * range_m));
                let fading = 1.0 / (1.0 + echo.distance_m / 40.0);
                intensities
                    .push((255.0 * echo.reflectivity * echo.incidence_cos.sqrt() * fading).round() as f32);
            }
        }
        scan.intensities = Some(intensities);
        scan
    }

    fn elevation_rad(&self, beam: u32) -> f64 {
        let share = f64::from(beam) / f64::from(self.beams.max(2) - 1);
        (self.lowest_deg + (self.highest_deg - self.lowest_deg) * share) * (std::f64::consts::PI / 180.0)
    }
}

/// The scans of an endless drive through a world, one a metre.
pub fn scans<W: World>(world: &W, lidar: Lidar, seed: u64) -> impl Iterator<Item = Scan> {
    (0..).map(move |number| scan_at(world, lidar, seed, number))
}

/// Scan `number` of the drive that [`scans`] makes, without those before it.
pub fn scan_at(world: &impl World, lidar: Lidar, seed: u64, number: u64) -> Scan {
    let noise_seed = seed.wrapping_mul(0x1000_0000_01b3).wrapping_add(number);
    lidar.scan(world, &world.pose_at(number as f64), noise_seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{Building, City};

    fn digest(scan: &Scan) -> String {
        let mut hasher = blake3::Hasher::new();
        scan.points.iter().flatten().for_each(|coordinate| {
            hasher.update(&coordinate.to_bits().to_le_bytes());
        });
        hasher.finalize().to_hex()[..16].to_owned()
    }

    fn mean_range_m(scan: &Scan) -> f64 {
        let range = |p: &Point| (0..3).map(|k| (p[k] - scan.origin[k]).powi(2)).sum::<f64>().sqrt();
        scan.points.iter().map(range).sum::<f64>() / scan.points.len() as f64
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
        let third = |seed| scan_at(&City::new(seed), Lidar::demo(), seed, 3);
        assert_eq!(digest(&third(1)), "3f8b0b4901c6233a");
        assert_ne!(digest(&third(1)), digest(&third(2)));
        let in_sequence = scans(&City::new(1), Lidar::demo(), 1).take(4).last().unwrap();
        assert_eq!(third(1), in_sequence);
    }

    #[test]
    fn ranges_are_those_of_a_street_and_of_rooms() {
        let mean = |ranges: Vec<f64>| ranges.iter().sum::<f64>() / ranges.len() as f64;
        let city = City::new(1);
        let street =
            mean((0..4).map(|k| mean_range_m(&scan_at(&city, Lidar::street(), 1, k * 15))).collect());
        assert!((10.0..14.0).contains(&street), "{street} m");
        let building = Building::new(1);
        let indoor =
            mean((0..5).map(|k| mean_range_m(&scan_at(&building, Lidar::indoor(), 1, k * 9))).collect());
        assert!((2.0..2.7).contains(&indoor), "{indoor} m");
    }

    #[test]
    fn the_way_is_clear_of_every_solid_and_goes_on_without_a_jump() {
        fn check(world: &impl World, metres: u32) {
            let place = |metre: u32| -> Point { world.pose_at(f64::from(metre)).translation.vector.into() };
            for metre in 0..metres {
                let here = place(metre);
                assert!(!world.scene(here, 1.0).is_inside(here), "{here:?}");
                let step: f64 = (0..3).map(|k| (place(metre + 1)[k] - here[k]).abs()).sum();
                assert!(step < 1.5, "{step} m at {metre}");
            }
        }
        check(&City::new(3), 3000);
        check(&Building::new(3), 300);
    }
}
