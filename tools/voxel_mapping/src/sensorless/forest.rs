use super::robots::Sensing;
use voxtile::Scan;
use voxtile::space::Point;
use voxtile_simulation::{Random, Scene, Solid};

/// Random trees and walls of bushes on 120 m x 30 m, low enough to be seen from above.
pub struct Forest {
    pub trees: Vec<Solid>,
    scene: Scene,
    seed: u64,
}

pub const LENGTH_M: f64 = 120.0;
pub const WIDTH_M: f64 = 30.0;
const TREES: u32 = 220;
const MIN_DISTANCE_M: f64 = 2.6;

impl Forest {
    pub fn new(seed: u64) -> Self {
        let mut random = Random::of(seed, &[8]);
        let mut middles: Vec<[f64; 2]> = Vec::new();
        for _ in 0..TREES {
            let at = [random.between(4.0, LENGTH_M - 4.0), random.between(-0.5, 0.5) * WIDTH_M];
            if middles.iter().all(|other| (at[0] - other[0]).hypot(at[1] - other[1]) >= MIN_DISTANCE_M) {
                middles.push(at);
            }
        }
        let tree = |[x, y]: [f64; 2]| {
            let half_m = random.between(0.2, 0.5);
            let across_m = if random.chance(0.15) { random.between(1.0, 3.0) } else { half_m };
            let height_m = random.between(4.5, 7.0);
            Solid::new([x - half_m, y - across_m, 0.0], [x + half_m, y + across_m, height_m], 0.4)
        };
        let trees: Vec<Solid> = middles.into_iter().map(tree).collect();
        let scene = Scene::new(trees.clone(), 0.2, [LENGTH_M / 2.0, 0.0, 0.0], LENGTH_M);
        Self { trees, scene, seed }
    }

    /// Scan by a sensor that looks along x, tilted down.
    pub fn scan(&self, sensing: Sensing, origin: Point, number: u64) -> Scan {
        let mut noise = Random::of(self.seed, &[9, number as i64]);
        let (sin, cos) = sensing.pitch_deg.to_radians().sin_cos();
        let mut points = Vec::new();
        for column in 0..sensing.rays[0] {
            for row in 0..sensing.rays[1] {
                let angle = |axis: usize, k: u32| {
                    let part = (f64::from(k) + noise.between(0.0, 1.0)) / f64::from(sensing.rays[axis]) - 0.5;
                    (sensing.view_deg[axis] * part).to_radians()
                };
                let mut angle = angle;
                let (azimuth, elevation) = (angle(0, column), angle(1, row));
                let flat = elevation.cos();
                let ahead = [flat * azimuth.cos(), flat * azimuth.sin(), elevation.sin()];
                let direction = [cos * ahead[0] + sin * ahead[2], ahead[1], cos * ahead[2] - sin * ahead[0]];
                let error_m = 0.02 * noise.bell();
                if let Some(hit) = self.scene.cast(origin, direction, sensing.range_m) {
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
