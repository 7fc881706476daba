//! Recordings that rosbags and the writer of mcap.dev made (tests/fixtures/make_ros.py) give what was put into them.
#![cfg(feature = "ros")]

mod made;

use made::bag1::bag1;
use made::message::{F32, MessageWriter};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::slice::from_ref;
use voxtile_clouds::poses::most_gap_ns;
use voxtile_clouds::read::Format;
use voxtile_clouds::ros::{BagOptions, PoseSource, open_bag, open_recording};
use voxtile_clouds::{CloudHead, CloudPoint, CloudSource, RigidPose};

const FILES: [&str; 8] =
    ["none.bag", "bz2.bag", "lz4.bag", "none.mcap", "lz4.mcap", "zstd.mcap", "ros1.mcap", "unchunked.mcap"];
#[cfg(feature = "sqlite")]
const FOLDERS: &[&str] = &["folder", "by_file", "by_message", "folder/folder.db3"];
#[cfg(not(feature = "sqlite"))]
const FOLDERS: &[&str] = &[];

type Cloud = (CloudHead, Vec<CloudPoint>);

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ros").join(name)
}

fn recordings() -> impl Iterator<Item = &'static str> {
    FILES.into_iter().chain(FOLDERS.iter().copied())
}

fn expected() -> Value {
    serde_json::from_slice(&std::fs::read(data("expected.json")).unwrap()).unwrap()
}

fn topic(name: &str) -> BagOptions {
    BagOptions { topic: Some(name.to_owned()), ..BagOptions::default() }
}

/// All clouds, and all that went wrong.
fn read(paths: &[PathBuf], options: &BagOptions) -> (Vec<Cloud>, Vec<String>, Vec<String>) {
    let mut source = open_bag(paths, options).unwrap();
    let (mut clouds, mut errors) = (Vec::new(), Vec::new());
    loop {
        match source.next_cloud() {
            Ok(Some(head)) => {
                let mut points = Vec::new();
                let result = source.read_points(&mut |point| {
                    points.push(point);
                    Ok(())
                });
                errors.extend(result.err().map(|error| error.to_string()));
                clouds.push((head, points));
            }
            Ok(None) => break,
            Err(error) => errors.push(error.to_string()),
        }
    }
    let remarks = source.remarks();
    (clouds, errors, remarks)
}

fn assert_points(points: &[CloudPoint], rows: &Value, of: &str) {
    let rows = rows.as_array().unwrap();
    assert_eq!(points.len(), rows.len(), "{of}");
    for (k, (point, row)) in points.iter().zip(rows).enumerate() {
        let near = |value: f64, wanted: &Value, room: f64| match wanted.as_f64() {
            Some(wanted) => (value - wanted).abs() <= room,
            None => value.is_nan(),
        };
        let is_right = (0..3).all(|axis| near(point.position_m[axis], &row[axis], 1e-6))
            && near(f64::from(point.intensity), &row[3], 0.0)
            // Stamps of type f64 in seconds since the epoch are this coarse.
            && near(point.time_s, &row[4], 3e-7)
            && Some(point.is_return) == row[5].as_bool();
        assert!(is_right, "{of}, point {k}: {point:?} is not {row}");
    }
}

fn assert_pose(pose: Option<RigidPose>, wanted: &Value, of: &str) {
    let pose = pose.unwrap_or_else(|| panic!("{of}: no pose"));
    let numbers: Vec<f64> = pose.position_m.into_iter().chain(pose.quaternion).collect();
    let wanted: Vec<f64> = wanted.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let sign = if pose.quaternion[3] * wanted[6] < 0.0 { -1.0 } else { 1.0 };
    for k in 0..7 {
        let value = if k < 3 { numbers[k] } else { sign * numbers[k] };
        assert!((value - wanted[k]).abs() < 1e-9, "{of}: {numbers:?} is not {wanted:?}");
    }
}

