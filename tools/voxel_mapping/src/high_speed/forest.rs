use voxtile::Scan;
use voxtile::space::Point;
use voxtile_simulation::{Random, Scene, Solid};

/// Random trees and thickets on 200 m x 35 m.
pub struct Forest {
    pub trees: Vec<Solid>,
    scene: Scene,
    seed: u64,
}

pub const LENGTH_M: f64 = 200.0;
pub const WIDTH_M: f64 = 35.0;
/// Start and goal of the flights.
pub const START: Point = [-6.0, 0.0, 2.0];
pub const GOAL: Point = [206.0, 0.0, 2.0];

/// Trees per square metre.
const DENSITY: f64 = 0.07;
/// Share of the trees that are thickets.
const THICKETS: f64 = 0.15;
/// Minimum distance between the centers of two trees.
const MIN_DISTANCE_M: f64 = 2.4;
/// Sensor of the paper.
const RANGE_M: f64 = 40.0;
const VIEW_DEG: [f64; 2] = [60.0, 45.0];
const RAYS: [u32; 2] = [120, 40];

impl Forest {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::of(seed, &[3]);
        let mut middles: Vec<[f64; 2]> = Vec::new();
        for _ in 0..(LENGTH_M * WIDTH_M * DENSITY) as usize {
            let at = [random.between(0.0, LENGTH_M), random.between(-0.5, 0.5) * WIDTH_M];
            let is_apart = |other: &[f64; 2]| (at[0] - other[0]).hypot(at[1] - other[1]) >= MIN_DISTANCE_M;
            if middles.iter().all(is_apart) {
                middles.push(at);
            }
        }
        let tree = |[x, y]: [f64; 2]| {
            let half_m = random.between(0.15, 0.45);
            // A thicket extends across the flight direction.
            let is_thicket = random.chance(THICKETS) && x > 10.0;
            let across_m = if is_thicket { random.between(1.0, 4.0) } else { half_m };
            Solid::new([x - half_m, y - across_m, 0.0], [x + half_m, y + across_m, 20.0], 0.4)
        };
        let trees: Vec<Solid> = middles.into_iter().map(tree).collect();
        let scene = Scene::new(trees.clone(), 0.2, [LENGTH_M / 2.0, 0.0, 0.0], LENGTH_M);
        Self { trees, scene, seed }
    }

    /// Scan by the sensor, looking along `yaw_rad`.
    pub fn scan(&self, origin: Point, yaw_rad: f64, number: u64) -> Scan {
        let mut noise = Random::of(self.seed, &[4, number as i64]);
        let mut points = Vec::new();
        for column in 0..RAYS[0] {
            for row in 0..RAYS[1] {
                let angle = |axis: usize, k: u32| {
                    (VIEW_DEG[axis] * ((f64::from(k) + 0.5) / f64::from(RAYS[axis]) - 0.5)).to_radians()
                };
                let (azimuth, elevation) = (yaw_rad + angle(0, column), angle(1, row));
                let flat = elevation.cos();
                let direction = [flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()];
                let error_m = 0.02 * noise.bell();
                if let Some(hit) = self.scene.cast(origin, direction, RANGE_M) {
                    let distance_m = (hit.distance_m + error_m).max(0.0);
                    points.push(std::array::from_fn(|k| origin[k] + direction[k] * distance_m));
                }
            }
        }
        Scan { origin, points, intensities: None }
    }

    /// Returns whether a ball touches a tree or the ground.
    pub fn collides(&self, center: Point, radius_m: f64) -> bool {
        let touches = |tree: &Solid| tree.bounds.distance_squared(center) <= radius_m * radius_m;
        center[2] <= radius_m || self.trees.iter().any(touches)
    }
}
