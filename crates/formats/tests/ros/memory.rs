use crate::made::bag1::bag1;
use crate::made::message::{F32, MessageWriter};
use crate::support::{data, read, recordings, topic};
use std::slice::from_ref;
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag};

/// Data beyond the memory budget is read from temporary files with equal results.
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
            // Compared as text, because NaN is not equal to itself.
            assert!(format!("{found:?}") == format!("{much:?}"), "{}", path.display());
            assert!(much.0.len() > 1, "{}", path.display());
        }
    }
}

/// Otherwise a full disk would lead to a map without poses.
#[test]
fn missing_temporary_folders_are_errors() {
    let options = BagOptions { memory_bytes: 0, scratch: Some(data("gone")), ..topic("/points") };
    let active = tempfile::NamedTempFile::new().unwrap();
    let whole = std::fs::read(data("bz2.bag")).unwrap();
    // The end of the index is missing.
    std::fs::write(active.path(), &whole[..whole.len() - 10]).unwrap();
    for path in [data("bz2.bag"), data("zstd.mcap"), active.path().to_owned()] {
        let error = open_bag(from_ref(&path), &options).err().map(|error| format!("{error:#}"));
        let wanted = format!("{}: cannot make a temporary file in: ", data("gone").display());
        assert!(
            error.as_ref().is_some_and(|error| error.starts_with(&wanted)),
            "{}: {error:?}",
            path.display()
        );
    }
}

/// Encodes large clouds with and without gaps between rows, a truncated one, and transforms.
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