fn assert_clouds(clouds: &[Cloud], frame: &str, of: &str) {
    let expected = expected();
    let wanted = expected["clouds"].as_array().unwrap();
    assert_eq!(clouds.len(), wanted.len(), "{of}");
    for (k, ((head, points), wanted)) in clouds.iter().zip(wanted).enumerate() {
        let of = format!("{of}, cloud {k}");
        assert_eq!(head.stamp_ns, wanted["stamp_ns"].as_i64(), "{of}");
        assert_eq!(head.frame.as_deref(), Some("lidar"), "{of}");
        assert_eq!(head.name, k.to_string());
        assert_eq!(head.points, Some(20));
        assert_eq!(head.has_intensities, k != 3);
        assert!(head.has_times);
        let fields: Vec<&str> =
            wanted["fields"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        assert_eq!(head.fields, fields, "{of}");
        assert_points(points, &wanted["points"], &of);
        assert_pose(head.world_from_sensor, &wanted["poses"][frame], &of);
    }
}

#[test]
fn the_same_clouds_and_poses_come_out_of_each() {
    for name in recordings() {
        let (clouds, errors, remarks) = read(&[data(name)], &topic("/points"));
        assert_eq!((errors, remarks), (vec![], vec![]), "{name}");
        assert_clouds(&clouds, "map", name);
    }
}

#[test]
fn a_fixed_frame_may_be_chosen() {
    let options = BagOptions { fixed_frame: Some("/odom".to_owned()), ..topic("points") };
    let (clouds, errors, _) = read(&[data("zstd.mcap")], &options);
    assert_eq!(errors, Vec::<String>::new());
    assert_clouds(&clouds, "odom", "odom");
}

#[test]
fn odometry_and_poses_carry_the_mount() {
    for name in recordings() {
        for odometry in ["/odometry", "/pose"] {
            let options = BagOptions {
                poses: PoseSource::Odometry,
                odometry_topic: Some(odometry.to_owned()),
                ..topic("/points")
            };
            let (clouds, errors, remarks) = read(&[data(name)], &options);
            assert_eq!(errors, Vec::<String>::new());
            assert_eq!(remarks.len(), usize::from(odometry == "/pose"), "{remarks:?}");
            assert_clouds(&clouds, "odom", &format!("{name} {odometry}"));
        }
    }
}

#[test]
fn odometry_is_preferred_to_topics_that_do_not_say_what_moves() {
    let options = BagOptions { poses: PoseSource::Odometry, ..topic("/points") };
    let (clouds, _, remarks) = read(&[data("none.bag")], &options);
    assert!(remarks.is_empty(), "{remarks:?}");
    assert_clouds(&clouds, "odom", "odometry");
}

#[test]
fn scans_depth_images_and_livox_are_clouds() {
    let expected = expected();
    for name in recordings() {
        for (topic_name, key) in [("/scan", "scan"), ("/depth/image_raw", "depth"), ("/livox", "livox")] {
            let of = format!("{name} {topic_name}");
            let (clouds, errors, remarks) = read(&[data(name)], &topic(topic_name));
            assert_eq!((errors, remarks), (vec![], vec![]), "{of}");
            assert_eq!(clouds.len(), 1, "{of}");
            let (head, points) = &clouds[0];
            assert_points(points, &expected[key], &of);
            assert_eq!(head.points, Some(points.len() as u64), "{of}");
            assert_pose(head.world_from_sensor, &expected["clouds"][1]["poses"]["map"], &of);
        }
    }
}

#[test]
fn several_topics_are_listed_and_none_too() {
    let error = |name: &str, options: &BagOptions| match open_bag(&[data(name)], options) {
        Ok(_) => panic!("{name} opens"),
        Err(error) => error.to_string(),
    };
    for name in recordings() {
        let text = error(name, &BagOptions::default());
        let image = if name.ends_with(".bag") || name == "ros1.mcap" {
            "/depth/image_raw (sensor_msgs/Image, 1 messages)"
        } else {
            "/depth/image_raw (sensor_msgs/msg/Image, 1 messages)"
        };
        for part in
            ["--topic NAME", "/points (sensor_msgs/", "PointCloud2, 4 messages)", "/livox", "/scan", image]
        {
            assert!(text.contains(part), "{name}: {text}");
        }
        assert!(!text.contains("/color"), "{text}");
        assert!(text.contains(name), "{text}");
        assert!(error(name, &topic("/pionts")).contains("/points"));
        assert!(error(name, &topic("/tf")).contains("are no clouds"));
        assert!(error(name, &topic("/color/image_raw")).contains("/color/camera_info"));
    }
}

#[test]
fn one_topic_needs_no_name_and_no_transforms_leave_clouds_without_poses() {
    let (clouds, errors, remarks) = read(&[data("only_points.mcap")], &BagOptions::default());
    assert_eq!((clouds.len(), errors), (4, vec![]));
    assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none()));
    assert_eq!(remarks, ["4 clouds have no pose: no transform names the frame lidar"]);
    let options = BagOptions { poses: PoseSource::None, ..BagOptions::default() };
    let (_, _, remarks) = read(&[data("only_points.mcap")], &options);
    assert!(remarks.is_empty());
}

