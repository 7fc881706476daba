use crate::support::{clouds, clouds_with, failure, fixture, wanted};
use std::fs;
use voxtile_formats::{CloudPoint, RigidPose};
use voxtile_formats::{ReadOptions, Registry};

#[test]
fn every_ply_encoding_is_read() {
    for name in ["ascii.ply", "little.ply", "big.ply"] {
        let clouds = clouds(&fixture(name));
        let [(head, points)] = clouds.as_slice() else { panic!("{} clouds", clouds.len()) };
        assert_eq!((head.points, head.has_intensities, head.has_times), (Some(20), true, true), "{name}");
        let timed: Vec<CloudPoint> = (wanted([0.0; 3]).into_iter().zip(0..))
            .map(|(point, k)| CloudPoint { time_s: f64::from(k * 1_000_000) * 1e-9, ..point })
            .collect();
        assert_eq!(points, &timed, "{name}");
    }
}

/// Text has more digits than a float, which are dropped; a double keeps them.
#[test]
fn text_and_binary_ply_give_equal_points() {
    let folder = tempfile::tempdir().unwrap();
    let rows: [[f64; 3]; 2] = [[0.1, -1e-3, 16_777_217.0], [1.0 / 3.0, 2e30, -0.7]];
    let file = |format: &str, body: &[Vec<u8>]| {
        let head = format!(
            "ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty double y\nproperty float32 z\n\
             end_header\n"
        );
        let path = folder.path().join(format!("{format}.ply"));
        fs::write(&path, [head.into_bytes(), body.concat()].concat()).unwrap();
        clouds(&path).remove(0).1
    };
    let little = rows.map(|[x, y, z]| {
        [&(x as f32).to_le_bytes()[..], &y.to_le_bytes(), &(z as f32).to_le_bytes()].concat()
    });
    let big = rows.map(|[x, y, z]| {
        [&(x as f32).to_be_bytes()[..], &y.to_be_bytes(), &(z as f32).to_be_bytes()].concat()
    });
    let text = file("ascii", &rows.map(|[x, y, z]| format!("{x:.17} {y} {z:e}\n").into_bytes()));
    assert_eq!(text, file("binary_little_endian", &little));
    assert_eq!(text, file("binary_big_endian", &big));
    assert_eq!(text[0].position_m, [f64::from(0.1_f32), -1e-3, 16_777_216.0]);
}

#[test]
fn truncated_ply_gives_complete_points() {
    let folder = tempfile::tempdir().unwrap();
    // Removes a face of 13 bytes and a part of the last vertex; from the text, one and a half lines.
    for (name, cut) in [("little.ply", 15), ("big.ply", 15), ("ascii.ply", 12)] {
        let bytes = fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        fs::write(&path, &bytes[..bytes.len() - cut]).unwrap();
        let (error, points) = failure(&path, &ReadOptions::default());
        assert!(error.contains("of 20 vertex") || error.contains("is missing"), "{error}");
        assert_eq!(points, 19, "{name}: {error}");
    }
}

#[test]
fn text_and_raw_floats_give_equal_points() {
    for name in ["points.csv", "points.xyz", "kitti.bin", "nuscenes.pcd.bin"] {
        let clouds = clouds(&fixture(name));
        assert_eq!(clouds.len(), 1, "{name}");
        assert_eq!(clouds[0].1, wanted([0.0; 3]), "{name}");
        assert!(clouds[0].0.has_intensities, "{name}");
    }
    let fields = ["z", "y", "x", "intensity"].map(str::to_owned).to_vec();
    let turned =
        clouds_with(&fixture("kitti.bin"), &ReadOptions { fields: Some(fields), ..Default::default() });
    assert_eq!(turned[0].1[0].position_m, [10.0, -7.0, -3.0]);
}

#[test]
fn raw_floats_that_do_not_fit_their_columns_are_an_error() {
    let fields = ["x", "y", "z"].map(str::to_owned).to_vec();
    let (error, points) =
        failure(&fixture("kitti.bin"), &ReadOptions { fields: Some(fields), ..Default::default() });
    assert!(error.contains("320 bytes are not a whole number of points of 3 floats"), "{error}");
    assert_eq!(points, 0);
}

/// Encodes a file of raw floats. `row` returns the columns of a point.
fn raw_floats(points: usize, row: impl Fn(f32) -> Vec<f32>) -> Vec<u8> {
    (0..points).flat_map(|k| row(k as f32)).flat_map(f32::to_le_bytes).collect()
}

#[test]
fn five_columns_are_not_read_as_four() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("0.bin");
    let wall = |k: f32| [8.25, 0.1 * k - 3.0, 0.03 * k];
    fs::write(&path, raw_floats(400, |k| [&wall(k)[..], &[k % 97.0, k % 32.0]].concat())).unwrap();
    let (error, points) = failure(&path, &ReadOptions::default());
    assert!(error.contains("`fields` x,y,z,intensity,ring or") && error.contains("0.bin"), "{error}");
    assert_eq!(points, 0);
    let five = ["x", "y", "z", "intensity", "ring"].map(str::to_owned).to_vec();
    let (_, points) = clouds_with(&path, &ReadOptions { fields: Some(five), ..Default::default() }).remove(0);
    assert_eq!((points.len(), points[1].position_m[0], points[33].intensity), (400, 8.25, 33.0));
    let four = ["x", "y", "z", "intensity"].map(str::to_owned).to_vec();
    let four_columns = ReadOptions { fields: Some(four), ..Default::default() };
    assert_eq!(clouds_with(&path, &four_columns)[0].1.len(), 500);
}

