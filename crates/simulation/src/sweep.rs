use super::{Hit, Label, LabelledScan, Random, Scene, World};
use nalgebra::Matrix3;
use voxtile::scan::{Pose, Scan};
use voxtile::space::Point;

/// Scan in progress: casts rays into the scene around a sensor and collects the points.
pub(super) struct Sweep {
    scene: Scene,
    world_from_sensor: Pose,
    origin: Point,
    rotation: Matrix3<f64>,
    noise: Random,
    points: Vec<Point>,
    intensities: Vec<f32>,
    labels: Vec<Label>,
}

impl Sweep {
    /// Starts a scan whose rays are at most `max_range_m` metres long.
    pub fn new(
        world: &impl World,
        world_from_sensor: &Pose,
        max_range_m: f64,
        seed: u64,
        scan_number: u64,
    ) -> Self {
        let origin = world_from_sensor.position_m();
        Self {
            scene: world.scene(origin, max_range_m),
            world_from_sensor: *world_from_sensor,
            origin,
            rotation: *world_from_sensor.isometry().rotation.to_rotation_matrix().matrix(),
            noise: Random::of(seed, &[scan_number as i64]),
            points: Vec::new(),
            intensities: Vec::new(),
            labels: Vec::new(),
        }
    }

    /// Casts a ray along a unit vector in the sensor frame and returns whether it hits an object within `max_range_m`
    /// metres.
    ///
    /// `measure` returns the measured distance, given the true one in metres and a random number with mean 0 and
    /// deviation 1; `None` drops the point.
    pub fn fire(
        &mut self,
        d: Point,
        max_range_m: f64,
        measure: impl FnOnce(f64, f64) -> Option<f64>,
    ) -> bool {
        let r = &self.rotation;
        let direction: Point =
            std::array::from_fn(|i| r[(i, 0)] * d[0] + r[(i, 1)] * d[1] + r[(i, 2)] * d[2]);
        // Draw the noise also for rays without a hit, so that a ray's noise does not depend on the hits of other rays.
        let bell = self.noise.bell();
        let Some(hit) = self.scene.cast(self.origin, direction, max_range_m) else { return false };
        if let Some(measured_m) = measure(hit.distance_m, bell) {
            let point = std::array::from_fn(|k| self.origin[k] + direction[k] * measured_m);
            self.push(point, intensity(&hit), hit.label);
        }
        true
    }

    /// Adds a point at the sensor's position, which reports a ray without a hit.
    pub fn push_miss(&mut self) {
        self.push(self.origin, 0.0, Label::Nothing);
    }

    fn push(&mut self, point: Point, intensity: f32, label: Label) {
        self.points.push(point);
        self.intensities.push(intensity);
        self.labels.push(label);
    }

    pub fn finish(self) -> LabelledScan {
        let scan = Scan { origin: self.origin, points: self.points, intensities: Some(self.intensities) };
        LabelledScan { scan, labels: self.labels, world_from_sensor: self.world_from_sensor }
    }
}

/// Returns the intensity as an integer from 0 to 255, which decreases with range and grazing angle.
fn intensity(hit: &Hit) -> f32 {
    let distance = hit.distance_m / 40.0;
    let echo = hit.reflectivity * (0.5 + 0.5 * hit.cos_incidence) / (1.0 + distance * distance);
    // Near and bright surfaces saturate, as in a real lidar.
    (400.0 * echo + 0.5).floor().clamp(0.0, 255.0) as f32
}