#[test]
fn content_tells_a_recording_whatever_its_name() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["none.bag", "none.mcap"] {
        for renamed in ["drive", "drive.bag", "drive.mcap.backup"] {
            let path = folder.path().join(renamed);
            std::fs::copy(data(name), &path).unwrap();
            let (clouds, errors, _) = read(&[path], &topic("/points"));
            assert_eq!((clouds.len(), errors), (4, vec![]), "{name} as {renamed}");
        }
    }
    let path = folder.path().join("points.xyz");
    std::fs::write(&path, "1 2 3\n").unwrap();
    let Err(error) = open_recording(&[path]) else { panic!("points are no recording") };
    assert!(error.to_string().contains("no recording by its content or its name"), "{error}");
}

#[test]
fn gaps_between_transforms_may_be_limited() {
    let options = BagOptions { most_gap_ns: Some(10_000_000), ..topic("/points") };
    let (clouds, _, remarks) = read(&[data("lz4.bag")], &options);
    assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none()));
    let why = "too far apart; --pose-tolerance allows for more";
    assert!(remarks.iter().any(|remark| remark.contains(why)), "{remarks:?}");
    // The map moves in odom five times a second.
    for (tolerance_ns, posed) in [(99_999_999, 0), (100_000_000, 4)] {
        let options = BagOptions { most_gap_ns: Some(most_gap_ns(tolerance_ns)), ..topic("/points") };
        let (clouds, ..) = read(&[data("lz4.bag")], &options);
        assert_eq!(clouds.iter().filter(|(head, _)| head.world_from_sensor.is_some()).count(), posed);
    }
}

#[test]
fn messages_come_in_the_order_in_which_they_were_recorded() {
    for name in recordings() {
        let mut recording = open_recording(&[data(name)]).unwrap();
        let all: Vec<usize> = (0..recording.topics().len()).collect();
        let announced: u64 = recording.topics().iter().map(|topic| topic.messages).sum();
        recording.begin(&all).unwrap();
        let mut stamps = Vec::new();
        while let Some(message) = recording.next_message().unwrap() {
            stamps.push(message.log_ns);
        }
        assert_eq!((stamps.len() as u64, announced), (41, 41), "{name}");
        assert!(stamps.is_sorted(), "{name}: {stamps:?}");
    }
}

/// What does not fit in memory is read from temporary files, and is the same.
#[test]
fn little_memory_gives_the_same_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let large = folder.path().join("large.bag");
    std::fs::write(&large, large_bag()).unwrap();
    let options = |poses| BagOptions { poses, ..topic("/points") };
    for path in recordings().map(data).chain([large]) {
        for poses in [PoseSource::Tf, PoseSource::None] {
            let much = read(std::slice::from_ref(&path), &options(poses));
            let little = BagOptions { memory_bytes: 0, ..options(poses) };
            let found = read(std::slice::from_ref(&path), &little);
            // As text, in which NaN is NaN.
            assert!(format!("{found:?}") == format!("{much:?}"), "{}", path.display());
            assert!(much.0.len() > 1, "{}", path.display());
        }
    }
}

