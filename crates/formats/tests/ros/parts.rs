use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
use crate::support::{assert_clouds, data, read, topic};
use std::path::{Path, PathBuf};
use std::slice::from_ref;
use voxtile_formats::Registry;
use voxtile_formats::ros::{BagOptions, open_bag, open_recording};

#[test]
fn parts_of_a_split_recording_are_one() {
    let (clouds, errors, _) = read(&[data("none.bag"), data("bz2.bag")], &topic("/points"));
    assert_eq!((clouds.len(), errors), (8, vec![]));
    assert_clouds(&clouds[..4], "map", "first part");
}

/// Encodes a ROS 1 bag with one cloud and transforms before and after it.
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
    // The transform after the cloud's stamp is in the next part.
    let mut messages = vec![(1, stamp_ns - 60_000_000, moved(stamp_ns - 60_000_000)), (0, stamp_ns, cloud)];
    if has_mount {
        topics.push(("/tf_static", "tf2_msgs/TFMessage"));
        messages.push((2, stamp_ns - 60_000_000, mount));
    } else {
        // Connection IDs differ between the parts.
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
    assert_eq!(Registry::default().guess(folder.path(), &[]).unwrap().name, "bag");
    for paths in [vec![folder.path().to_owned()], files] {
        let (clouds, errors, remarks) = read(&paths, &BagOptions::default());
        assert_eq!((clouds.len(), errors), (11, vec![]), "{paths:?}");
        for (number, (head, points)) in clouds.iter().enumerate() {
            assert_eq!(head.name, number.to_string());
            assert_eq!(points[0].position_m[0], number as f64, "parts are in the natural order of names");
            // Poses after the last transform are unknown.
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
fn last_part_of_a_split_bag_may_be_truncated() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (part(0, true), part(1, false));
    std::fs::write(folder.path().join("drive_0.bag"), first).unwrap();
    std::fs::write(folder.path().join("drive_1.bag.active"), &second[..second.len() - 400]).unwrap();
    let (clouds, _, remarks) = read(&[folder.path().to_owned()], &BagOptions::default());
    assert!(clouds.iter().any(|(head, _)| head.world_from_sensor.is_some()));
    assert!(remarks.iter().any(|remark| remark.contains("drive_1.bag.active has no index")), "{remarks:?}");
}

/// Untrusted metadata must not open arbitrary files.
#[test]
fn files_outside_of_the_bag_folder_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).unwrap();
    let outside = folder.path().join("a.mcap");
    std::fs::copy(data("none.mcap"), &outside).unwrap();
    for name in ["../a.mcap".to_owned(), "x/../../a.mcap".to_owned(), outside.display().to_string()] {
        std::fs::create_dir_all(bag.join("x")).unwrap();
        std::fs::write(bag.join("metadata.yaml"), format!("relative_file_paths:\n- {name}\n")).unwrap();
        let error =
            open_recording(from_ref(&bag)).err().map(|error| format!("{error:#}")).unwrap_or_default();
        assert!(error.contains(&format!("lists {name}, which is outside of the folder")), "{error}");
    }
    // The recorder's folder name is ignored if the file was moved.
    std::fs::rename(&outside, bag.join("a.mcap")).unwrap();
    assert!(open_recording(&[bag]).is_ok());
}

/// `a/drive.bag.zstd` and `b/drive.bag.zstd` both decompress to `drive.bag`.
#[test]
fn compressed_parts_with_equal_names_are_all_read() {
    let folder = tempfile::tempdir().unwrap();
    // The first file is larger than the read buffer of an open file.
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
fn compressed_files_use_the_scratch_folder() {
    let folder = tempfile::tempdir().unwrap();
    let packed = zstd::encode_all(std::fs::read(data("only_points.mcap")).unwrap().as_slice(), 3).unwrap();
    std::fs::write(folder.path().join("a.mcap.zstd"), packed).unwrap();
    let paths = [folder.path().to_owned()];
    let gone = folder.path().join("gone");
    let scratch = |scratch: &Path| BagOptions { scratch: Some(scratch.to_owned()), ..BagOptions::default() };
    let error = open_bag(&paths, &scratch(&gone)).err().map(|error| format!("{error:#}")).unwrap_or_default();
    assert!(error.contains("cannot unpack a recording into") && error.contains("gone"), "{error}");
    assert_eq!(read(&paths, &scratch(folder.path())).0.len(), 4);
}

#[test]
fn repeated_file_names_are_read_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("only_points.mcap"), folder.path().join("a.mcap")).unwrap();
    let metadata = format!("relative_file_paths:\n{}", "- a.mcap\n".repeat(100_000));
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (clouds, errors, remarks) = read(&[folder.path().to_owned()], &BagOptions::default());
    assert_eq!((clouds.len(), errors), (4, vec![]));
    assert!(remarks[0].contains("file names are repeated (99999 times)"), "{remarks:?}");
}
