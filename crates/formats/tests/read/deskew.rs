use crate::support::clouds;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use voxtile::scan::Sweep;
use voxtile_formats::poses::{Found, Trajectory};
use voxtile_formats::{CloudPoint, RigidPose, SweepPeriods};

/// Start of the sweep: the stamp of the cloud.
const STAMP_NS: i64 = 1_700_000_000_250_000_000;
/// Duration of a turn of the scanner.
const TURN_S: f64 = 0.1;
const POINTS: usize = 2_000;
/// Walls, floor and ceiling.
const ROOM_M: [[f64; 2]; 3] = [[-6.0, 7.0], [-5.0, 4.0], [-1.5, 2.5]];
/// The body moves forward, up, and turns about its z: a constant twist.
const SPEED_M_S: f64 = 8.0;
const CLIMB_M_S: f64 = 0.5;
const TURN_RAD_S: f64 = 1.2;

/// Returns the pose of the sensor at a time after the stamp, in seconds.
fn world_from_sensor(time_s: f64) -> RigidPose {
    let angle = TURN_RAD_S * time_s;
    let radius_m = SPEED_M_S / TURN_RAD_S;
    let (sin, cos) = (0.5 * angle).sin_cos();
    RigidPose {
        position_m: [radius_m * angle.sin(), radius_m * (1.0 - angle.cos()), CLIMB_M_S * time_s],
        quaternion: [0.0, 0.0, sin, cos],
    }
}

/// Simulates the measurements: nanoseconds after the stamp, and the point in the sensor frame at that time.
fn sweep() -> Vec<(u32, [f64; 3])> {
    let point = |k: usize| {
        let after_ns = (TURN_S * 1e9 * k as f64 / POINTS as f64).round() as u32;
        let pose = world_from_sensor(f64::from(after_ns) * 1e-9);
        let azimuth = std::f64::consts::TAU * k as f64 / POINTS as f64;
        let elevation = (k % 16) as f64 * 0.05 - 0.4;
        let ray = [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        let tip = pose.apply(ray);
        // Distance along the ray to the nearest plane ahead.
        let length_m = (0..3).map(|axis| {
            let ahead = tip[axis] - pose.position_m[axis];
            (ROOM_M[axis][usize::from(ahead > 0.0)] - pose.position_m[axis]) / ahead
        });
        let length_m = length_m.filter(|length| *length > 0.0).fold(f64::INFINITY, f64::min);
        (after_ns, ray.map(|axis| axis * length_m))
    };
    (0..POINTS).map(point).collect()
}

/// Returns the distance of a point to the room's nearest plane.
fn plane_distance_m(point: [f64; 3]) -> f64 {
    let planes = point.iter().zip(ROOM_M).flat_map(|(at, planes)| planes.map(|plane| (at - plane).abs()));
    planes.fold(f64::INFINITY, f64::min)
}

/// Returns the largest distance of the points to the planes.
fn worst_m(points: &[CloudPoint], mut place: impl FnMut(&CloudPoint) -> [f64; 3]) -> f64 {
    let sensor = world_from_sensor(0.0);
    points.iter().map(|point| plane_distance_m(sensor.apply(place(point)))).fold(0.0, f64::max)
}

/// Returns the time of a point after the stamp.
fn after_ns(point: &CloudPoint) -> i64 {
    (point.time_s * 1e9).round() as i64
}

/// Returns the motion of the sensor during these points.
fn sweep_of(points: &[CloudPoint], pose_at: impl FnMut(i64) -> Option<RigidPose>) -> Sweep {
    let mut periods = SweepPeriods::default();
    points.iter().for_each(|point| periods.add(after_ns(point)));
    periods.sweep(STAMP_NS, &world_from_sensor(0.0), pose_at).unwrap()
}

fn assert_deskews(points: &[CloudPoint], pose_at: impl FnMut(i64) -> Option<RigidPose>, of: &str) {
    assert_eq!(points.len(), POINTS, "{of}");
    let sweep = sweep_of(points, pose_at);
    let mut to_stamp = sweep.to_stamp();
    let (skewed_m, deskewed_m) = (
        worst_m(points, |point| point.position_m),
        worst_m(points, |point| to_stamp.apply(point.position_m, after_ns(point))),
    );
    assert!(points.iter().all(|point| sweep.covers(after_ns(point))), "{of}");
    assert!(skewed_m > 0.3, "{of}: without deskewing, points are only {skewed_m} m off");
    assert!(deskewed_m < 5e-5, "{of}: {deskewed_m} m off");
}

/// Creates a pose file with a pose every two milliseconds.
fn trajectory(folder: &Path) -> Trajectory {
    let mut text = String::new();
    for k in -10..80 {
        let after_ns = 2_000_000 * k;
        let RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] } =
            world_from_sensor(after_ns as f64 * 1e-9);
        let stamp_ns = STAMP_NS + after_ns;
        let (seconds, ns) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
        writeln!(text, "{seconds}.{ns:09} {x} {y} {z} {qx} {qy} {qz} {qw}").unwrap();
    }
    let path = folder.join("poses_tum.txt");
    fs::write(&path, text).unwrap();
    Trajectory::read(&path, None).unwrap()
}