#[test]
fn four_column_files_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("0.bin");
    let grid = |k: f32| [(k / 20.0).floor(), k % 20.0, 2.0];
    for (what, bytes) in [
        ("intensities from 0 to 1", raw_floats(500, |k| vec![0.1 * k, -3.0, 0.5, k / 500.0])),
        ("whole intensities", raw_floats(500, |k| vec![0.1 * k, -3.0, 0.5, k % 256.0])),
        ("whole metres", raw_floats(400, |k| [&grid(k)[..], &[0.37]].concat())),
        ("whole metres and intensities", raw_floats(400, |k| [&grid(k)[..], &[k % 256.0]].concat())),
        ("whole metres and odd intensities", raw_floats(400, |k| [&grid(k)[..], &[1.5 + k]].concat())),
        ("nothing but zeros", raw_floats(500, |_| vec![0.0; 4])),
        ("one place", raw_floats(500, |_| vec![3.0, 3.0, 3.0, 700.5])),
        ("no numbers", raw_floats(500, |k| vec![k, 1.0, 2.0, f32::NAN])),
        ("few points", raw_floats(15, |k| vec![1.5, -2.5, k, 0.5])),
        ("no points", Vec::new()),
    ] {
        fs::write(&path, &bytes).unwrap();
        // An empty file has no detectable format.
        let options = ReadOptions { format: Some("bin".into()), ..ReadOptions::default() };
        assert_eq!(clouds_with(&path, &options)[0].1.len(), bytes.len() / 16, "{what}");
    }
}

#[test]
fn a_folder_is_read_in_natural_order_with_stamps_of_names() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["10.bin", "9.bin", "1700000000123456789.bin"] {
        fs::copy(fixture("kitti.bin"), folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("times.txt"), "0\n1\n").unwrap();
    let clouds = clouds(folder.path());
    let found: Vec<_> = clouds.iter().map(|(head, _)| (head.name.as_str(), head.stamp_ns)).collect();
    let stamp_ns = Some(1_700_000_000_123_456_789);
    assert_eq!(found, [("9.bin", None), ("10.bin", None), ("1700000000123456789.bin", stamp_ns)]);
}

/// A table of poses among text clouds, given by different paths.
#[test]
fn files_used_by_other_options_are_not_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for name in ["1.csv", "2.csv"] {
        fs::write(scans.join(name), "4 0 0\n").unwrap();
    }
    fs::write(scans.join("0_gps.csv"), "timestamp,tx,ty,tz\n0,1,2,3\n").unwrap();
    fs::write(scans.join("lens.txt"), "500 500 320 240\n").unwrap();
    // A file whose name differs from all others is inspected.
    let source = voxtile_formats::open_clouds(&scans, &ReadOptions::default()).unwrap();
    assert_eq!((source.len_hint(), source.remarks().len()), (Some(2), 2));
    let other_path = scans.join("../scans/0_gps.csv");
    assert_eq!(Registry::default().guess(&scans, std::slice::from_ref(&other_path)).unwrap().name, "xyz");
    let options = ReadOptions {
        not_clouds: vec![other_path, folder.path().join("nothing")],
        intrinsics_path: Some(scans.join("lens.txt")),
        ..ReadOptions::default()
    };
    let source = voxtile_formats::open_clouds(&scans, &options).unwrap();
    assert_eq!((source.len_hint(), source.ends()), (Some(2), Some(["1.csv", "2.csv"].map(str::to_owned))));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(scans.join("0_gps.csv"), scans.join("3.csv")).unwrap();
        assert_eq!(voxtile_formats::open_clouds(&scans, &options).unwrap().len_hint(), Some(2));
    }
}

#[test]
fn invalid_files_of_a_folder_are_skipped() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["1.ply", "2.ply", "3.ply"] {
        fs::copy(fixture("little.ply"), folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("2.ply"), "ply\nformat ascii 1.0\nelement point 5\nend_header\n").unwrap();
    let mut source = voxtile_formats::open_clouds(folder.path(), &ReadOptions::default()).unwrap();
    assert_eq!(source.len_hint(), Some(3));
    assert_eq!(source.next_cloud().unwrap().map(|head| head.name), Some("1.ply".into()));
    let error = format!("{:#}", source.next_cloud().unwrap_err());
    assert!(error.contains("2.ply: malformed: line 4: the file has no element `vertex`"), "{error}");
    assert_eq!(source.next_cloud().unwrap().map(|head| head.name), Some("3.ply".into()));
    assert_eq!(source.next_cloud().unwrap(), None);
}

#[test]
fn registered_points_are_relative_to_the_sensor_origin() {
    let options = ReadOptions { sensor_origin_m: Some([1.0, 2.0, 4.0]), ..Default::default() };
    let clouds = clouds_with(&fixture("points.csv"), &options);
    let (head, points) = &clouds[0];
    assert_eq!(
        head.world_from_sensor,
        Some(RigidPose { position_m: [1.0, 2.0, 4.0], ..RigidPose::IDENTITY })
    );
    assert_eq!(points, &wanted([-1.0, -2.0, -4.0]));
}

#[test]
fn damage_of_small_files_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["ascii.ply", "little.ply", "points.csv"] {
        let bytes = fs::read(fixture(name)).unwrap();
        for at in (0..bytes.len()).step_by(7) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x15;
            damaged.truncate(bytes.len() - at % 13);
            let path = folder.path().join(name);
            fs::write(&path, &damaged).unwrap();
            if let Ok(mut source) = voxtile_formats::open_clouds(&path, &ReadOptions::default()) {
                let _ = crate::support::all(source.as_mut());
            }
        }
    }
}
