use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
use crate::support::read;
use std::path::{Path, PathBuf};
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag};

/// Writes a bag with one cloud, `/tf` and a topic of poses.
fn with_odometry(folder: &Path, poses: &[Vec<u8>], type_name: &str) -> PathBuf {
    let stamp_ns = 1_700_000_000_000_000_000;
    let tf = MessageWriter::ros1().tf(stamp_ns, "map", "lidar", &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let point = [1.0, 2.0, 3.0_f32].map(f32::to_le_bytes).concat();
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let cloud = MessageWriter::ros1().point_cloud2(stamp_ns, "lidar", &fields, &[point]);
    let mut messages = vec![(0, stamp_ns, tf), (1, stamp_ns, cloud)];
    messages.extend(poses.iter().map(|pose| (2, stamp_ns, pose.clone())));
    let topics =
        [("/tf", "tf2_msgs/TFMessage"), ("/points", "sensor_msgs/PointCloud2"), ("/odom", type_name)];
    let path = folder.join("a.bag");
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    path
}

/// Otherwise the map would be built with other poses than requested.
#[test]
fn pose_topics_without_valid_poses_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let pose = |frame: &str, x_m: f64| {
        let header = MessageWriter::ros1().header(1_700_000_000_000_000_000, frame);
        header.f64s(&[x_m, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).done()
    };
    let options = BagOptions {
        poses: PoseSource::Odometry,
        odometry_topic: Some("/odom".to_owned()),
        ..BagOptions::default()
    };
    let cut = pose("odom", 1.0)[..20].to_vec();
    for (poses, expected) in [
        (vec![], "odometry /odom: none of its 0 messages contains a valid pose"),
        (vec![pose("odom", f64::NAN), pose("", 1.0)], "; 2 are invalid or have unnamed frames"),
        (vec![cut], "; 1 messages or chunks with poses cannot be read; the first: /odom: "),
    ] {
        let path = with_odometry(folder.path(), &poses, "geometry_msgs/PoseStamped");
        let error = open_bag(&[path], &options).err().map(|error| format!("{error:#}")).unwrap_or_default();
        assert!(error.contains(expected), "{error}");
    }
    // One valid pose is enough.
    let poses = [pose("odom", f64::NAN), pose("odom", 7.0)];
    let path = with_odometry(folder.path(), &poses, "geometry_msgs/PoseStamped");
    let (clouds, _, remarks) = read(&[path], &options);
    assert_eq!(clouds[0].0.world_from_sensor.unwrap().position_m, [7.0, 0.0, 0.0]);
    assert!(remarks.iter().any(|remark| remark.starts_with("1 poses are invalid")), "{remarks:?}");
}

/// Every message of a path repeats the poses so far.
#[test]
fn growing_paths_are_one_trajectory() {
    let folder = tempfile::tempdir().unwrap();
    let path_of = |count: i64| {
        let start_ns = 1_700_000_000_000_000_000;
        let whole = MessageWriter::ros1().header(start_ns, "odom").u32(count as u32);
        let add = |path: MessageWriter, k: i64| {
            path.header(start_ns + (k - 2) * 100_000_000, "").f64s(&[k as f64, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        };
        (0..count).fold(whole, add).done()
    };
    let options = BagOptions { poses: PoseSource::Odometry, ..BagOptions::default() };
    let messages: Vec<Vec<u8>> = (1..6).map(path_of).collect();
    let (clouds, errors, remarks) =
        read(&[with_odometry(folder.path(), &messages, "nav_msgs/Path")], &options);
    assert_eq!((errors, clouds.len()), (vec![], 1));
    assert_eq!(clouds[0].0.world_from_sensor.unwrap().position_m, [2.0, 0.0, 0.0]);
    assert_eq!(remarks.len(), 1, "{remarks:?}");
}
