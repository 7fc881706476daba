use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
use crate::support::{Cloud, read};
use std::slice::from_ref;
use std::time::{Duration, Instant};
use voxtile_formats::ros::BagOptions;

#[test]
fn transforms_closing_a_loop_lose_no_pose_of_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loop.bag");
    let (start_ns, still) = (1_700_000_000_000_000_000, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let at = |tick: i64| start_ns + tick * 20_000_000;
    let tf = |stamp_ns, parent: &str, child: &str| MessageWriter::ros1().tf(stamp_ns, parent, child, &still);
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    let write = |wrong: &[(&str, &str)]| {
        let mut messages = vec![(2, at(0), tf(0, "base", "lidar"))];
        for tick in 0..50 {
            messages.push((1, at(tick), tf(at(tick), "map", "base")));
            if tick == 25 {
                messages.extend(wrong.iter().map(|(parent, child)| (1, at(25), tf(at(25), parent, child))));
            }
            if tick < 49 {
                let cloud =
                    MessageWriter::ros1().point_cloud2(at(tick) + 7_000_000, "lidar", &fields, &point);
                messages.push((0, at(tick), cloud));
            }
        }
        let tf = "tf2_msgs/TFMessage";
        let topics = [("/points", "sensor_msgs/PointCloud2"), ("/tf", tf), ("/tf_static", tf)];
        std::fs::write(&path, bag1(&topics, &messages)).unwrap();
        let (clouds, errors, remarks) = read(from_ref(&path), &BagOptions::default());
        let little = read(from_ref(&path), &BagOptions { memory_bytes: 0, ..BagOptions::default() });
        assert!(format!("{little:?}") == format!("{:?}", (&clouds, &errors, &remarks)), "{:?}", little.2);
        let posed = clouds.iter().filter(|(head, _)| head.world_from_sensor.is_some()).count();
        (posed, errors, remarks)
    };
    assert_eq!(write(&[]), (49, Vec::new(), Vec::new()));
    for wrong in [[("lidar", "map"), ("base", "map")], [("lidar", "base"), ("elsewhere", "lidar")]] {
        let (posed, errors, remarks) = write(&wrong);
        assert_eq!((posed, errors), (49, Vec::new()), "{remarks:?}");
        assert!(remarks.iter().any(|remark| remark.contains("which closes a loop")), "{remarks:?}");
    }
    let (posed, _, remarks) = write(&[("", "base"), ("base", "/base")]);
    assert_eq!(posed, 49);
    assert_eq!(remarks, ["2 transforms are invalid and were skipped; the first: a frame has no name"]);
}

/// At other times the pose is unknown. The pose of the mount alone must not be returned.
#[test]
fn single_transforms_give_a_pose_only_at_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("single.bag");
    let tf = |at_ns, parent: &str, child: &str| {
        MessageWriter::ros1().tf(at_ns, parent, child, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    };
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    let cloud = |at_ns, frame| MessageWriter::ros1().point_cloud2(at_ns, frame, &fields, &point);
    let mut messages = vec![(2, 1, tf(0, "base", "lidar")), (1, 5, tf(5, "odom", "base"))];
    for (stamp_ns, frame) in [(4, "lidar"), (5, "lidar"), (5, "base"), (6, "lidar")] {
        messages.push((0, stamp_ns, cloud(stamp_ns, frame)));
    }
    let tf = "tf2_msgs/TFMessage";
    let topics = [("/points", "sensor_msgs/PointCloud2"), ("/tf", tf), ("/tf_static", tf)];
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    let (clouds, errors, remarks) = read(from_ref(&path), &BagOptions::default());
    let found = |(head, _): &Cloud| head.world_from_sensor.map(|pose| pose.position_m[0]);
    let found: Vec<_> = clouds.iter().map(found).collect();
    assert_eq!((found, errors), (vec![None, Some(2.0), Some(1.0), None], Vec::new()), "{remarks:?}");
    for why in ["before the first", "after the last"] {
        let remark = format!("1 clouds have no pose: the stamp is {why} transform of base");
        assert!(remarks.contains(&remark), "{remarks:?}");
    }
}

#[test]
fn frames_with_many_parents_do_not_displace_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parents.bag");
    let tf = |at_ns, parent: &str, child: &str| {
        MessageWriter::ros1().tf(at_ns, parent, child, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    };
    let mut messages: Vec<_> = (0..20_000).map(|k| (1, k, tf(k, &format!("p{}", k % 40), "flag"))).collect();
    messages.extend((0..2).map(|k| (1, 30_000 + k, tf(30_000 + k, "map", "lidar"))));
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    messages.push((0, 30_001, MessageWriter::ros1().point_cloud2(30_001, "lidar", &fields, &point)));
    let topics = [("/points", "sensor_msgs/PointCloud2"), ("/tf", "tf2_msgs/TFMessage")];
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    for memory_bytes in [0, 64 << 20] {
        let (clouds, _, remarks) =
            read(from_ref(&path), &BagOptions { memory_bytes, ..BagOptions::default() });
        assert!(clouds[0].0.world_from_sensor.is_some(), "{remarks:?}");
        assert!(!remarks.iter().any(|remark| remark.contains("were skipped")), "{remarks:?}");
    }
}

#[test]
fn unrelated_frames_do_not_slow_down_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.bag");
    let tf = |at_ns, parent: &str, child: &str| {
        MessageWriter::ros1().tf(at_ns, parent, child, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    };
    let mut messages = vec![(1, 1, tf(1, "map", "f0")), (1, 1, tf(10_000, "map", "f0"))];
    // These frames are searched before the parent that leads to the map.
    for k in 0..9000 {
        messages.extend([2, 20_000].map(|at_ns| (1, 2, tf(at_ns, &format!("f{}", k + 1), &format!("f{k}")))));
    }
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    messages.extend((1..500).map(|k| (0, k, MessageWriter::ros1().point_cloud2(k, "f0", &fields, &point))));
    let topics = [("/points", "sensor_msgs/PointCloud2"), ("/tf", "tf2_msgs/TFMessage")];
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    let start = Instant::now();
    let (clouds, errors, _) = read(from_ref(&path), &BagOptions::default());
    let posed = clouds.iter().filter(|(head, _)| head.world_from_sensor.is_some()).count();
    assert_eq!((clouds.len(), posed, errors.len()), (499, 499, 0));
    assert!(start.elapsed() < Duration::from_secs(8), "{:?}", start.elapsed());
}

#[test]
fn clouds_of_many_frames_have_poses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sensors.bag");
    let still = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let tf = |at_ns, parent: &str, child: &str| MessageWriter::ros1().tf(at_ns, parent, child, &still);
    let mut messages = vec![(1, 1, tf(1, "map", "base")), (1, 1, tf(10_000, "map", "base"))];
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let point = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    for k in 0..150 {
        let sensor = format!("s{k}");
        messages.push((2, 2, tf(0, "base", &sensor)));
        messages.push((0, k + 3, MessageWriter::ros1().point_cloud2(k + 3, &sensor, &fields, &point)));
    }
    let tf = "tf2_msgs/TFMessage";
    let topics = [("/points", "sensor_msgs/PointCloud2"), ("/tf", tf), ("/tf_static", tf)];
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    let (clouds, _, remarks) = read(from_ref(&path), &BagOptions::default());
    let posed = clouds.iter().filter(|(head, _)| head.world_from_sensor.is_some()).count();
    assert_eq!((clouds.len(), posed), (150, 150), "{remarks:?}");
}
