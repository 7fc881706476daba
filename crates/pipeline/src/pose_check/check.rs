use super::overlap::{Counted, RANGE_M, overlap};
use super::reading::{Pick, Reading};
use std::path::{Path, PathBuf};
use voxtile::scan::ScanPoints as _;
use voxtile::{Error, Result};
use voxtile_formats::{PoseSource, ReadOptions, RigidPose, StoredScan};

/// Number of scans to compare.
const MAX_PICKS: usize = 10;
/// Minimum motion between compared scans, in voxels or degrees. Scans closer together have nearly the same view.
const STEP_VOXELS: f64 = 7.5;
const STEP_DEGREES: f64 = 20.0;
/// Edge of a voxel as a fraction of the median range, clamped to limits in metres. Indoor scans give smaller voxels.
const VOXEL_SHARE: f64 = 0.05;
const VOXEL_M: [f64; 2] = [0.1, 0.4];
/// Maximum number of points to use per scan.
const MAX_POINTS: usize = 1 << 14;
/// With more points in all scans together, only a quarter of the voxels is counted.
const MANY_POINTS: usize = 50_000;
/// Larger scans are from stationary scanners and are excluded, because reading them twice takes long.
const MAX_SCAN_POINTS: usize = 1 << 21;

/// Overlap above which poses are accepted.
const ENOUGH: f64 = 0.75;
/// Overlap that correct poses reach for nearby scans.
const EXPECTED: f64 = 0.5;
/// Factor by which another interpretation of the poses must improve the odds of the overlap to be reported. In real
/// data sets, correct poses always had better odds than other interpretations; for wrong poses, the right
/// interpretation improved the odds by a factor of at least 2.2.
const BETTER_ODDS: f64 = 2.0;
/// Interpretations whose overlaps differ by at most this are equivalent; the more likely one is preferred.
const TIE: f64 = 0.05;
/// Overlap below which scans count as disjoint, for example because positions in millimetres were read as metres.
const NO_OVERLAP: f64 = 0.2;
/// Minimum improvement over the overlap of the same scans without any motion.
const THAN_STILL: f64 = 0.1;
/// Limits for the speed of a sensor (m/s) and for the distance between stations (m).
const TOO_FAST: f64 = 300.0;
const TOO_FAR_M: f64 = 500.0;

/// Reason to doubt the poses.
#[derive(Clone, Debug)]
pub struct Doubt {
    input: PathBuf,
    reason: String,
}

impl Doubt {
    /// Returns the doubt as a remark for the user.
    pub fn remark(&self) -> String {
        format!("{}: {}", self.input.display(), self.reason)
    }

    /// Returns the doubt as an error.
    pub fn refusal(&self) -> Error {
        let reason = format!("{}; without `strict` the scans are mapped nevertheless", self.reason);
        Error::argument(self.input.display().to_string(), reason)
    }
}

/// Check of poses by the overlap of some of the first scans.
pub struct PoseCheck {
    /// Name of the input in messages.
    input: PathBuf,
    mount: RigidPose,
    others: Vec<Reading>,
    picks: Vec<Pick>,
    last: Option<RigidPose>,
    voxel_m: f64,
    is_done: bool,
}

impl PoseCheck {
    /// Creates a check for poses from this source. Returns `None` if the poses do not move the points.
    pub fn of(options: &ReadOptions, source: &PoseSource, scans: &Path) -> Option<Self> {
        let input = match source {
            PoseSource::File(path) => path.clone(),
            PoseSource::Scans | PoseSource::Viewpoint => scans.to_owned(),
            PoseSource::Identity | PoseSource::Missing => return None,
        };
        (!options.clouds.is_world_frame && options.sensor_origin_m.is_none()).then(|| Self {
            input,
            mount: options.clouds.body_from_sensor,
            others: Reading::others(source, options.calib.is_some()),
            picks: Vec::new(),
            last: None,
            voxel_m: VOXEL_M[1],
            is_done: false,
        })
    }

    /// Returns whether no more scans are needed.
    pub fn is_done(&self) -> bool {
        self.is_done
    }

    /// Adds the next scan. When there are enough scans, returns the doubt about the poses, if any.
    ///
    /// # Errors
    ///
    /// Points cannot be read.
    pub fn take(&mut self, scan: &StoredScan) -> Result<Option<Doubt>> {
        if self.is_done {
            return Ok(None);
        }
        if scan.len() > MAX_SCAN_POINTS {
            self.end();
            return Ok(None);
        }
        let pose = &scan.world_from_sensor;
        let sensor = RigidPose { position_m: pose.position_m(), quaternion: pose.quaternion() };
        let body = sensor.then(&self.mount.inverse());
        let before = self.last.replace(body).unwrap_or(body);
        if let Some(pick) = self.picks.last_mut() {
            pick.after.get_or_insert(body);
            if self.picks.len() == MAX_PICKS {
                return self.finish();
            }
        }
        let step_m = STEP_VOXELS * self.voxel_m;
        if self.picks.last().is_none_or(|pick| is_step(&pick.own, &body, step_m)) {
            let points = sample(scan)?;
            if self.picks.is_empty() {
                self.voxel_m = voxel_of(&points);
            }
            self.picks.push(Pick { points, stamp_ns: scan.stamp_ns, before, own: body, after: None });
        }
        Ok(None)
    }

