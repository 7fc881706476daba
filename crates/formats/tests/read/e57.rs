use crate::made::voxels::write_voxels;
use crate::support::{clouds, failure, fixture, wanted};
use std::fs;
use std::path::Path;
use voxtile_formats::RigidPose;
use voxtile_formats::{ReadOptions, open_clouds};

/// The fixture was written by pye57 (libE57Format).
#[test]
fn scans_have_poses_and_invalid_points_are_not_returns() {
    let clouds = clouds(&fixture("scans.e57"));
    let names: Vec<&str> = clouds.iter().map(|(head, _)| head.name.as_str()).collect();
    assert_eq!(names, ["scan at 0", "scan at 100"]);
    for ((head, points), shift) in clouds.iter().zip([0.0, 100.0]) {
        let pose = head.world_from_sensor.unwrap();
        assert_eq!(pose.position_m, [shift, 2.0, 3.0]);
        let half = 0.5_f64.sqrt();
        for (found, wanted) in pose.quaternion.iter().zip([0.0, 0.0, half, half]) {
            assert!((found - wanted).abs() < 1e-12, "{pose:?}");
        }
        assert_eq!((head.points, head.has_intensities), (Some(20), true));
        let wanted = wanted([shift, 0.0, 0.0]);
        for (number, (found, wanted)) in points.iter().zip(&wanted).enumerate() {
            assert_eq!(found.is_return, number != 5);
            if found.is_return {
                let is_near = |k: usize| (found.position_m[k] - wanted.position_m[k]).abs() < 1e-6;
                assert!((0..3).all(is_near) && found.intensity == wanted.intensity, "{found:?} {wanted:?}");
            }
        }
        assert_eq!(points.len(), 20);
    }
}

/// Data already in one frame, such as exported voxels, has no pose.
#[test]
fn scans_without_pose_are_in_the_file_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.e57");
    write_voxels("e57", &path, None);
    let read = |options: &ReadOptions| {
        let mut source = open_clouds(&path, options).unwrap();
        let (head, points) = crate::support::all(source.as_mut()).unwrap().remove(0);
        (head.world_from_sensor.unwrap(), points[0].position_m, source.remarks())
    };
    let (pose, first, remarks) = read(&ReadOptions::default());
    assert_eq!((pose, first), (RigidPose::IDENTITY, [0.25; 3]));
    assert!(remarks[0].starts_with("1 of 1 scans have no pose: ") && remarks[0].contains("`sensor_origin`"));
    let origin = ReadOptions { sensor_origin_m: Some([1.0, 2.0, 3.0]), ..ReadOptions::default() };
    let (pose, first, remarks) = read(&origin);
    assert_eq!((pose.position_m, first), ([1.0, 2.0, 3.0], [-0.75, -1.75, -2.75]));
    assert!(remarks.is_empty(), "{remarks:?}");
}

#[test]
fn damage_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.e57");
    let bytes = fs::read(fixture("scans.e57")).unwrap();
    for at in (0..bytes.len()).step_by(29) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        fs::write(&path, &damaged).unwrap();
        if let Ok(mut source) = open_clouds(&path, &ReadOptions::default()) {
            drop(crate::support::all(source.as_mut()));
        }
    }
}

/// If points take no bits in the file, the library would create points until the memory is exhausted.
#[test]
fn points_without_bits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("constant.e57");
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/cloud_e57/without-bits");
    // The first byte is only for the fuzz target.
    fs::write(&path, &fs::read(corpus).unwrap()[1..]).unwrap();
    let (error, points) = failure(&path, &ReadOptions::default());
    assert!(error.contains("constant.e57: malformed: record 0: every field has equal"), "{error}");
    assert_eq!(points, 0);
}

/// Writes a file with this XML section.
fn described(path: &Path, xml: &[u8]) {
    let mut content = b"ASTM-E57".to_vec();
    content.extend([1_u32, 0].iter().flat_map(|number| number.to_le_bytes()));
    let pages = (48 + xml.len()).div_ceil(1020);
    for number in [1024 * pages as u64, 48, xml.len() as u64, 1024] {
        content.extend(number.to_le_bytes());
    }
    content.extend(xml);
    content.resize(1020 * pages, 0);
    // Checksums are only verified after the tested checks.
    let file: Vec<u8> = content.chunks(1020).flat_map(|page| [page, &[0; 4]].concat()).collect();
    fs::write(path, file).unwrap();
}

#[test]
fn foreign_and_truncated_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.e57");
    let whole = fs::read(fixture("scans.e57")).unwrap();
    let page = b"<!DOCTYPE html><html><body>The file has moved to another server.</body></html>";
    let cut = "offset 0: it is not an E57 file, or is truncated: copy it again";
    for (bytes, reason) in
        [(&b""[..], cut), (&whole[..8], cut), (&whole[..47], cut), (page, "is an HTML page, not data")]
    {
        fs::write(&path, bytes).unwrap();
        let (error, _) =
            failure(&path, &ReadOptions { format: Some("e57".into()), ..ReadOptions::default() });
        assert!(error.contains(reason), "{error}");
    }
}

/// The library compares each attribute of a tag with the previous ones, so many attributes take very long.
#[test]
fn tags_with_many_attributes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.e57");
    let attributes: String = (0..200_000).map(|k| format!(" a{k}=''")).collect();
    described(&path, format!("<e57Root{attributes}/>").as_bytes());
    let (error, _) = failure(&path, &ReadOptions::default());
    assert!(error.contains("more than 256 attributes in one tag"), "{error}");
}

/// The library decodes a packet as a whole, so a packet must fit in memory.
#[test]
fn packets_that_exceed_the_memory_are_refused() {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bits.e57");
    let mut writer = E57Writer::from_file(&path, "{a}").unwrap();
    let bit = RecordDataType::Integer { min: 0, max: 1 };
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let scaled = RecordDataType::ScaledInteger { min: 0, max: 1, scale: 1.0, offset: 0.0 };
    let fields = names.map(|name| Record { name, data_type: scaled.clone() });
    let row = Record { name: RecordName::RowIndex, data_type: bit };
    let fields = fields.into_iter().chain([row]).collect();
    let mut cloud = writer.add_pointcloud("{b}", fields).unwrap();
    for k in 0..400_000 {
        let value = RecordValue::ScaledInteger(k % 2);
        cloud.add_point(vec![value.clone(), value.clone(), value, RecordValue::Integer(0)]).unwrap();
    }
    cloud.finalize().unwrap();
    writer.finalize().unwrap();
    let with = |memory_bytes| ReadOptions { memory_bytes, ..ReadOptions::default() };
    let (error, points) = failure(&path, &with(0));
    assert!(
        error.contains("record 0: a packet of points would need") && error.contains("`memory`"),
        "{error}"
    );
    assert_eq!(points, 0);
    let clouds = crate::support::clouds_with(&path, &with(128 << 20));
    assert_eq!(clouds[0].1.len(), 400_000);
}