fn in_file(trajectory: &Trajectory, at_ns: i64) -> Option<RigidPose> {
    match trajectory.at(at_ns, 10_000_000).unwrap() {
        Found::Exact(pose) | Found::Between(pose) => Some(pose),
        _ => None,
    }
}

/// Name of a time field, its PLY type, and its encoding of nanoseconds after the stamp.
type PlyTime = (&'static str, &'static str, fn(u32) -> Vec<u8>);

#[test]
fn every_ply_time_field_deskews() {
    let times: [PlyTime; 6] = [
        ("t", "uint", |ns| ns.to_le_bytes().to_vec()),
        ("offset_time", "uint32", |ns| ns.to_le_bytes().to_vec()),
        ("time", "float", |ns| ((f64::from(ns) * 1e-9) as f32).to_le_bytes().to_vec()),
        ("scalar_time", "double", |ns| (f64::from(ns) * 1e-9).to_le_bytes().to_vec()),
        ("timestamp", "double", |ns| ((STAMP_NS + i64::from(ns)) as f64 * 1e-9).to_le_bytes().to_vec()),
        ("timestamp", "uint64", |ns| (STAMP_NS as u64 + u64::from(ns)).to_le_bytes().to_vec()),
    ];
    let folder = tempfile::tempdir().unwrap();
    let trajectory = trajectory(folder.path());
    let path = folder.path().join(format!("{STAMP_NS}.ply"));
    for (name, kind, bytes) in times {
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty {kind} {name}\nproperty double x\n\
             property double y\nproperty double z\nend_header\n"
        )
        .into_bytes();
        for (ns, place) in sweep() {
            file.extend(bytes(ns));
            file.extend(place.map(f64::to_le_bytes).as_flattened());
        }
        fs::write(&path, file).unwrap();
        let (head, points) = clouds(&path).remove(0);
        assert_eq!((head.stamp_ns, head.has_times), (Some(STAMP_NS), true));
        assert_deskews(&points, |at_ns| in_file(&trajectory, at_ns), &format!("{kind} {name}"));
    }
}