    /// Compares the scans added so far.
    ///
    /// # Errors
    ///
    /// A pose is invalid.
    pub fn finish(&mut self) -> Result<Option<Doubt>> {
        let doubt = if self.is_done { Ok(None) } else { self.doubt() };
        self.end();
        doubt
    }

    fn end(&mut self) {
        (self.is_done, self.picks) = (true, Vec::new());
    }

    fn overlap(&self, reading: Reading) -> Result<Option<f64>> {
        let placed: Result<Vec<_>> = self.picks.iter().map(|pick| reading.place(pick, &self.mount)).collect();
        let points: usize = self.picks.iter().map(|pick| pick.points.len()).sum();
        let counted = if points > MANY_POINTS { Counted::Quarter } else { Counted::All };
        Ok(overlap(placed?.into_iter(), self.voxel_m, counted))
    }

    fn doubt(&self) -> Result<Option<Doubt>> {
        let Some(given) = self.overlap(Reading::Given)? else { return Ok(None) };
        log::debug!("{}: overlap of scans {given:.2}", self.input.display());
        if given >= ENOUGH {
            return Ok(None);
        }
        let mut best: Option<(Reading, f64)> = None;
        for &reading in &self.others {
            let Some(share) = self.overlap(reading)? else { continue };
            log::debug!("{}: overlap as {reading:?} {share:.2}", self.input.display());
            if share >= EXPECTED
                && odds(share) >= BETTER_ODDS * odds(given)
                && best.is_none_or(|(_, best)| share > best + TIE)
                && self.is_plausible(reading, given, share)?
            {
                best = Some((reading, share));
            }
        }
        Ok(best.map(|(reading, share)| {
            let [given, share] = [given, share].map(|share| (100.0 * share).round());
            let advice = reading.advice();
            let reason = format!(
                "the poses do not seem to fit the scans: scans overlap the previous ones by {given} %, and would \
                 overlap by {share} % if {advice}"
            );
            Doubt { input: self.input.clone(), reason }
        }))
    }

    /// Returns whether an interpretation may be reported. For wrong units and the world frame, a better overlap is not
    /// sufficient, because streets and plains look alike everywhere.
    fn is_plausible(&self, reading: Reading, given: f64, share: f64) -> Result<bool> {
        match reading {
            Reading::Millimetres | Reading::Centimetres => {
                let still = self.overlap(Reading::Still)?.unwrap_or(0.0);
                Ok(given < NO_OVERLAP && (share >= still + THAN_STILL || self.is_too_fast()))
            }
            Reading::WorldFrame => Ok(self.points_move_along()),
            _ => Ok(true),
        }
    }

    /// Returns whether half of the steps exceed the speed or distance limit.
    fn is_too_fast(&self) -> bool {
        let pairs = || self.picks.windows(2);
        let is_too_fast = |pair: &[Pick]| {
            let [a, b] = pair else { return false };
            let step_m = distance_m(&a.own, &b.own);
            let Some((from_ns, to_ns)) = a.stamp_ns.zip(b.stamp_ns) else { return step_m > TOO_FAR_M };
            let seconds = from_ns.abs_diff(to_ns) as f64 * 1e-9;
            step_m > TOO_FAR_M || (step_m > TOO_FAST * seconds && seconds > 0.0)
        };
        2 * pairs().filter(|pair| is_too_fast(pair)).count() > pairs().count()
    }

    /// Returns whether the points' centre moves with the sensor, as it does for points in the world frame.
    fn points_move_along(&self) -> bool {
        let Some(first) = self.picks.first() else { return false };
        let (middle, [mut along, mut all]) = (middle_of(&first.points), [0.0; 2]);
        for pick in &self.picks {
            let now = middle_of(&pick.points);
            for k in 0..3 {
                let step = pick.own.position_m[k] - first.own.position_m[k];
                along += step * (now[k] - middle[k]);
                all += step * step;
            }
        }
        (0.6..1.4).contains(&(along / all))
    }
}

fn odds(share: f64) -> f64 {
    share / (1.0 - share).max(1e-3)
}

