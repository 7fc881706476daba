use crate::made::bag1::{BagMessage, bag1};
use crate::made::message::{F32, MessageWriter};
use crate::support::{Cloud, read};
use std::path::PathBuf;
use tempfile::TempDir;
use voxtile_formats::ros::{BagOptions, PoseSource};
use voxtile_formats::{ReadOptions, open_scans};

const START_NS: i64 = 1_700_000_000_000_000_000;
const CLOUD: &str = "sensor_msgs/PointCloud2";
const ODOMETRY: &str = "nav_msgs/Odometry";
const TF: &str = "tf2_msgs/TFMessage";

/// Messages recorded ten times a second for half a second. The sensor is at x = 0, 1, ...
enum Recorded {
    /// Clouds in this frame, each with one point at x = 100 and y = number of the cloud.
    Clouds(&'static str),
    /// Odometry of the second frame in the first.
    Odometry(&'static str, &'static str),
    Tf(&'static str, &'static str),
    /// A constant transform.
    Still(&'static str, &'static str),
    Pose(&'static str),
}
use Recorded::{Clouds, Odometry, Pose, Still, Tf};

fn record(topics: &[(&str, Recorded)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let names: Vec<(&str, &str)> = topics
        .iter()
        .map(|(name, what)| {
            let of = match what {
                Clouds(_) => CLOUD,
                Odometry(..) => ODOMETRY,
                Tf(..) | Still(..) => TF,
                Pose(_) => "geometry_msgs/PoseStamped",
            };
            (*name, of)
        })
        .collect();
    let mut messages: Vec<BagMessage> = Vec::new();
    for k in 0..5 {
        let at = START_NS + k * 100_000_000;
        let moved = [k as f64, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0];
        let ros1 = MessageWriter::ros1;
        for (number, (_, what)) in topics.iter().enumerate() {
            let message = match what {
                Clouds(frame) => {
                    let point = [[100.0, k as f32, 0.0].map(f32::to_le_bytes).concat()];
                    ros1().point_cloud2(at, frame, &fields, &point)
                }
                Odometry(parent, child) => ros1().odometry(at, parent, child, &moved),
                Tf(parent, child) => ros1().tf(at, parent, child, &moved),
                Still(parent, child) => ros1().tf(at, parent, child, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
                Pose(parent) => ros1().header(at, parent).f64s(&moved).done(),
            };
            messages.push((number, at, message));
        }
    }
    std::fs::write(&path, bag1(&names, &messages)).unwrap();
    (folder, path)
}

fn odometry_of(name: Option<&str>) -> BagOptions {
    BagOptions {
        poses: PoseSource::Odometry,
        odometry_topic: name.map(str::to_owned),
        topic: Some("/cloud_registered".to_owned()),
        ..BagOptions::default()
    }
}

/// Checks that the points are unchanged and the sensor moves.
fn assert_registered(clouds: &[Cloud], of: &str) {
    assert_eq!(clouds.len(), 5, "{of}");
    for (k, (head, points)) in clouds.iter().enumerate() {
        let pose = head.world_from_sensor.unwrap_or_else(|| panic!("{of}: no pose"));
        assert_eq!(pose.position_m, [k as f64, 0.0, 0.5], "{of}");
        assert!(head.is_in_world, "{of}");
        assert_eq!(points[0].position_m, [100.0, k as f64, 0.0], "{of}");
    }
}

#[test]
fn registered_clouds_use_odometry() {
    let plain =
        [("/cloud_registered", Clouds("camera_init")), ("/Odometry", Odometry("camera_init", "body"))];
    let (_folder, path) = record(&plain);
    let explicit = BagOptions { is_world_frame: true, ..odometry_of(Some("/Odometry")) };
    for options in [BagOptions::default(), odometry_of(None), explicit.clone()] {
        let (clouds, errors, remarks) = read(std::slice::from_ref(&path), &options);
        assert_eq!(errors, Vec::<String>::new());
        assert_registered(&clouds, &format!("{options:?}"));
        // With an explicit topic there is no remark on the choice.
        let expected = "the clouds are already in the frame camera_init: their points are not transformed, and \
                    rays start at body \
                    (`odometry` /Odometry `world_frame`)";
        let wanted: &[&str] = if options.is_world_frame { &[] } else { &[expected] };
        assert_eq!(remarks, wanted);
    }
    // With `is_world_frame`, a cloud in an unknown frame is in the world.
    let (_folder, path) =
        record(&[("/cloud_registered", Clouds("map")), ("/Odometry", Odometry("camera_init", "body"))]);
    assert_registered(&read(std::slice::from_ref(&path), &explicit).0, "in the world");
    let (clouds, _, remarks) = read(&[path], &odometry_of(None));
    assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none()));
    assert!(remarks[0].contains("no transform names the frame map"), "{remarks:?}");
    // The poses do not name their child frame.
    let (_folder, path) = record(&[("/cloud_registered", Clouds("map")), ("/pose", Pose("map"))]);
    let (clouds, _, remarks) = read(std::slice::from_ref(&path), &odometry_of(Some("/pose")));
    assert_registered(&clouds, "poses");
    assert_eq!(remarks.len(), 1, "{remarks:?}");
    // Poses without a child frame are not used as odometry by default.
    let (clouds, _, remarks) = read(&[path], &BagOptions::default());
    assert!(clouds[0].0.world_from_sensor.is_none());
    assert!(remarks.iter().any(|remark| remark.contains("for instance `odometry` /pose")), "{remarks:?}");
}

#[test]
fn registered_clouds_use_moving_frames() {
    let cloud = |frame| ("/cloud_registered", Clouds(frame));
    let body = "their points are not transformed, and rays start at body";
    for (topics, expected) in [
        (vec![cloud("camera_init"), ("/tf", Tf("camera_init", "body"))], body),
        // Two odometry topics, but one moving frame.
        (
            vec![
                cloud("camera_init"),
                ("/tf", Tf("camera_init", "body")),
                ("/a", Odometry("camera_init", "aft_mapped")),
                ("/b", Odometry("camera_init", "imu")),
            ],
            body,
        ),
        // The map frame is a static parent.
        (
            vec![
                cloud("camera_init"),
                ("/tf_static", Still("map", "camera_init")),
                ("/tf", Tf("camera_init", "body")),
            ],
            body,
        ),
        (
            vec![
                cloud("camera_init"),
                ("/tf_static", Still("map", "camera_init")),
                ("/Odometry", Odometry("camera_init", "body")),
            ],
            "rays start at body (`odometry` /Odometry `world_frame`)",
        ),
        // Corrections of the map do not move the points of a cloud in `odom`.
        (
            vec![
                cloud("odom"),
                ("/correction", Still("map", "odom")),
                ("/tf", Tf("odom", "base_link")),
                ("/odometry", Odometry("odom", "odom_mapping")),
            ],
            "rays start at odom_mapping (`odometry` /odometry `world_frame`)",
        ),
        // Wheels move too, but below the robot's frame.
        (
            vec![
                cloud("odom"),
                ("/tf", Tf("odom", "base_link")),
                ("/left", Tf("base_link", "left_wheel")),
                ("/right", Tf("base_link", "right_wheel")),
            ],
            "rays start at base_link",
        ),
    ] {
        let (_folder, path) = record(&topics);
        let options = BagOptions { topic: Some("/cloud_registered".to_owned()), ..BagOptions::default() };
        let (clouds, errors, remarks) = read(&[path], &options);
        assert_eq!(errors, Vec::<String>::new());
        assert_registered(&clouds, expected);
        assert!(remarks.iter().any(|remark| remark.contains(expected)), "{expected}: {remarks:?}");
    }
}

#[test]
fn ambiguous_poses_are_not_guessed() {
    let cloud = |frame| ("/cloud_registered", Clouds(frame));
    for (topics, expected) in [
        (
            vec![
                cloud("camera_init"),
                ("/a", Odometry("camera_init", "aft_mapped")),
                ("/b", Odometry("camera_init", "imu")),
            ],
            "(/a, /b): select one, for instance `odometry` /a `world_frame`",
        ),
        // Wheels moving in a robot's frame give no pose in a map.
        (
            vec![cloud("base_link"), ("/tf", Tf("base_link", "wheel"))],
            "no transform describes how base_link moves",
        ),
        // An arm moves in front of a fixed camera.
        (vec![cloud("world"), ("/tf", Tf("world", "gripper"))], "no transform describes how world moves"),
        // Odometry of the sensor itself is only used if requested.
        (
            vec![cloud("body"), ("/Odometry", Odometry("camera_init", "body"))],
            "there are poses in /Odometry (nav_msgs/Odometry, 5 messages): select their topic, for instance \
             `odometry` /Odometry",
        ),
        (vec![cloud("lidar")], "no transform names the frame lidar"),
    ] {
        let (_folder, path) = record(&topics);
        let (clouds, _, remarks) = read(&[path], &BagOptions::default());
        assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none() && !head.is_in_world));
        assert!(remarks.iter().any(|remark| remark.contains(expected)), "{expected}: {remarks:?}");
    }
    // Following the hint gives poses.
    let (_folder, path) = record(&[cloud("body"), ("/Odometry", Odometry("camera_init", "body"))]);
    let (clouds, _, remarks) = read(&[path], &odometry_of(Some("/Odometry")));
    assert_eq!(clouds[3].0.world_from_sensor.unwrap().position_m, [3.0, 0.0, 0.5]);
    assert!(!clouds[3].0.is_in_world && remarks.is_empty(), "{remarks:?}");
}

