use super::{DepthCamera, Drive, LabelledScan, Lidar, Route, Sensor, SolidStateLidar, Stroll, Traffic};

/// A sensor on a route through traffic: labelled scans, generated one at a time. Scan k is taken at k / rate seconds.
///
/// The iterator yields scans without end (use `take`); [`Recording::scan_at`] and `nth` return any scan without
/// generating earlier ones.
///
/// ```
/// use voxtile_simulation::{Label, Recording};
///
/// // 20 seconds of a drive: some parked cars leave in this time.
/// let mut recording = Recording::spinning(1, 20.0);
/// let last = recording.scan_at(199);
/// assert_eq!(last.labels.len(), last.scan.points.len());
/// assert!(last.labels.contains(&Label::Moving));
/// ```
#[derive(Clone, Debug)]
pub struct Recording<R, S> {
    traffic: Traffic,
    route: R,
    sensor: S,
    rate_hz: f64,
    seed: u64,
    next: u64,
}

impl<R: Route, S: Sensor> Recording<R, S> {
    /// Returns a recording with `rate_hz` scans per second (1 if that is not a positive number). `seed` is the seed of
    /// the sensor's noise.
    ///
    /// A route with steps of `v / rate_hz` metres gives a sensor with a speed of v.
    pub fn new(traffic: Traffic, route: R, sensor: S, rate_hz: f64, seed: u64) -> Self {
        let rate_hz = if rate_hz > 0.0 && rate_hz.is_finite() { rate_hz } else { 1.0 };
        Self { traffic, route, sensor, rate_hz, seed, next: 0 }
    }

    /// Returns the world.
    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    /// Returns the scan of a step of the route, from 0.
    pub fn scan_at(&mut self, index: u64) -> LabelledScan {
        let world_from_sensor = self.route.pose(index);
        let moment = self.traffic.at(index as f64 / self.rate_hz);
        self.sensor.labelled_scan(&moment, &world_from_sensor, self.seed, index)
    }
}

/// Scans per second of the sensors.
const RATE_HZ: f64 = 10.0;

/// Recordings with ten scans per second, in which some parked cars leave in the first `departures_s` seconds.
impl Recording<Drive, Lidar> {
    /// Returns scans of [`Lidar::street`] on a car that drives straight ahead with 8 m/s.
    pub fn spinning(seed: u64, departures_s: f64) -> Self {
        Self::new(Traffic::new(seed, departures_s), straight_ahead(), Lidar::street(), RATE_HZ, seed)
    }
}

/// Recordings with ten scans per second, in which some parked cars leave in the first `departures_s` seconds.
impl Recording<Drive, SolidStateLidar> {
    /// Returns scans of [`SolidStateLidar::forward`] on a car that drives straight ahead with 8 m/s.
    pub fn solid_state(seed: u64, departures_s: f64) -> Self {
        Self::new(
            Traffic::new(seed, departures_s),
            straight_ahead(),
            SolidStateLidar::forward(),
            RATE_HZ,
            seed,
        )
    }
}

/// Recordings with ten scans per second, in which some parked cars leave in the first `departures_s` seconds.
impl Recording<Stroll, DepthCamera> {
    /// Returns images of [`DepthCamera::robot`] on a robot that walks around a block with 1.25 m/s.
    pub fn camera(seed: u64, departures_s: f64) -> Self {
        let route = Stroll::new(Traffic::WALKER_MPS / RATE_HZ);
        Self::new(Traffic::new(seed, departures_s), route, DepthCamera::robot(), RATE_HZ, seed)
    }
}

/// Returns a drive without turns at the speed of the traffic.
fn straight_ahead() -> Drive {
    Drive::laps(u64::MAX, Traffic::CAR_MPS / RATE_HZ)
}

impl<R: Route, S: Sensor> Iterator for Recording<R, S> {
    type Item = LabelledScan;

    fn next(&mut self) -> Option<LabelledScan> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<LabelledScan> {
        let index = self.next.saturating_add(skipped as u64);
        self.next = index.saturating_add(1);
        Some(self.scan_at(index))
    }
}

#[cfg(test)]
mod tests {
    use super::super::solid::Ray;
    use super::super::{Label, World};
    use super::*;
    use std::collections::BTreeMap;

    fn count(scan: &LabelledScan, label: Label) -> usize {
        scan.labels.iter().filter(|&&other| other == label).count()
    }

    fn check_repeats<R: Route, S: Sensor>(of: impl Fn(u64) -> Recording<R, S>) {
        let sequence: Vec<LabelledScan> = of(5).take(12).collect();
        let mut recording = of(5);
        for index in [11, 0, 7, 6] {
            assert_eq!(recording.scan_at(index), sequence[index as usize]);
        }
        assert_eq!(of(5).nth(9), Some(sequence[9].clone()));
        assert_ne!(of(6).scan_at(9), sequence[9]);
        for scan in &sequence {
            assert_eq!(scan.labels.len(), scan.scan.points.len());
            assert!(scan.scan.points.len() > 5_000, "{}", scan.scan.points.len());
        }
    }