fn distance_m(a: &RigidPose, b: &RigidPose) -> f64 {
    a.position_m.iter().zip(b.position_m).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn is_step(from: &RigidPose, to: &RigidPose, step_m: f64) -> bool {
    let cosine: f64 = from.quaternion.iter().zip(to.quaternion).map(|(a, b)| a * b).sum();
    let turned = 2.0 * cosine.abs().min(1.0).acos();
    distance_m(from, to) >= step_m || turned.to_degrees() >= STEP_DEGREES
}

/// Returns a suitable voxel edge for a scan.
fn voxel_of(points: &[[f32; 3]]) -> f64 {
    let range = |point: &[f32; 3]| point.iter().map(|c| f64::from(*c) * f64::from(*c)).sum::<f64>().sqrt();
    let mut ranges: Vec<f64> = points.iter().map(range).filter(|range| RANGE_M.contains(range)).collect();
    ranges.sort_unstable_by(f64::total_cmp);
    let [min_m, max_m] = VOXEL_M;
    ranges.get(ranges.len() / 2).map_or(max_m, |median| (VOXEL_SHARE * median).clamp(min_m, max_m))
}

/// Returns the median of each coordinate.
fn middle_of(points: &[[f32; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let mut values: Vec<f32> = points.iter().map(|point| point[k]).collect();
        values.sort_unstable_by(f32::total_cmp);
        values.get(values.len() / 2).copied().map_or(0.0, f64::from)
    })
}

/// Returns evenly distributed points of a scan.
fn sample(scan: &StoredScan) -> Result<Vec<[f32; 3]>> {
    let every = scan.len().div_ceil(MAX_POINTS).max(1);
    let (mut points, mut skip) = (Vec::with_capacity(scan.len().div_ceil(every)), 0);
    scan.for_each_own_chunk(0..scan.len(), &mut |chunk, _| {
        let own = chunk.iter().skip(skip).step_by(every);
        let finite = own.filter(|point| point.iter().all(|c| c.is_finite()));
        points.extend(finite.map(|point| point.map(|coordinate| coordinate as f32)));
        skip = (skip + every - chunk.len() % every) % every;
        true
    })?;
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::scan::Pose;
    use voxtile_formats::PointStore;

    /// Returns the points of a yard with walls and posts at irregular places.
    fn world() -> Vec<[f64; 3]> {
        let mut next = 7_u64;
        let mut random = move || {
            next = next.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (next >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut points = Vec::new();
        for _ in 0..60 {
            let (x, y, turn) = (70.0 * random() - 20.0, 50.0 * random() - 25.0, 3.2 * random());
            for k in 0..(20 + (60.0 * random()) as i32) {
                for height in 0..10 {
                    let along = 0.2 * f64::from(k);
                    points.push([
                        x + along * turn.cos(),
                        y + along * turn.sin(),
                        0.25 * f64::from(height) - 1.5,
                    ]);
                }
            }
        }
        points
    }

    /// Returns a trajectory with bends and this step length.
    fn trajectory(step_m: f64) -> Vec<RigidPose> {
        (0..12)
            .map(|k| {
                let s = step_m * f64::from(k);
                let yaw = 0.5 * (s / 6.0).sin() + 0.02 * s;
                let quaternion = [0.0, 0.0, (yaw / 2.0).sin(), (yaw / 2.0).cos()];
                RigidPose { position_m: [s, 2.0 * (s / 5.0).sin(), 0.1], quaternion }
            })
            .collect()
    }

    /// Returns the remark of the check for scans with these poses.
    fn doubt_for(
        scan: impl Fn(usize) -> Vec<[f64; 3]>,
        poses: &[RigidPose],
        options: &ReadOptions,
        every_s: i64,
    ) -> Option<String> {
        let file = PoseSource::File("poses.txt".into());
        let mut check = PoseCheck::of(options, &file, Path::new("scans")).unwrap();
        let mut doubt = None;
        for (number, pose) in poses.iter().enumerate() {
            let mut points_in_sensor = PointStore::default();
            points_in_sensor.begin(false);
            scan(number).into_iter().for_each(|point| points_in_sensor.push(point, 0.0).unwrap());
            let world_from_sensor = Pose::from_quaternion(pose.position_m, pose.quaternion).unwrap();
            let stamp_ns = Some(1_000_000_000 * every_s * number as i64);
            let scan = StoredScan { name: String::new(), stamp_ns, points_in_sensor, world_from_sensor };
            doubt = doubt.or(check.take(&scan).unwrap());
        }
        doubt.or(check.finish().unwrap()).map(|doubt| doubt.remark())
    }

    /// Returns the points seen from a pose, in the sensor frame.
    fn seen(world: &[[f64; 3]], pose: &RigidPose) -> Vec<[f64; 3]> {
        let own = world.iter().map(|point| pose.inverse().apply(*point));
        own.filter(|own| own.iter().map(|c| c * c).sum::<f64>() < 400.0).collect()
    }

    #[test]
    fn better_readings_are_reported() {
        let (world, right) = (world(), trajectory(2.0));
        let scan = |number: usize| seen(&world, &right[number]);
        let each = |change: &dyn Fn(&RigidPose) -> RigidPose| right.iter().map(change).collect::<Vec<_>>();
        let camera = RigidPose { position_m: [0.0; 3], quaternion: [0.5, -0.5, 0.5, 0.5] };
        let (plain, calib) =
            (ReadOptions::default(), ReadOptions { calib: Some("calib.txt".into()), ..Default::default() });
        let w_first = each(&|pose| {
            let RigidPose { position_m, quaternion: [x, y, z, w] } = *pose;
            RigidPose { position_m, quaternion: [w, x, y, z] }
        });
        let millimetres = each(&|pose| RigidPose { position_m: pose.position_m.map(|c| 1e3 * c), ..*pose });
        let cases = [
            (right.clone(), &plain, ""),
            (right.clone(), &calib, ""),
            (w_first, &plain, "start with w"),
            (each(&RigidPose::inverse), &plain, "they are the inverse"),
            (each(&|pose| camera.then(pose).then(&camera.inverse())), &plain, "poses of a camera"),
            (each(&|pose| camera.inverse().then(pose).then(&camera)), &calib, "omit `calib`"),
            (millimetres, &plain, "are in millimetres"),
        ];
        for (come, options, wanted) in cases {
            let doubt_for = doubt_for(scan, &come, options, 1).unwrap_or_default();
            assert!(
                doubt_for.contains(wanted) && doubt_for.is_empty() == wanted.is_empty(),
                "{wanted}: {doubt_for}"
            );
            assert!(
                doubt_for.is_empty() || doubt_for.starts_with("poses.txt: the poses do not seem to fit"),
                "{doubt_for}"
            );
        }
        let in_world = |number: usize| scan(number).into_iter().map(|own| right[number].apply(own)).collect();
        let doubt_in_world = doubt_for(in_world, &right, &plain, 1).unwrap_or_default();
        assert!(doubt_in_world.contains("`world_frame`"), "{doubt_in_world}");
        // The sensor's pose in the body is the same in all interpretations.
        let extrinsic = RigidPose { position_m: [0.1, 0.0, 0.2], quaternion: [0.0, 0.0, 1.0, 0.0] };
        let mut mounted = ReadOptions::default();
        mounted.clouds.body_from_sensor = extrinsic;
        let sensor = each(&|pose| pose.then(&extrinsic));
        let scan = |number: usize| seen(&world, &sensor[number]);
        assert_eq!(doubt_for(scan, &sensor, &mounted, 1), None);
        let inverse = each(&|pose| pose.inverse().then(&extrinsic));
        assert!(
            doubt_for(scan, &inverse, &mounted, 1).is_some_and(|doubt_for| doubt_for.contains("the inverse"))
        );
    }

    /// Flat ground looks the same from every station, so the overlap would be best with all stations at one place.
    #[test]
    fn distant_stations_cause_no_doubt() {
        let ground: Vec<[f64; 3]> = (0..120)
            .flat_map(|ring| {
                (0..120).map(move |beam| (1.5 + 0.15 * f64::from(ring), 0.0524 * f64::from(beam)))
            })
            .map(|(range, angle): (f64, f64)| [range * angle.cos(), range * angle.sin(), -1.5])
            .collect();
        for step_m in [15.0, 30.0, 60.0] {
            let options = ReadOptions::default();
            assert_eq!(doubt_for(|_| ground.clone(), &trajectory(step_m), &options, 60), None, "{step_m}");
        }
        // These poses are wrong, but that cannot be detected.
        let far: Vec<RigidPose> = trajectory(60.0).iter().map(RigidPose::inverse).collect();
        assert_eq!(doubt_for(|_| ground.clone(), &far, &ReadOptions::default(), 60), None);
        // A speed of 2 km/s is implausible.
        let fast = doubt_for(|_| ground.clone(), &trajectory(2000.0), &ReadOptions::default(), 1);
        assert!(fast.is_some_and(|doubt_for| doubt_for.contains("are in millimetres")));
    }

    #[test]
    fn points_are_sampled_evenly() {
        let mut points_in_sensor = PointStore::default();
        points_in_sensor.begin(false);
        (0..3 * MAX_POINTS + 5).for_each(|k| points_in_sensor.push([k as f64, 0.0, 0.0], 0.0).unwrap());
        let world_from_sensor = Pose::identity();
        let scan = StoredScan { name: String::new(), stamp_ns: None, points_in_sensor, world_from_sensor };
        let points = sample(&scan).unwrap();
        assert!(points.iter().enumerate().all(|(k, point)| point[0] == 4.0 * k as f32), "{}", points.len());
        assert!(points.len() <= MAX_POINTS && points.len() > MAX_POINTS / 2);
    }
}
