use crate::made::voxels::write_voxels;
use crate::support::{clouds, failure, fixture, wanted};
use std::fs;
use std::path::Path;
use voxtile_clouds::RigidPose;
use voxtile_clouds::read::{OpenOptions, open};
use voxtile_clouds::write::VoxelFileFormat;

/// Written by pye57 (libE57Format).
#[test]
fn scans_have_poses_and_invalid_points_are_no_returns() {
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

/// As programs write what is in one frame already: exports of voxels have no pose.
#[test]
fn a_scan_without_a_pose_is_in_the_frame_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.e57");
    write_voxels(VoxelFileFormat::E57, &path, None);
    let read = |options: &OpenOptions| {
        let mut source = open(&path, options).unwrap();
        let (head, points) = crate::support::all(source.as_mut()).unwrap().remove(0);
        (head.world_from_sensor.unwrap(), points[0].position_m, source.remarks())
    };
    let (pose, first, remarks) = read(&OpenOptions::default());
    assert_eq!((pose, first), (RigidPose::IDENTITY, [0.25; 3]));
    assert!(remarks[0].starts_with("1 of 1 scans have no pose: ") && remarks[0].contains("--sensor-origin"));
    let origin = OpenOptions { sensor_origin_m: Some([1.0, 2.0, 3.0]), ..OpenOptions::default() };
    let (pose, first, remarks) = read(&origin);
    assert_eq!((pose.position_m, first), ([1.0, 2.0, 3.0], [-0.75, -1.75, -2.75]));
    assert!(remarks.is_empty(), "{remarks:?}");
}

#[test]
fn no_damage_makes_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.e57");
    let bytes = fs::read(fixture("scans.e57")).unwrap();
    for at in (0..bytes.len()).step_by(29) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        fs::write(&path, &damaged).unwrap();
        if let Ok(mut source) = open(&path, &OpenOptions::default()) {
            drop(crate::support::all(source.as_mut()));
        }
    }
}

/// The library would make points of it until there is no memory.
#[test]
fn points_that_take_no_bits_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("constant.e57");
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/cloud_e57/without-bits");
    // The first byte is for the target of the fuzzer.
    fs::write(&path, &fs::read(corpus).unwrap()[1..]).unwrap();
    let (error, points) = failure(&path, &OpenOptions::default());
    assert!(error.contains("constant.e57, record 0: every field of its points has"), "{error}");
    assert_eq!(points, 0);
}
