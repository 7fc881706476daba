use serde_json::Value;
use std::path::{Path, PathBuf};
use voxtile_formats::ros::{BagOptions, open_bag};
use voxtile_formats::{CloudHead, CloudPoint, CloudSource, RigidPose};

pub const FILES: [&str; 8] =
    ["none.bag", "bz2.bag", "lz4.bag", "none.mcap", "lz4.mcap", "zstd.mcap", "ros1.mcap", "unchunked.mcap"];
#[cfg(feature = "sqlite")]
pub const FOLDERS: &[&str] = &["folder", "by_file", "by_message", "folder/folder.db3"];
#[cfg(not(feature = "sqlite"))]
pub const FOLDERS: &[&str] = &[];

pub type Cloud = (CloudHead, Vec<CloudPoint>);

pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ros").join(name)
}

pub fn recordings() -> impl Iterator<Item = &'static str> {
    FILES.into_iter().chain(FOLDERS.iter().copied())
}

pub fn expected() -> Value {
    serde_json::from_slice(&std::fs::read(data("expected.json")).unwrap()).unwrap()
}

pub fn topic(name: &str) -> BagOptions {
    BagOptions { topic: Some(name.to_owned()), ..BagOptions::default() }
}

/// Returns all clouds, errors and remarks.
pub fn read(paths: &[PathBuf], options: &BagOptions) -> (Vec<Cloud>, Vec<String>, Vec<String>) {
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
                errors.extend(result.err().map(|error| format!("{error:#}")));
                clouds.push((head, points));
            }
            Ok(None) => break,
            Err(error) => errors.push(format!("{error:#}")),
        }
    }
    let remarks = source.remarks();
    (clouds, errors, remarks)
}

pub fn assert_points(points: &[CloudPoint], rows: &Value, of: &str) {
    let rows = rows.as_array().unwrap();
    assert_eq!(points.len(), rows.len(), "{of}");
    for (k, (point, row)) in points.iter().zip(rows).enumerate() {
        let near = |value: f64, wanted: &Value, room: f64| match wanted.as_f64() {
            Some(wanted) => (value - wanted).abs() <= room,
            None => value.is_nan(),
        };
        let is_right = (0..3).all(|axis| near(point.position_m[axis], &row[axis], 1e-6))
            && near(f64::from(point.intensity), &row[3], 0.0)
            // Resolution of `f64` stamps in seconds since the epoch.
            && near(point.time_s, &row[4], 3e-7)
            && Some(point.is_return) == row[5].as_bool();
        assert!(is_right, "{of}, point {k}: {point:?} is not {row}");
    }
}

pub fn assert_pose(pose: Option<RigidPose>, wanted: &Value, of: &str) {
    let pose = pose.unwrap_or_else(|| panic!("{of}: no pose"));
    let numbers: Vec<f64> = pose.position_m.into_iter().chain(pose.quaternion).collect();
    let wanted: Vec<f64> = wanted.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    let sign = if pose.quaternion[3] * wanted[6] < 0.0 { -1.0 } else { 1.0 };
    for k in 0..7 {
        let value = if k < 3 { numbers[k] } else { sign * numbers[k] };
        assert!((value - wanted[k]).abs() < 1e-9, "{of}: {numbers:?} is not {wanted:?}");
    }
}

pub fn assert_clouds(clouds: &[Cloud], frame: &str, of: &str) {
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