/// A map without its poses would be built of a full disk.
#[test]
fn temporary_files_that_cannot_be_made_are_an_error() {
    let options = BagOptions { memory_bytes: 0, scratch: Some(data("gone")), ..topic("/points") };
    let active = tempfile::NamedTempFile::new().unwrap();
    let whole = std::fs::read(data("bz2.bag")).unwrap();
    // Without the end of its index.
    std::fs::write(active.path(), &whole[..whole.len() - 10]).unwrap();
    for path in [data("bz2.bag"), data("zstd.mcap"), active.path().to_owned()] {
        let error = open_bag(from_ref(&path), &options).err().map(|error| error.to_string());
        let wanted = format!("cannot make a temporary file in {}", data("gone").display());
        assert_eq!(error, Some(wanted), "{}", path.display());
    }
}

/// Clouds of many points, in rows with bytes between them and without, and one that is cut off; transforms.
fn large_bag() -> Vec<u8> {
    const POINT_BYTES: usize = 23;
    let cloud = |height: u32, row_bytes: usize, data_bytes: usize| {
        let message = MessageWriter::ros1().header(1_000_000_000, "lidar").u32(height).u32(5000).u32(4);
        let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("intensity", 15, F32)];
        let message = fields.iter().fold(message, |message, &(name, offset, kind)| {
            message.text(name).u32(offset).number([kind]).u32(1)
        });
        let data: Vec<u8> =
            (0..data_bytes).map(|k| if k % 4 == 3 { 64 } else { (k * 7919 / 13) as u8 }).collect();
        message.number([0]).u32(POINT_BYTES as u32).u32(row_bytes as u32).sized(&data).number([1]).done()
    };
    let row = 5000 * POINT_BYTES;
    let tf =
        |at_ns: i64| MessageWriter::ros1().tf(at_ns, "map", "lidar", &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let mut messages: Vec<_> = (0..3000).map(|k| (1, k, tf(999_998_000 + 7919 * k % 3000))).collect();
    messages.push((0, 10, cloud(2, row, 2 * row)));
    messages.push((0, 11, cloud(3, row + 5, 3 * row + 10)));
    messages.push((0, 12, cloud(3, row, 2 * row + 77)));
    bag1(&[("/points", "sensor_msgs/PointCloud2"), ("/tf", "tf2_msgs/TFMessage")], &messages)
}

#[test]
fn parts_of_a_split_recording_are_one() {
    let (clouds, errors, _) = read(&[data("none.bag"), data("bz2.bag")], &topic("/points"));
    assert_eq!((clouds.len(), errors), (8, vec![]));
    assert_clouds(&clouds[..4], "map", "first part");
}

#[test]
fn files_that_are_cut_off_give_what_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    for name in FILES {
        let bytes = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name);
        // Without the last byte the index is gone, but no message is.
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        let (clouds, errors, remarks) = read(from_ref(&path), &topic("/points"));
        assert_eq!(errors, Vec::<String>::new(), "{name}");
        assert_eq!(remarks.len(), 1, "{name}: {remarks:?}");
        assert!(remarks[0].contains("41 messages were found"), "{remarks:?}");
        assert_clouds(&clouds, "map", name);
        // In the midst of messages: some are gone, the first is not.
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let (clouds, _, remarks) = read(&[path], &topic("/points"));
        assert!((1..4).contains(&clouds.len()), "{name}: {}", clouds.len());
        assert!(remarks.iter().any(|remark| remark.contains("cut off")), "{name}: {remarks:?}");
    }
}

