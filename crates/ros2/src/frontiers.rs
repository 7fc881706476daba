use anyhow::ensure;
use std::time::Duration;
use voxtile::Aabb;
use voxtile::space::Point;

/// Parameters of the published frontiers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frontiers {
    /// Interval between messages.
    pub every: Duration,
    /// Least area in square metres.
    pub min_area_m2: f64,
    /// Half of the box's edges in metres.
    pub reach_m: [f64; 3],
}

impl Frontiers {
    /// # Errors
    ///
    /// Lengths that are not positive and finite, a negative area, or an invalid duration.
    pub fn new(every_s: f64, min_area_m2: f64, radius_m: f64, height_m: f64) -> anyhow::Result<Self> {
        for (name, length_m) in [("frontier-radius", radius_m), ("frontier-height", height_m)] {
            let is_valid = length_m > 0.0 && length_m.is_finite();
            ensure!(is_valid, "--{name}: {length_m} is not a valid length; give metres above 0");
        }
        ensure!(
            min_area_m2 >= 0.0,
            "--frontier-min-area: {min_area_m2} is not a valid area; give square metres, 0 or more"
        );
        let every = Duration::try_from_secs_f64(every_s).map_err(|_| {
            anyhow::anyhow!("--frontier-every: {every_s} is not a valid duration; give seconds")
        })?;
        Ok(Self { every, min_area_m2, reach_m: [radius_m, radius_m, height_m] })
    }

    /// The box around the sensor.
    pub fn around(&self, sensor_m: Point) -> Aabb {
        Aabb {
            min: std::array::from_fn(|k| sensor_m[k] - self.reach_m[k]),
            max: std::array::from_fn(|k| sensor_m[k] + self.reach_m[k]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_parameters_name_their_option() {
        let refused = |every_s, area_m2, radius_m, height_m| {
            Frontiers::new(every_s, area_m2, radius_m, height_m).unwrap_err().to_string()
        };
        assert!(refused(-1.0, 0.0, 1.0, 1.0).starts_with("--frontier-every: -1 "));
        assert!(refused(1.0, f64::NAN, 1.0, 1.0).starts_with("--frontier-min-area: NaN "));
        assert!(refused(1.0, 0.0, 0.0, 1.0).starts_with("--frontier-radius: 0 "));
        assert!(refused(1.0, 0.0, 1.0, f64::INFINITY).starts_with("--frontier-height: inf "));
        let around = Frontiers::new(1.0, 0.0, 2.0, 0.5).unwrap().around([1.0, 0.0, 3.0]);
        assert_eq!(around, Aabb { min: [-1.0, -2.0, 2.5], max: [3.0, 2.0, 3.5] });
    }
}
