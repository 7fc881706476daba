use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
use crate::support::read;
use std::time::{Duration, Instant};
use voxtile_formats::ros::{BagOptions, open_bag};

/// There are more topic names than the limit, and the messages of these topics precede the wanted ones.
#[test]
fn skipped_topics_do_not_affect_others() {
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
        let is_scanned = remarks.iter().any(|remark| remark.contains("reading the whole file"));
        assert_eq!(is_scanned, name.starts_with("cut"), "{name}: {remarks:?}");
    }
}

/// Inspecting a topic may read the recording up to its first image.
#[test]
fn many_image_topics_are_inspected_in_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let names: Vec<String> =
        (0..3000).flat_map(|k| [format!("/c{k}/image"), format!("/c{k}/camera_info")]).collect();
    let types = ["sensor_msgs/Image", "sensor_msgs/CameraInfo"];
    let topics: Vec<_> =
        names.iter().zip(types.iter().cycle()).map(|(name, of)| (name.as_str(), *of)).collect();
    let messages: Vec<_> = (0..6000).map(|k| (k, k as i64, vec![7; 500])).collect();
    std::fs::write(&path, bag1(&topics, &messages)).unwrap();
    let start = Instant::now();
    let error =
        open_bag(&[path], &BagOptions::default()).err().map(|error| format!("{error:#}")).unwrap_or_default();
    assert!(error.contains("choose one with `topic` NAME: /c100/image") && error.contains("more"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(30), "{:?}", start.elapsed());
}

/// Other programs also use the MCAP container.
#[test]
fn foreign_messages_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    let schema = writer.add_schema("foxglove.PointCloud", "protobuf", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/lidar", "protobuf", &Default::default()).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[1, 2, 3]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    std::fs::write(&path, bytes.into_inner()).unwrap();
    let error = open_bag(&[path], &BagOptions::default()).err().map(|error| format!("{error:#}"));
    let expected = "with another serialization than that of ROS are not supported: /lidar; topics: \
                    /lidar (foxglove.PointCloud, 1 ";
    assert!(error.as_ref().is_some_and(|error| error.contains(expected)), "{error:?}");
}