#[cfg(feature = "sqlite")]
#[test]
fn folders_whose_file_is_cut_off_or_gone_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let copy = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    copy("metadata.yaml", &std::fs::read(data("by_file/metadata.yaml")).unwrap());
    let error = open_recording(&[folder.path().to_owned()]).err().unwrap().to_string();
    assert!(error.contains("names by_file.db3.zstd, which is not there"), "{error}");
    let bytes = std::fs::read(data("by_file/by_file.db3.zstd")).unwrap();
    copy("by_file.db3.zstd", &bytes[..bytes.len() - 1]);
    // The archive is one block: without its end there is nothing.
    let error = open_recording(&[folder.path().to_owned()]).err().unwrap().to_string();
    assert!(error.contains("by_file.db3.zstd, byte 0: it is cut off or damaged"), "{error}");
    // Without metadata, files are found by their names.
    std::fs::remove_file(folder.path().join("metadata.yaml")).unwrap();
    copy("by_file.db3.zstd", &bytes);
    let (clouds, errors, remarks) = read(&[folder.path().to_owned()], &topic("/points"));
    assert_eq!((errors, remarks.len()), (vec![], 1), "{remarks:?}");
    assert_clouds(&clouds, "map", "without metadata");
}

#[test]
fn files_that_are_no_recordings_say_so() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["x.bag", "x.mcap", "x.db3", "x.txt"] {
        let path = folder.path().join(name);
        for bytes in [&b""[..], b"#ROSBAG V1.2\n", b"hello"] {
            std::fs::write(&path, bytes).unwrap();
            let error = open_recording(from_ref(&path)).err().map(|error| error.to_string());
            assert!(error.is_some_and(|error| error.contains(name)), "{name}");
        }
    }
    assert!(open_recording(&[folder.path().join("gone.bag")]).is_err());
    let empty = tempfile::tempdir().unwrap();
    assert!(open_recording(&[empty.path().to_owned()]).is_err());
    assert!(open_recording(&[]).is_err());
}

/// A generator of numbers that need not be good.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

#[test]
fn damaged_files_never_panic_and_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(3);
    let databases = cfg!(feature = "sqlite").then_some("folder/folder.db3");
    for name in FILES.into_iter().chain(databases) {
        let whole = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name.rsplit('/').next().unwrap());
        let mut read = 0;
        for turn in 0..250 {
            let mut bytes = whole.clone();
            if turn % 3 != 0 {
                for _ in 0..=numbers.below(8) {
                    let at = numbers.below(bytes.len());
                    bytes[at] = [0, 255, 127, 1, numbers.below(256) as u8][numbers.below(5)];
                }
            }
            if turn % 3 != 1 {
                bytes.truncate(numbers.below(bytes.len()));
            }
            std::fs::write(&path, &bytes).unwrap();
            for (topic_name, poses) in [("/points", PoseSource::Tf), ("/livox", PoseSource::Odometry)] {
                let options = BagOptions { poses, ..topic(topic_name) };
                let Ok(mut source) = open_bag(from_ref(&path), &options) else { continue };
                let mut calls = 0;
                while !matches!(source.next_cloud(), Ok(None)) {
                    let _ = source.read_points(&mut |_| {
                        read += 1;
                        Ok(())
                    });
                    calls += 1;
                    assert!(calls < 10_000, "{name}, turn {turn}: it does not end");
                }
            }
        }
        // Most of it must have got as far as points, or this tests nothing.
        assert!(read > 2_000, "{name}: {read} points");
    }
}

