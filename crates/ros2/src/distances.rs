use anyhow::ensure;
use std::time::Duration;
use voxtile::Aabb;
use voxtile::space::Point;
use voxtile_distance::DistanceOptions;

/// Parameters of the distance field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distances {
    /// Interval between messages.
    pub every: Duration,
    /// Cap in metres.
    pub max_distance_m: f64,
    /// Half of the box's edges in metres.
    pub reach_m: [f64; 3],
}

impl Distances {
    /// # Errors
    ///
    /// Lengths or a duration that are not positive and finite.
    pub fn new(every_s: f64, max_distance_m: f64, radius_m: f64, height_m: f64) -> anyhow::Result<Self> {
        for (name, length_m) in
            [("distance-max", max_distance_m), ("distance-radius", radius_m), ("distance-height", height_m)]
        {
            let is_valid = length_m > 0.0 && length_m.is_finite();
            ensure!(is_valid, "--{name}: {length_m} is not a valid length; give metres above 0");
        }
        let every = Duration::try_from_secs_f64(every_s).map_err(|_| {
            anyhow::anyhow!("--distance-every: {every_s} is not a valid duration; give seconds")
        })?;
        Ok(Self { every, max_distance_m, reach_m: [radius_m, radius_m, height_m] })
    }

    /// Options of the field. Unknown voxels remain unknown.
    pub fn options(&self) -> DistanceOptions {
        DistanceOptions::new(self.max_distance_m)
    }

    /// The edges of the box.
    pub fn size_m(&self) -> [f64; 3] {
        self.reach_m.map(|reach_m| 2.0 * reach_m)
    }

    /// The box around the sensor.
    pub fn around(&self, sensor_m: Point) -> Aabb {
        Aabb {
            min: std::array::from_fn(|k| sensor_m[k] - self.reach_m[k]),
            max: std::array::from_fn(|k| sensor_m[k] + self.reach_m[k]),
        }
    }
}