/// A sensor with a pose in `/tf` is not in the odometry frame, whatever else is recorded.
#[test]
fn clouds_of_a_sensor_are_not_registered() {
    let (_folder, path) = record(&[
        ("/cloud_registered", Clouds("lidar")),
        ("/tf", Tf("odom", "base_link")),
        ("/tf_static", Still("base_link", "lidar")),
        ("/odometry", Odometry("odom", "base_link")),
    ]);
    let (clouds, _, remarks) = read(&[path], &BagOptions::default());
    assert_eq!(remarks, Vec::<String>::new());
    assert_eq!(clouds[2].0.world_from_sensor.unwrap().position_m, [2.0, 0.0, 0.5]);
    assert!(!clouds[2].0.is_in_world);
    // A sensor may be fixed in the map.
    let (_folder, path) =
        record(&[("/cloud_registered", Clouds("lidar")), ("/tf_static", Still("map", "lidar"))]);
    let (clouds, _, remarks) = read(&[path], &BagOptions::default());
    assert_eq!((clouds[2].0.world_from_sensor.unwrap().position_m, remarks), ([0.0; 3], vec![]));
    assert!(!clouds[2].0.is_in_world);
}

#[test]
fn scans_of_registered_clouds_keep_their_points() {
    let (_folder, path) = record(&[
        ("/cloud_registered", Clouds("camera_init")),
        ("/Odometry", Odometry("camera_init", "body")),
    ]);
    let mut scans = open_scans(&path, &ReadOptions::default()).unwrap();
    let mut count = 0;
    while let Some(scan) = scans.next_scan().unwrap() {
        let origin = scan.world_from_sensor.position_m();
        assert_eq!(origin, [f64::from(count), 0.0, 0.5]);
        let [x, y, z] = scan.points_in_sensor[0];
        assert_eq!([x + origin[0], y + origin[1], z + origin[2]], [100.0, f64::from(count), 0.0]);
        count += 1;
    }
    assert_eq!(count, 5);
    let mut options = ReadOptions::default();
    options.clouds.is_deskewed = true;
    let error = open_scans(&path, &options).and_then(|mut scans| scans.next_scan());
    let error = format!("{:#}", error.err().unwrap());
    assert!(error.contains("deskew") && error.contains("already motion-compensated"), "{error}");
    // Points without rays need no poses.
    let mut options = ReadOptions::default();
    (options.clouds.may_lack_poses, options.clouds.are_poses_needed) = (true, false);
    let scan = open_scans(&path, &options).unwrap().next_scan().unwrap().unwrap();
    assert_eq!(
        (scan.world_from_sensor.position_m(), scan.points_in_sensor[0]),
        ([0.0; 3], [100.0, 0.0, 0.0])
    );
}

/// Drivers without a clock write the stamp 0.
#[test]
fn poses_without_stamps_use_recording_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 2.0, 3.0].map(f32::to_le_bytes).concat()];
    let mut messages = Vec::new();
    for k in 0..4 {
        let at = START_NS + k * 100_000_000;
        messages.push((
            1,
            at,
            MessageWriter::ros1().tf(0, "odom", "lidar", &[k as f64, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        ));
        messages.push((0, at + 50_000_000, MessageWriter::ros1().point_cloud2(0, "lidar", &fields, &point)));
    }
    std::fs::write(&path, bag1(&[("/points", CLOUD), ("/tf", TF)], &messages)).unwrap();
    let (clouds, _, remarks) = read(&[path], &BagOptions::default());
    let xs: Vec<_> =
        clouds.iter().map(|(head, _)| head.world_from_sensor.map(|pose| pose.position_m[0])).collect();
    assert_eq!(xs, [Some(0.5), Some(1.5), Some(2.5), None]);
    for expected in
        ["4 poses have no stamp; their recording times", "4 clouds have no stamp; their recording times"]
    {
        assert!(remarks.iter().any(|remark| remark.starts_with(expected)), "{remarks:?}");
    }
}