/// A bag of ROS 1 of one cloud, with the transforms before and after it.
fn part(number: i64, has_mount: bool) -> Vec<u8> {
    let stamp_ns = 1_700_000_000_000_000_000 + number * 100_000_000;
    let moved = |stamp_ns: i64| {
        let x_m = (stamp_ns - 1_700_000_000_000_000_000) as f64 * 1e-8;
        MessageWriter::ros1().tf(stamp_ns, "map", "base_link", &[x_m, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    };
    let mount = MessageWriter::ros1().tf(0, "base_link", "lidar", &[0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let points = [[number as f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    let cloud = MessageWriter::ros1().point_cloud2(stamp_ns, "lidar", &fields, &points);
    let mut topics = vec![("/points", "sensor_msgs/PointCloud2"), ("/tf", "tf2_msgs/TFMessage")];
    // The transform that frames the cloud's stamp is in the next part.
    let mut messages = vec![(1, stamp_ns - 60_000_000, moved(stamp_ns - 60_000_000)), (0, stamp_ns, cloud)];
    if has_mount {
        topics.push(("/tf_static", "tf2_msgs/TFMessage"));
        messages.push((2, stamp_ns - 60_000_000, mount));
    } else {
        // Connections are numbered anew in each part.
        topics.swap(0, 1);
        messages.iter_mut().for_each(|message| message.0 = 1 - message.0);
    }
    bag1(&topics, &messages)
}

#[test]
fn a_split_bag_is_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = (0..11).map(|number| format!("drive_{number}.bag")).collect();
    for (number, name) in names.iter().enumerate() {
        std::fs::write(folder.path().join(name), part(number as i64, number == 0)).unwrap();
    }
    let files: Vec<PathBuf> = names.iter().map(|name| folder.path().join(name)).collect();
    assert_eq!(Format::guess(folder.path()).unwrap(), Format::Bag1);
    for paths in [vec![folder.path().to_owned()], files] {
        let (clouds, errors, remarks) = read(&paths, &BagOptions::default());
        assert_eq!((clouds.len(), errors), (11, vec![]), "{paths:?}");
        for (number, (head, points)) in clouds.iter().enumerate() {
            assert_eq!(head.name, number.to_string());
            assert_eq!(points[0].position_m[0], number as f64, "parts are in the natural order of names");
            // Nothing is known behind the last transform.
            let position_m = head.world_from_sensor.map(|pose| pose.position_m);
            match number {
                10 => assert_eq!(position_m, None),
                _ => {
                    let [x, y, z] = position_m.unwrap();
                    assert!((x - number as f64).abs() < 1e-6 && (y, z) == (0.0, 2.0), "{position_m:?}");
                }
            }
        }
        assert_eq!(remarks, ["1 clouds have no pose: the stamp is after the last transform of base_link"]);
    }
}

#[test]
fn a_transform_that_makes_a_loop_costs_a_recording_no_pose() {
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
        assert!(remarks.iter().any(|remark| remark.contains("which makes a loop")), "{remarks:?}");
    }
    let (posed, _, remarks) = write(&[("", "base"), ("base", "/base")]);
    assert_eq!(posed, 49);
    assert_eq!(remarks, ["2 transforms are not valid and left out; the first: a frame has no name"]);
}

/// It has no pose at other times, rather than that of its mount.
#[test]
fn a_single_transform_gives_a_pose_at_its_own_time_alone() {
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
fn a_frame_with_ever_other_parents_leaves_room_for_others() {
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
        assert!(!remarks.iter().any(|remark| remark.contains("are left out")), "{remarks:?}");
    }
}

#[test]
fn the_last_part_of_a_split_bag_may_be_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (part(0, true), part(1, false));
    std::fs::write(folder.path().join("drive_0.bag"), first).unwrap();
    std::fs::write(folder.path().join("drive_1.bag.active"), &second[..second.len() - 400]).unwrap();
    let (clouds, _, remarks) = read(&[folder.path().to_owned()], &BagOptions::default());
    assert!(clouds.iter().any(|(head, _)| head.world_from_sensor.is_some()));
    assert!(remarks.iter().any(|remark| remark.contains("drive_1.bag.active has no index")), "{remarks:?}");
}

/// A bag of one cloud, `/tf`, and a topic of poses.
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

/// The map would be of other poses than those that were asked for.
#[test]
fn a_topic_of_poses_without_any_that_can_be_used_is_an_error() {
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
    for (poses, told) in [
        (vec![], "--odometry /odom: none of its 0 messages gives a pose"),
        (vec![pose("odom", f64::NAN), pose("", 1.0)], "; 2 are not valid, or their frames have no name"),
        (vec![cut], "; 1 messages or chunks with poses cannot be read; the first: /odom: "),
    ] {
        let path = with_odometry(folder.path(), &poses, "geometry_msgs/PoseStamped");
        let error = open_bag(&[path], &options).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(told), "{error}");
    }
    // One is enough.
    let poses = [pose("odom", f64::NAN), pose("odom", 7.0)];
    let path = with_odometry(folder.path(), &poses, "geometry_msgs/PoseStamped");
    let (clouds, _, remarks) = read(&[path], &options);
    assert_eq!(clouds[0].0.world_from_sensor.unwrap().position_m, [7.0, 0.0, 0.0]);
    assert!(remarks.iter().any(|remark| remark.starts_with("1 poses are not valid")), "{remarks:?}");
}

/// Every message of a path tells the way so far.
#[test]
fn a_path_that_grows_is_one_way() {
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

/// Where the checksums of the chunks of an MCAP file are.
fn checksums(file: &[u8]) -> Vec<usize> {
    let (mut at, mut found) = (8, Vec::new());
    while let Some(length) = file.get(at + 1..at + 9) {
        if file[at] == 6 {
            found.push(at + 9 + 24);
        }
        at += 9 + u64::from_le_bytes(length.try_into().unwrap()) as usize;
    }
    found
}

#[test]
fn chunks_of_mcap_whose_checksum_is_wrong_are_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut checked = 0;
    for name in ["none.mcap", "lz4.mcap", "zstd.mcap", "ros1.mcap"] {
        let whole = std::fs::read(data(name)).unwrap();
        for at in checksums(&whole) {
            let has_checksum = whole[at..at + 4] != [0; 4];
            for (bytes, is_damaged) in [([1, 2, 3, 4], true), ([0; 4], false)] {
                let mut file = whole.clone();
                file[at..at + 4].copy_from_slice(&bytes);
                std::fs::write(&path, file).unwrap();
                let (_, mut errors, remarks) = read(from_ref(&path), &topic("/points"));
                errors.extend(remarks);
                assert_eq!(!errors.is_empty(), is_damaged, "{name}: {errors:?}");
                let is_told = errors.iter().all(|error| error.contains("that in its header 04030201"));
                assert!(is_told, "{name}: {errors:?}");
            }
            checked += usize::from(has_checksum);
        }
    }
    assert!(checked > 0, "the fixtures have checksums");
}

/// Metadata from elsewhere are not to open any file of the machine.
#[test]
fn files_out_of_the_folder_of_a_bag_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    let outside = folder.path().join("a.mcap");
    std::fs::copy(data("none.mcap"), &outside).unwrap();
    for name in ["../a.mcap".to_owned(), "x/../../a.mcap".to_owned(), outside.display().to_string()] {
        std::fs::create_dir_all(bag.join("x")).unwrap();
        std::fs::write(bag.join("metadata.yaml"), format!("relative_file_paths:\n- {name}\n")).unwrap();
        let error = open_recording(from_ref(&bag)).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(&format!("names {name}, which leads out of the folder")), "{error}");
    }
    // The name of a recorder's own folder, and the file moved since.
    std::fs::rename(&outside, bag.join("a.mcap")).unwrap();
    assert!(open_recording(&[bag]).is_ok());
}