    #[test]
    fn a_seed_gives_the_same_scans_and_scan_at_equals_the_iterator() {
        check_repeats(|seed| Recording::spinning(seed, 20.0));
        check_repeats(|seed| Recording::solid_state(seed, 20.0));
        check_repeats(|seed| Recording::camera(seed, 20.0));
    }

    #[test]
    fn a_seed_gives_the_same_labelled_scans_on_every_platform() {
        let scans = [
            Recording::spinning(1, 20.0).scan_at(17),
            Recording::solid_state(1, 20.0).scan_at(17),
            Recording::camera(1, 20.0).scan_at(17),
        ];
        let digests = scans.map(|labelled| {
            let mut hasher = blake3::Hasher::new();
            for (point, label) in labelled.scan.points.iter().zip(&labelled.labels) {
                point.iter().for_each(|number| {
                    hasher.update(&number.to_bits().to_le_bytes());
                });
                hasher.update(&[label.number()]);
            }
            hasher.finalize().to_hex()[..16].to_owned()
        });
        // Recorded on x86-64 Linux.
        assert_eq!(digests, ["259247cf87fa93b4", "e81b91df53df379f", "76ef760467101f67"]);
    }

    #[test]
    fn labels_are_those_of_the_nearest_box() {
        let mut recording = Recording::spinning(2, 20.0);
        recording.sensor = Lidar { range_noise_m: 0.0, beams: 16, rays_per_beam: 256, ..Lidar::street() };
        let mut counts = BTreeMap::new();
        for index in [0, 30, 77] {
            let scan = recording.scan_at(index);
            let scene = recording.traffic.at(index as f64 / 10.0).scene(scan.scan.origin, 60.0);
            for (point, label) in scan.scan.points.iter().zip(&scan.labels) {
                let direction = std::array::from_fn(|k| point[k] - scan.scan.origin[k]);
                let ray = Ray::new(scan.scan.origin, direction).expect("a direction");
                let hits =
                    scene.solids().iter().filter_map(|solid| Some((solid.contact(&ray)?.distance_m, solid)));
                let ground_m = -ray.origin[2] / ray.direction[2];
                let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
                let expected = match nearest {
                    Some((distance_m, solid)) if ground_m < 0.0 || distance_m < ground_m => solid.label,
                    _ => Label::Static,
                };
                // Boxes of one object may touch those of another within rounding.
                assert_eq!(*label, expected, "{point:?}");
                *counts.entry(label.number()).or_insert(0) += 1;
            }
        }
        assert_eq!(counts.into_keys().collect::<Vec<_>>(), [0, 1, 2, 3]);
    }

    #[test]
    fn the_points_of_a_mover_move_with_it() {
        // Sensor at rest; cars pass it with 8 m/s along x.
        let traffic = Traffic::new(1, 0.0);
        let sensor = Lidar { range_noise_m: 0.0, beams: 24, rays_per_beam: 512, ..Lidar::street() };
        let pose = super::super::route::level_pose([30.0, 7.3, 1.8], 0.0);
        let mut moved = 0;
        for step in 0..100 {
            let time_s = f64::from(step) * 0.3;
            let [before, after] = [time_s, time_s + 0.05].map(|time_s| {
                let scan = sensor.labelled_scan(&traffic.at(time_s), &pose, 1, 0);
                let of_lane = scan.scan.points.into_iter().zip(scan.labels).filter(|(p, label)| {
                    // Rear ends of vehicles in the right lane, ahead of the sensor.
                    *label == Label::Moving && (-3.2..-0.8).contains(&p[1]) && (31.0..50.0).contains(&p[0])
                });
                of_lane.map(|(p, _)| p[0]).fold(f64::INFINITY, f64::min)
            });
            if before.is_finite() && before > 32.0 && after.is_finite() && after < 49.0 && after > before {
                assert!((after - before - 0.4).abs() < 0.1, "{before} {after}");
                moved += 1;
            }
        }
        assert!(moved > 5, "{moved}");
    }

    #[test]
    fn departing_cars_have_points_before_and_none_after() {
        let mut recording = Recording::spinning(1, 4.0);
        let counts: Vec<usize> =
            (0..80).step_by(8).map(|k| count(&recording.scan_at(k), Label::Departing)).collect();
        assert!(counts[0] > 100, "{counts:?}");
        assert!(counts[5..].iter().all(|&count| count == 0), "{counts:?}");
    }

    #[test]
    fn every_sensor_sees_all_labels() {
        fn check<R: Route, S: Sensor>(recording: Recording<R, S>, name: &str) {
            let mut counts = BTreeMap::new();
            for scan in recording.step_by(20).take(10) {
                for label in scan.labels {
                    *counts.entry(label.number()).or_insert(0_usize) += 1;
                }
            }
            assert!((0..4).all(|label| counts.get(&label).is_some_and(|&n| n > 500)), "{name}: {counts:?}");
        }
        check(Recording::spinning(1, 20.0), "spinning");
        check(Recording::solid_state(1, 20.0), "solid-state");
        check(Recording::camera(1, 20.0), "camera");
    }
}
