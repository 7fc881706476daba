use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
#[cfg(feature = "sqlite")]
use crate::support::assert_clouds;
use crate::support::{data, read, topic};
use std::path::Path;
use std::slice::from_ref;
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag};
use voxtile_formats::{ReadOptions, RecordingOptions, Registry, open_clouds};

fn cloud(writer: MessageWriter, x_m: f32) -> Vec<u8> {
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    writer.point_cloud2(5, "lidar", &fields, &[[x_m, 1.0, 2.0].map(f32::to_le_bytes).concat()])
}

/// Encodes an MCAP file without compression.
fn mcap_of(messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/PointCloud2", "ros2msg", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/points", "cdr", &Default::default()).unwrap();
    for (message, at) in messages.iter().zip(0..) {
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: at, publish_time: at };
        writer.write_to_known_channel(&header, message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

fn zstd_of(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 3).unwrap()
}

fn unposed() -> BagOptions {
    BagOptions { poses: PoseSource::None, ..BagOptions::default() }
}

#[test]
fn compressed_messages_are_read_without_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let plain: Vec<Vec<u8>> = (1..4).map(|k| cloud(MessageWriter::cdr(), k as f32)).collect();
    // The last message is not compressed.
    let mut packed: Vec<Vec<u8>> = plain.iter().map(|message| zstd_of(message)).collect();
    packed[2].clone_from(&plain[2]);
    std::fs::write(&path, mcap_of(&packed)).unwrap();
    for memory_bytes in [0, 64 << 20] {
        let (clouds, errors, remarks) = read(from_ref(&path), &BagOptions { memory_bytes, ..unposed() });
        let xs: Vec<f64> = clouds.iter().map(|(_, points)| points[0].position_m[0]).collect();
        assert_eq!((xs, errors, remarks), (vec![1.0, 2.0, 3.0], vec![], vec![]));
    }
    packed[1].truncate(20);
    std::fs::write(&path, mcap_of(&packed)).unwrap();
    let (clouds, errors, _) = read(from_ref(&path), &unposed());
    assert_eq!(clouds.len(), 2);
    assert!(errors[0].contains("a message recorded at 1 ns cannot be decompressed"), "{errors:?}");
}

#[cfg(feature = "sqlite")]
#[test]
fn databases_of_compressed_messages_are_read_without_metadata() {
    let (clouds, errors, remarks) = read(&[data("by_message/by_message.db3")], &topic("/points"));
    assert_eq!((errors, remarks), (vec![], vec![]));
    assert_clouds(&clouds, "map", "by message");
}

/// Messages in a ROS 1 bag may contain any bytes, even the signature of a compressed message.
#[test]
fn ros_1_messages_are_not_decompressed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let mut message = cloud(MessageWriter::ros1(), 3.0);
    message[..4].copy_from_slice(b"\x28\xb5\x2f\xfd");
    std::fs::write(&path, bag1(&[("/points", "sensor_msgs/PointCloud2")], &[(0, 5, message)])).unwrap();
    let (clouds, errors, _) = read(&[path], &unposed());
    assert_eq!((clouds[0].1[0].position_m[0], errors), (3.0, vec![]));
}

#[test]
fn compressed_files_are_read_without_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let guess = |path: &Path| Registry::default().guess(path, &[]).map(|format| format.name);
    for (name, format) in [("only_points.mcap", "mcap"), ("none.bag", "bag")] {
        for end in ["zstd", "zst"] {
            let path = folder.path().join(format!("{name}.{end}"));
            std::fs::write(&path, zstd_of(&std::fs::read(data(name)).unwrap())).unwrap();
            assert_eq!(guess(&path).unwrap(), format);
            let (clouds, errors, remarks) =
                read(from_ref(&path), &BagOptions { poses: PoseSource::None, ..topic("/points") });
            assert_eq!((clouds.len(), errors, remarks), (4, vec![], vec![]), "{name}");
            // The file is also read if its format is given.
            let named = ReadOptions { format: Some(format.to_owned()), ..ReadOptions::default() };
            let named = ReadOptions {
                recording: RecordingOptions { topic: Some("/points".into()), ..Default::default() },
                ..named
            };
            assert_eq!(open_clouds(&path, &named).unwrap().len_hint(), Some(4));
            // The file is also read if it is the only one of a folder.
            let inner = tempfile::tempdir().unwrap();
            std::fs::copy(&path, inner.path().join(format!("{name}.{end}"))).unwrap();
            assert_eq!(guess(inner.path()).unwrap(), format);
            assert_eq!(read(&[inner.path().to_owned()], &topic("/points")).0.len(), 4);
        }
    }
    // A compressed file of another kind is refused.
    let path = folder.path().join("a.las.zst");
    std::fs::write(&path, zstd_of(b"LASF")).unwrap();
    let error = guess(&path).err().map(|error| format!("{error:#}")).unwrap();
    assert!(error.contains("unpack it"), "{error}");
    // Double compression is not supported.
    let path = folder.path().join("b.mcap.zst");
    std::fs::write(&path, zstd_of(&zstd_of(&std::fs::read(data("only_points.mcap")).unwrap()))).unwrap();
    let error = open_bag(from_ref(&path), &unposed()).err().map(|error| format!("{error:#}")).unwrap();
    assert!(error.contains("b.mcap.zst: malformed: offset 0: it was unpacked, but its contents"), "{error}");
}

/// A recorder whose disk is disconnected leaves a file that ends within its first chunk.
#[test]
fn files_truncated_before_any_message_report_the_offset() {
    let folder = tempfile::tempdir().unwrap();
    for (name, at) in [("zstd.mcap", 30), ("lz4.mcap", 30), ("bz2.bag", 30), ("zstd.mcap", 3)] {
        let whole = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name);
        // The header of the first chunk is complete, its contents are not.
        let start = match name {
            "bz2.bag" => whole.windows(3).position(|bytes| bytes == b"BZh").unwrap(),
            _ => 8 + 9 + u64::from_le_bytes(whole[9..17].try_into().unwrap()) as usize + 9 + 60,
        };
        // The file may also end within the header of a record.
        let len = if at == 3 { start - 60 - 9 + at } else { start + at };
        std::fs::write(&path, &whole[..len]).unwrap();
        let error =
            open_bag(&[path], &BagOptions::default()).err().map(|error| format!("{error:#}")).unwrap();
        let expected = match at {
            3 => format!("truncated at byte {len}, in the record at byte {}", len - at),
            _ => format!("truncated at byte {len}: the record at byte "),
        };
        assert!(error.contains("it contains no topics; ") && error.contains(&expected), "{error}");
        assert!(error.contains("0 messages were found"), "{error}");
    }
}