/// `a/drive.bag.zstd` and `b/drive.bag.zstd` are both `drive.bag` once they are unpacked.
#[test]
fn packed_parts_of_the_same_name_are_all_read() {
    let folder = tempfile::tempdir().unwrap();
    // More than is buffered of a file that is open.
    for (part, count) in [("a", 100), ("b", 1)] {
        std::fs::create_dir(folder.path().join(part)).unwrap();
        let messages: Vec<_> = (0..count).map(|stamp_ns| (0, stamp_ns, vec![7; 4000])).collect();
        let bag = bag1(&[("/text", "std_msgs/String")], &messages);
        let packed = zstd::encode_all(bag.as_slice(), 3).unwrap();
        std::fs::write(folder.path().join(part).join("drive.bag.zstd"), packed).unwrap();
    }
    let metadata = "relative_file_paths:\n- a/drive.bag.zstd\n- b/drive.bag.zstd\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let mut recording = open_recording(&[folder.path().to_owned()]).unwrap();
    recording.begin(&[0]).unwrap();
    let mut messages = 0;
    while recording.next_message().unwrap().is_some() {
        messages += 1;
    }
    assert_eq!(messages, 101);
}

#[test]
fn packed_files_are_unpacked_where_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let packed = zstd::encode_all(std::fs::read(data("only_points.mcap")).unwrap().as_slice(), 3).unwrap();
    std::fs::write(folder.path().join("a.mcap.zstd"), packed).unwrap();
    let paths = [folder.path().to_owned()];
    let gone = folder.path().join("gone");
    let scratch = |scratch: &Path| BagOptions { scratch: Some(scratch.to_owned()), ..BagOptions::default() };
    let error = open_bag(&paths, &scratch(&gone)).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("cannot unpack a recording into") && error.contains("gone"), "{error}");
    assert_eq!(read(&paths, &scratch(folder.path())).0.len(), 4);
}

