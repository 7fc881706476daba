use clap::ValueEnum;
use voxtile_simulation::{LabelledScan, Recording};

/// Sensor of a recording with moving objects; ten scans per second.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SensorName {
    /// Lidar on a car, 64 beams of 1024 rays, up to 60 m; 8 m/s
    Spinning,
    /// Lidar on a car, 24 000 rays in a cone of 70 x 25 degrees ahead, up to 100 m; 8 m/s
    SolidState,
    /// Depth camera on the pavement, 160 x 120 pixels, 0.3 to 10 m, noise 1.5 mm x (depth / 1 m)^2; 1.25 m/s
    Camera,
}

impl SensorName {
    /// Scans per second of all sensors.
    pub const RATE_HZ: f64 = 10.0;

    /// Endless iterator over the scans of a recording. Some parked cars leave in the first `departures_s` seconds. The
    /// same seed gives the same scans on every platform.
    pub fn scans(self, seed: u64, departures_s: f64) -> Box<dyn Iterator<Item = LabelledScan>> {
        match self {
            Self::Spinning => Box::new(Recording::spinning(seed, departures_s)),
            Self::SolidState => Box::new(Recording::solid_state(seed, departures_s)),
            Self::Camera => Box::new(Recording::camera(seed, departures_s)),
        }
    }
}