/// Name of a time column, and its text for nanoseconds after the stamp.
type TextTime = (&'static str, fn(u32) -> String);

#[test]
fn every_text_time_column_deskews() {
    let times: [TextTime; 6] = [
        ("t[ns]", |ns| ns.to_string()),
        ("offset_time", |ns| ns.to_string()),
        ("time_us", |ns| format!("{}", f64::from(ns) * 1e-3)),
        ("time", |ns| format!("{}", f64::from(ns) * 1e-9)),
        ("timestamp", |ns| format!("{}.{:09}", STAMP_NS / 1_000_000_000, 250_000_000 + ns)),
        ("timestamp_ns", |ns| format!("{}", STAMP_NS + i64::from(ns))),
    ];
    let folder = tempfile::tempdir().unwrap();
    let trajectory = trajectory(folder.path());
    let path = folder.path().join(format!("{STAMP_NS}.csv"));
    for (name, time) in times {
        let mut text = format!("x,y,z,{name}\n");
        for (ns, [x, y, z]) in sweep() {
            writeln!(text, "{x},{y},{z},{}", time(ns)).unwrap();
        }
        fs::write(&path, text).unwrap();
        let (_, points) = clouds(&path).remove(0);
        assert_deskews(&points, |at_ns| in_file(&trajectory, at_ns), name);
    }
}

/// A cloud may last a second, and the poses may end before it does.
#[test]
fn points_far_from_the_stamp_move_and_those_without_a_pose_are_counted() {
    let last_ns = STAMP_NS + 2_000_500_000;
    let pose_at =
        |at_ns: i64| (at_ns <= last_ns).then(|| world_from_sensor((at_ns - STAMP_NS) as f64 * 1e-9));
    let known_s = [-5.0, -0.301, 0.4, 1.7, 2.0, 2.000_25];
    let unknown_s = [2.000_75, 9.0, 1e300, -1e300];
    let point = |time_s: f64| CloudPoint { time_s, ..CloudPoint::hit([3.0, 1.0, 0.0]) };
    let points: Vec<_> = known_s.iter().chain(&unknown_s).map(|time_s| point(*time_s)).collect();
    let sweep = sweep_of(&points, pose_at);
    let place = |time_s: f64| sweep.to_stamp().apply([3.0, 1.0, 0.0], after_ns(&point(time_s)));
    for time_s in known_s {
        let wanted = world_from_sensor(time_s).apply([3.0, 1.0, 0.0]);
        let found = place(time_s);
        assert!((0..3).all(|k| (found[k] - wanted[k]).abs() < 5e-5), "{time_s} s: {found:?}, not {wanted:?}");
    }
    for time_s in unknown_s {
        assert_eq!(place(time_s), [3.0, 1.0, 0.0], "{time_s} s");
        assert!(!sweep.covers(after_ns(&point(time_s))));
    }
    // Other poses at the same times.
    let again = SweepPeriods::of(&sweep).sweep(STAMP_NS, &world_from_sensor(0.0), pose_at).unwrap();
    assert_eq!(again, sweep);
}

#[cfg(feature = "ros")]
mod recordings {
    use super::*;
    use crate::made::bag1::{BagMessage, bag1};
    use crate::made::message::{F32, F64, Field, MessageWriter, U32};
    use voxtile_formats::CloudSource;
    use voxtile_formats::ros::{BagOptions, open_bag};

    /// Writes a sweep and its transforms to a bag and deskews it.
    fn assert_bag_deskews(type_name: &str, cloud: Vec<u8>, of: &str) {
        let mut messages: Vec<BagMessage> = Vec::new();
        for k in -10..80 {
            let after_ns = 2_000_000 * k;
            let RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] } =
                world_from_sensor(after_ns as f64 * 1e-9);
            let stamp_ns = STAMP_NS + after_ns;
            let tf = MessageWriter::ros1().tf(stamp_ns, "map", "lidar", &[x, y, z, qx, qy, qz, qw]);
            messages.push((0, stamp_ns, tf));
        }
        messages.push((1, STAMP_NS, cloud));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bag");
        fs::write(&path, bag1(&[("/tf", "tf2_msgs/TFMessage"), ("/points", type_name)], &messages)).unwrap();
        let mut source = open_bag(&[path], &BagOptions::default()).unwrap();
        let head = source.next_cloud().unwrap().unwrap();
        assert_eq!((head.stamp_ns, head.has_times), (Some(STAMP_NS), true), "{of}");
        let mut points = Vec::new();
        let read = source.read_points(&mut |point| {
            points.push(point);
            Ok(())
        });
        read.unwrap();
        let pose_at = source.poses().unwrap();
        assert_deskews(&points, |stamp_ns| pose_at(stamp_ns).unwrap(), of);
    }

    /// Time field, and its encoding of nanoseconds after the stamp.
    type MessageTime = (Field, fn(u32) -> Vec<u8>);

    #[test]
    fn every_message_time_field_deskews() {
        let times: [MessageTime; 5] = [
            (("t", 12, U32), |ns| ns.to_le_bytes().to_vec()),
            (("offset_time", 12, U32), |ns| ns.to_le_bytes().to_vec()),
            (("time", 12, F32), |ns| ((f64::from(ns) * 1e-9) as f32).to_le_bytes().to_vec()),
            (("timestamp", 12, F64), |ns| ((STAMP_NS + i64::from(ns)) as f64 * 1e-9).to_le_bytes().to_vec()),
            (("timestamp", 12, F64), |ns| ((STAMP_NS + i64::from(ns)) as f64).to_le_bytes().to_vec()),
        ];
        for (field, bytes) in times {
            let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), field];
            let point = |(ns, place): (u32, [f64; 3])| {
                let place = place.map(|axis| (axis as f32).to_le_bytes());
                [place.as_flattened(), &bytes(ns)].concat()
            };
            let points: Vec<Vec<u8>> = sweep().into_iter().map(point).collect();
            let cloud = MessageWriter::ros1().point_cloud2(STAMP_NS, "lidar", &fields, &points);
            assert_bag_deskews("sensor_msgs/PointCloud2", cloud, &format!("{field:?}"));
        }
    }

    /// Drivers without a clock leave the cloud's stamp at 0, while its points have times of another clock.
    #[test]
    fn absolute_times_need_no_message_stamp() {
        let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("timestamp", 12, F64)];
        let point = |(ns, place): (u32, [f64; 3])| {
            let place = place.map(|axis| (axis as f32).to_le_bytes());
            let time = ((STAMP_NS + i64::from(ns)) as f64 * 1e-9).to_le_bytes();
            [place.as_flattened(), &time].concat()
        };
        let points: Vec<Vec<u8>> = sweep().into_iter().map(point).collect();
        let cloud = MessageWriter::ros1().point_cloud2(0, "lidar", &fields, &points);
        assert_bag_deskews("sensor_msgs/PointCloud2", cloud, "points");
        let head = MessageWriter::ros1().header(0, "lidar").number(STAMP_NS.to_le_bytes());
        let head = head.u32(POINTS as u32).number([0, 0, 0, 0]).u32(POINTS as u32);
        let message = sweep().into_iter().fold(head, |message, (ns, place)| {
            message.u32(ns).f32s(&place.map(|axis| axis as f32)).number([9, 0, 0])
        });
        assert_bag_deskews("livox_ros_driver/CustomMsg", message.done(), "livox");
    }

    /// The time base equals the stamp, or precedes it if the driver sets the stamp when it sends the cloud.
    #[test]
    fn times_of_livox_count_from_their_time_base() {
        for before_ns in [0, 20_000_000] {
            let (sweep, base_ns) = (sweep(), STAMP_NS - before_ns);
            let head = MessageWriter::ros1().header(STAMP_NS, "lidar").number(base_ns.to_le_bytes());
            let head = head.u32(POINTS as u32).number([0, 0, 0, 0]).u32(POINTS as u32);
            let message = sweep.into_iter().fold(head, |message, (ns, place)| {
                let message = message.u32(ns + before_ns as u32).f32s(&place.map(|axis| axis as f32));
                message.number([9, 0, 0])
            });
            let of = format!("livox, {before_ns} ns before");
            assert_bag_deskews("livox_ros_driver/CustomMsg", message.done(), &of);
        }
    }
}