/// Names of topics beyond the most that are kept, and messages of these topics before those that are wanted.
#[test]
fn topics_that_are_left_out_cost_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let points = [[1.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
    let names = |count: usize, length: usize| -> Vec<String> {
        (0..count).map(|k| format!("/{k}{}", "n".repeat(length))).collect()
    };

    let long = names(20, 60_000);
    let mut topics: Vec<_> = long.iter().map(|name| (name.as_str(), "std_msgs/String")).collect();
    topics.push(("/points", "sensor_msgs/PointCloud2"));
    let mut messages: Vec<_> = (0..20).map(|k| (k, 1 + k as i64, vec![0; 4])).collect();
    messages.push((20, 50, MessageWriter::ros1().point_cloud2(50, "lidar", &fields, &points)));
    let bag = bag1(&topics, &messages);
    std::fs::write(folder.path().join("a.bag"), &bag).unwrap();
    std::fs::write(folder.path().join("cut.bag"), &bag[..bag.len() - 10]).unwrap();

    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    let none = std::collections::BTreeMap::new();
    let schema = writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"").unwrap();
    let long = names(280, 4000);
    for (name, k) in long.iter().map(String::as_str).chain(["/points"]).zip(0..) {
        let schema = if name == "/points" { schema } else { 0 };
        let channel_id = writer.add_channel(schema, name, "cdr", &none).unwrap();
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: k, publish_time: k };
        let cloud = MessageWriter::cdr().point_cloud2(50, "lidar", &fields, &points);
        writer.write_to_known_channel(&header, &cloud).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    let bytes = bytes.into_inner();
    std::fs::write(folder.path().join("a.mcap"), &bytes).unwrap();
    std::fs::write(folder.path().join("cut.mcap"), &bytes[..bytes.len() - 10]).unwrap();

    for name in ["a.bag", "cut.bag", "a.mcap", "cut.mcap"] {
        let (clouds, errors, remarks) = read(&[folder.path().join(name)], &BagOptions::default());
        let positions: Vec<_> = clouds.iter().map(|(_, points)| points[0].position_m).collect();
        assert_eq!((positions, errors), (vec![[1.0, 1.0, 2.0]], Vec::new()), "{name}");
        let is_scanned = remarks.iter().any(|remark| remark.contains("reading it whole"));
        assert_eq!(is_scanned, name.starts_with("cut"), "{name}: {remarks:?}");
    }
}
