use super::scan_chain::{hash_attributes, hash_set};
use super::sensor_scan::SensorScan;
use voxtile::scan::Pose;

/// Content hash and horizontal extent of a scan. A build in shards needs them for every scan in advance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanReach {
    /// Hash of points, intensities, attributes and pose, to the last bit.
    pub content: [u8; 16],
    /// Minimum and maximum x and y of the sensor and of all ray ends, in metres in the world frame, up to rounding.
    /// `None` if no ray affects the map.
    pub bounds: Option<[[f64; 2]; 2]>,
}

impl ScanReach {
    /// Computes the reach of a scan. Rays are cut at `max_range_m`; rays without a return are cut at
    /// `no_return_range_m`, or ignored if it is `None`.
    pub fn of(scan: &SensorScan, max_range_m: Option<f64>, no_return_range_m: Option<f64>) -> Self {
        let pose = &scan.world_from_sensor;
        Self { content: content_of(scan), bounds: bounds_of(scan, pose, max_range_m, no_return_range_m) }
    }
}

fn content_of(scan: &SensorScan) -> [u8; 16] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(scan.points_in_sensor.len() as u64).to_le_bytes());
    hasher.update(bytemuck::cast_slice(&scan.points_in_sensor));
    hasher.update(bytemuck::cast_slice(scan.intensities.as_deref().unwrap_or_default()));
    let pose = &scan.world_from_sensor;
    for number in pose.position_m().into_iter().chain(pose.quaternion()) {
        hasher.update(&number.to_le_bytes());
    }
    if !scan.attributes.set().is_none() {
        hash_set(&mut hasher, scan.attributes.set());
        hash_attributes(&mut hasher, scan.attributes.part(0..scan.points_in_sensor.len()));
    }
    let mut content = [0; 16];
    hasher.finalize_xof().fill(&mut content);
    content
}

fn bounds_of(
    scan: &SensorScan,
    pose: &Pose,
    max_range_m: Option<f64>,
    no_return_range_m: Option<f64>,
) -> Option<[[f64; 2]; 2]> {
    let to_world = pose.to_world();
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &point in &scan.points_in_sensor {
        let [x, y, _] = to_world(point);
        if x.is_finite() && y.is_finite() {
            (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
        }
    }
    let [x, y, _] = pose.position_m();
    let has_ends = low[0] <= high[0];
    if !has_ends && no_return_range_m.is_none() {
        return None;
    }
    let around = |origin: f64, low: f64, high: f64| {
        let (mut ends, mut bounds) = ([low, high], [origin, origin]);
        if let Some(range) = max_range_m {
            // `clamp` would panic for a NaN range.
            ends = ends.map(|end| end.max(origin - range).min(origin + range));
        }
        if has_ends {
            bounds = ends;
        }
        let cleared = no_return_range_m.unwrap_or(0.0);
        [bounds[0].min(origin - cleared), bounds[1].max(origin + cleared)]
    };
    let [[west, east], [south, north]] = [around(x, low[0], high[0]), around(y, low[1], high[1])];
    Some([[west, south], [east, north]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use voxtile::scan::PointAttributes;

    fn scan(points: Vec<[f64; 3]>, pose: Pose) -> SensorScan {
        SensorScan {
            name: String::new(),
            points_in_sensor: points,
            intensities: None,
            attributes: PointAttributes::default(),
            world_from_sensor: pose,
        }
    }

    /// Computes every ray end separately, as the mapper does.
    fn ends(scan: &SensorScan, max_range_m: Option<f64>, no_return_range_m: Option<f64>) -> Vec<[f64; 2]> {
        let [x, y, z] = scan.world_from_sensor.position_m();
        let mut ends = Vec::new();
        for &point in &scan.points_in_sensor {
            let end = scan.world_from_sensor.to_world()(point);
            let ray = [end[0] - x, end[1] - y, end[2] - z];
            let length = ray.iter().map(|d| d * d).sum::<f64>().sqrt();
            if length.is_finite() && length > 0.0 {
                let share = max_range_m.map_or(1.0, |range| (range / length).min(1.0));
                ends.push([x + ray[0] * share, y + ray[1] * share]);
            }
        }
        if let Some(range) = no_return_range_m {
            ends.extend([[x - range, y - range], [x + range, y + range]]);
        }
        ends
    }

    proptest! {
        #[test]
        fn all_ray_ends_are_within_reach(
            points in prop::collection::vec(prop::array::uniform3(-90.0_f64..90.0), 0..40),
            position in prop::array::uniform3(-500.0_f64..500.0),
            quaternion in prop::array::uniform4(0.1_f64..1.0),
            max_range in prop::option::of(1.0_f64..80.0),
            no_return_range in prop::option::of(1.0_f64..80.0),
            bad in 0_usize..60,
        ) {
            let mut points = points;
            if let Some(point) = points.get_mut(bad) {
                point[bad % 3] = [f64::NAN, f64::INFINITY][bad % 2];
            }
            let scan = scan(points, Pose::from_quaternion(position, quaternion).unwrap());
            let reach = ScanReach::of(&scan, max_range, no_return_range);
            let ends = ends(&scan, max_range, no_return_range);
            prop_assert_eq!(reach.bounds.is_none(), ends.is_empty());
            if let Some([low, high]) = reach.bounds {
                for k in 0..2 {
                    let sides = ends.iter().map(|end| end[k]).chain([position[k]]);
                    let (lowest, highest) =
                        sides.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
                    prop_assert!(low[k] <= lowest + 1e-9 && high[k] >= highest - 1e-9);
                    // Where no range cuts rays, the bounds are exactly those of the ray ends.
                    if max_range.is_none() {
                        prop_assert!(low[k] >= lowest - 1e-9 && high[k] <= highest + 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn scans_differing_in_one_bit_have_different_hashes() {
        let pose = |x| Pose::from_quaternion([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let content = |scan: &SensorScan| ScanReach::of(scan, None, None).content;
        let one = scan(vec![[1.0, 2.0, 3.0]], pose(0.0));
        let mut others = vec![
            scan(vec![[1.0, 2.0, -3.0]], pose(0.0)),
            scan(vec![[1.0, 2.0, 3.0]], pose(0.5)),
            scan(vec![[1.0, 2.0, 3.0]; 2], pose(0.0)),
        ];
        others.push(SensorScan { intensities: Some(vec![1.0]), ..scan(vec![[1.0, 2.0, 3.0]], pose(0.0)) });
        for attributes in [
            PointAttributes { colours: vec![None], ..PointAttributes::default() },
            PointAttributes { colours: vec![Some([0; 3])], ..PointAttributes::default() },
            PointAttributes { classes: vec![Some(0)], ..PointAttributes::default() },
        ] {
            others.push(SensorScan { attributes, ..scan(vec![[1.0, 2.0, 3.0]], pose(0.0)) });
        }
        assert_eq!(content(&one), content(&scan(vec![[1.0, 2.0, 3.0]], pose(0.0))));
        assert!(others.iter().all(|other| content(other) != content(&one)));
        // Invalid ranges are reported elsewhere, when the map is created; here they must not panic.
        for range in [f64::NAN, -1.0, f64::INFINITY] {
            ScanReach::of(&one, Some(range), Some(range));
        }
    }
}
