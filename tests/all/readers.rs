use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use testkit::memory_folder::lone_folder;
use testkit::random_scans::Random;
use testkit::support::{fixtures, message_of, shared_data};
use voxtile::scan::Pose;
use voxtile_formats::{PointBudget, ReadOptions, SensorScan, open_scans, read_pcd};

const HEADER: &str =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n";

pub fn points(count: usize) -> Vec<[f32; 4]> {
    let mut random = Random(9);
    (0..count).map(|_| [0; 4].map(|_| random.between(-50.0, 50.0) as f32)).collect()
}

pub fn pcd(encoding: &str, points: &[[f32; 4]]) -> Vec<u8> {
    let count = points.len();
    let mut file = format!(
        "{HEADER}WIDTH {count}\nHEIGHT 1\nVIEWPOINT 1 2 3 0 0 0 1\nPOINTS {count}\nDATA {encoding}\n"
    );
    let rows =
        |file: &mut Vec<u8>| points.iter().flatten().for_each(|value| file.extend(value.to_le_bytes()));
    match encoding {
        "ascii" => {
            for [x, y, z, i] in points {
                file += &format!("{x} {y} {z} {i}\n");
            }
            file.into_bytes()
        }
        "binary" => {
            let mut file = file.into_bytes();
            rows(&mut file);
            file
        }
        _ => {
            let columns: Vec<u8> = (0..4)
                .flat_map(|column| points.iter().flat_map(move |point| point[column].to_le_bytes()))
                .collect();
            // Literal runs of 32 bytes: valid LZF that saves nothing.
            let packed: Vec<u8> =
                columns.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
            let mut file = file.into_bytes();
            file.extend((packed.len() as u32).to_le_bytes());
            file.extend((columns.len() as u32).to_le_bytes());
            file.extend(packed);
            file
        }
    }
}

fn with_poses(path: &Path) -> ReadOptions {
    ReadOptions { poses: Some(path.to_owned()), ..ReadOptions::default() }
}

fn all_scans(path: &Path) -> Vec<SensorScan> {
    let mut source = open_scans(path, &ReadOptions::default()).unwrap();
    std::iter::from_fn(|| source.next_scan().unwrap()).collect()
}

#[test]
fn the_three_encodings_of_a_cloud_are_one_cloud() {
    let points = points(500);
    let clouds =
        ["ascii", "binary", "binary_compressed"].map(|encoding| read_pcd(&pcd(encoding, &points)).unwrap());
    for cloud in &clouds {
        assert_eq!(cloud.points_in_sensor[7], [0, 1, 2].map(|k| f64::from(points[7][k])));
        assert_eq!(cloud.points_in_sensor, clouds[0].points_in_sensor);
        assert_eq!(cloud.intensities, clouds[0].intensities);
        assert_eq!(cloud.world_from_sensor.position_m(), [1.0, 2.0, 3.0]);
    }
}

#[test]
fn fields_of_any_type_order_and_padding_are_read() {
    let header =
        "FIELDS i _ z y x\nSIZE 2 1 8 4 4\nTYPE U U F I F\nCOUNT 1 3 1 1 1\nWIDTH 1\nHEIGHT 1\nDATA binary\n";
    let mut file = header.as_bytes().to_vec();
    file.extend(700_u16.to_le_bytes());
    file.extend([9, 9, 9]);
    file.extend((-2.5_f64).to_le_bytes());
    file.extend((-3_i32).to_le_bytes());
    file.extend(f32::NAN.to_le_bytes());
    let cloud = read_pcd(&file).unwrap();
    assert!(cloud.points_in_sensor[0][0].is_nan());
    assert_eq!((cloud.points_in_sensor[0][1], cloud.points_in_sensor[0][2]), (-3.0, -2.5));
    assert_eq!(cloud.intensities, Some(vec![700.0]));
}

#[test]
fn invalid_pcd_files_are_errors_with_a_reason() {
    let good = String::from_utf8(pcd("ascii", &points(3))).unwrap();
    let changed = |from: &str, to: &str| message_of(read_pcd(good.replace(from, to).as_bytes()));
    for (from, to, message) in [
        ("FIELDS x y z", "FIELDS x y w", "the points have no field z"),
        ("SIZE 4 4 4 4", "SIZE 4 4 4", "SIZE has 3 entries for 4 fields"),
        ("TYPE F F F F", "TYPE F F F Q", "field intensity has an unsupported combination of type Q"),
        ("DATA ascii", "DATA zip", "DATA must be ascii, binary or binary_compressed, not zip"),
        ("POINTS 3", "POINTS 4", "POINTS 4 is not WIDTH times HEIGHT, 3"),
        ("VIEWPOINT 1 2 3 0 0 0 1", "VIEWPOINT 1 2", "VIEWPOINT needs seven finite numbers"),
        ("VIEWPOINT 1 2 3 0 0 0 1", "VIEWPOINT 1 2 3 0 0 0 0", "a quaternion of length 0"),
        ("VIEWPOINT 1 2 3 0 0 0 1", "VIEWPOINT 1 2 3 0 1e300 0 0", "a quaternion too long to be a rotation"),
        ("VERSION", "VERSOIN", "line 2: `VERSOIN` is not a key"),
    ] {
        let error = changed(from, to);
        assert!(error.contains(message), "{error}");
    }
    assert!(message_of(read_pcd(b"ply\nformat")).contains("line 1"));
    assert!(
        changed("WIDTH 3\nHEIGHT 1", "WIDTH 99999999999999999999\nHEIGHT 1")
            .contains("is not a valid number")
    );
    for encoding in ["ascii", "binary", "binary_compressed"] {
        let file = pcd(encoding, &points(40));
        for length in 0..file.len() - 12 {
            assert!(read_pcd(&file[..length]).is_err(), "{encoding} cut to {length}");
        }
    }
}

#[test]
fn damaged_pcd_files_never_panic() {
    let mut random = Random(77);
    for encoding in ["ascii", "binary", "binary_compressed"] {
        let good = pcd(encoding, &points(10));
        for _ in 0..20_000 {
            let mut file = good.clone();
            for _ in 0..1 + random.below(5) {
                let at = random.below(file.len() as u64) as usize;
                file[at] = random.next() as u8;
            }
            drop(read_pcd(&file));
        }
    }
}

#[test]
fn mismatched_numbers_of_poses_and_files_are_errors_with_both_counts() {
    let folder = TempDir::new().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for number in 0..3 {
        fs::write(scans.join(format!("{number}.pcd")), pcd("binary", &points(5))).unwrap();
    }
    assert_eq!(all_scans(folder.path())[1].world_from_sensor.position_m()[1], 2.0, "from VIEWPOINT");
    let write = |text: &str| fs::write(folder.path().join("poses_tum.txt"), text).unwrap();
    write("# t x y z qx qy qz qw\n0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n\n2 3 0 0 0 0 0.6 0.8\n");
    let read = all_scans(folder.path());
    assert_eq!(
        read.iter().map(|scan| scan.world_from_sensor.position_m()[0]).collect::<Vec<_>>(),
        [1.0, 2.0, 3.0]
    );
    let fingerprint = open_scans(&scans, &ReadOptions::default()).unwrap().fingerprint().unwrap();
    write("0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3.5 0 0 0 0 0 1\n");
    assert_ne!(open_scans(&scans, &ReadOptions::default()).unwrap().fingerprint().unwrap(), fingerprint);
    for (text, message) in [
        ("0 1 0 0 0 0 0 1\n", "1 poses for 3 clouds"),
        ("0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n3 3 0 0 0 0 0 1\n", "4 poses for 3 clouds"),
        ("0 1 0 0 0 0 0 0\n", "line 1: the quaternion 0 0 0 0 has length 0.000, not 1"),
        ("0 1 0 0 0 0 1e300 0\n", "the quaternion 0 0 1e300 0 has length inf, not 1"),
        ("0 1 0 NaN 0 0 0 1\n", "line 1: `NaN` is not finite"),
        ("0 1 0\n", "line 1: 3 numbers; a pose is 8 numbers (TUM"),
        ("1 0 0 0 0 2 0 0 0 0 1 0\n", "line 1: the matrix is not a rotation"),
        ("0 1 0 zero 0 0 0 1\n", "`zero` is not a number"),
    ] {
        write(text);
        let error = message_of(open_scans(folder.path(), &ReadOptions::default()));
        assert!(error.contains(message), "{error}");
    }
}

/// Scans without poses, identified by the x coordinate of their first point, in files with the given names.
fn unplaced(folder: &Path, names: &[&str]) {
    for (number, name) in names.iter().enumerate() {
        let text =
            format!("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n{number} 1 1\n");
        fs::write(folder.join(name), text).unwrap();
    }
}

/// Library callers can combine options that the command's arguments cannot.
#[test]
fn points_in_the_world_frame_are_not_deskewed() {
    let (_outer, folder) = lone_folder();
    unplaced(&folder, &["0.pcd"]);
    let mut options = ReadOptions { poses: Some("identity".into()), ..ReadOptions::default() };
    (options.clouds.is_deskewed, options.clouds.is_world_frame) = (true, true);
    let error = message_of(open_scans(&folder, &options).map(drop));
    assert!(error.contains("deskew, world_frame: points in the world frame are already"), "{error}");
}

#[test]
fn files_are_read_in_natural_order_and_scans_without_poses_are_errors() {
    use voxtile_formats::PoseSource;
    let (_outer, folder) = lone_folder();
    let names: Vec<String> = (0..12).map(|number| format!("full{number}.pcd")).collect();
    unplaced(&folder, &names.iter().map(String::as_str).collect::<Vec<_>>());
    fs::write(folder.join("trajectory.txt"), "0 0 0 0 0 0 0 1\n".repeat(12)).unwrap();
    let error = message_of(open_scans(&folder, &ReadOptions::default()));
    assert!(error.contains("has no poses"), "{error}");
    assert!(error.contains("trajectory.txt looks like one") && error.contains("`poses` identity"), "{error}");

    let mut meant = open_scans(&folder, &with_poses(Path::new("identity"))).unwrap();
    assert_eq!(meant.pose_source(), PoseSource::Identity);
    for number in 0..12 {
        assert_eq!(meant.next_scan().unwrap().unwrap().points_in_sensor[0][0], f64::from(number));
    }
    let single = open_scans(&folder.join("full3.pcd"), &ReadOptions::default()).unwrap();
    assert_eq!(single.pose_source(), PoseSource::Identity);

    let poses = folder.join("trajectory.txt");
    assert_eq!(
        open_scans(&folder, &with_poses(&poses)).unwrap().pose_source(),
        PoseSource::File(poses.clone())
    );
    let lines = (0..12).map(|number| format!("{} 0 0 0 0 0 0 1\n", if number == 7 { 3 } else { number }));
    fs::write(&poses, lines.collect::<String>()).unwrap();
    let error = message_of(open_scans(&folder, &with_poses(&poses)));
    assert!(error.contains("pose 8 is earlier than the one before"), "{error}");
}

#[test]
fn one_file_without_viewpoint_is_an_error_and_can_be_skipped() {
    let (_outer, folder) = lone_folder();
    for number in 0..2 {
        fs::write(folder.join(format!("{number}.pcd")), pcd("binary", &points(5))).unwrap();
    }
    unplaced(&folder, &["2.pcd"]);
    let mut source = open_scans(&folder, &ReadOptions::default()).unwrap();
    assert_eq!(source.pose_source(), voxtile_formats::PoseSource::Viewpoint);
    assert!(source.next_scan().unwrap().is_some() && source.next_scan().unwrap().is_some());
    assert!(message_of(source.next_scan()).contains("this file has no VIEWPOINT"));
    assert!(source.pass_unread() && source.next_scan().unwrap().is_none());
}

#[test]
fn a_rounded_rotation_matrix_gives_a_pose_without_scale() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("0.pcd"), pcd("binary", &points(5))).unwrap();
    let poses = folder.path().join("kitti.txt");
    fs::write(&poses, "0.6004 -0.8 0 1 0.8 0.6004 0 2 0 0 1.0004 3\n").unwrap();
    let mut source = open_scans(folder.path(), &with_poses(&poses)).unwrap();
    let pose = source.next_scan().unwrap().unwrap().world_from_sensor;
    assert!((pose.isometry().rotation.norm() - 1.0).abs() < 1e-15);
    assert!((pose.to_world()([1.0, 0.0, 0.0])[0] - 1.6).abs() < 1e-3);
}

/// The poses in a text file belong to the clouds in order: time stamps and lengths of quaternions have no effect.
#[test]
fn poses_in_order_may_have_any_time_stamps_and_lengths() {
    let folder = TempDir::new().unwrap();
    for number in 0..2 {
        fs::write(folder.path().join(format!("{number}.pcd")), pcd("binary", &points(5))).unwrap();
    }
    let poses = folder.path().join("poses.txt");
    for text in [
        "20180810150607.5 1 0 0 0 0 0 1\n20180810150608.5 2 0 0 0 0 0 1\n",
        "nan 1 0 0 0 0 0 1\ninf 2 0 0 0 0 0 1\n",
        "0, 1 0 0, 0 0 0 2\n0, 2 0 0, 0 0 0 0.5\n",
    ] {
        fs::write(&poses, text).unwrap();
        let mut source = open_scans(folder.path(), &with_poses(&poses)).unwrap();
        for x in [1.0, 2.0] {
            let scan = source.next_stored(&PointBudget::default()).unwrap().unwrap();
            let pose = scan.world_from_sensor;
            assert_eq!((pose.position_m()[0], pose.quaternion()), (x, [0.0, 0.0, 0.0, 1.0]), "{text}");
            assert_eq!(scan.stamp_ns, None);
        }
        assert!(source.remarks().is_empty(), "{:?}", source.remarks());
    }
}

/// Returns the fingerprint by which earlier versions identify an input: a hash of its files, and of poses that are not
/// in these files.
fn fingerprint_of(files: &[PathBuf], poses: &[Pose]) -> String {
    let (mut hasher, mut bytes) = (blake3::Hasher::new(), 0);
    for path in files {
        let content = fs::read(path).unwrap();
        hasher.update(&content);
        hasher.update(path.file_name().unwrap().as_encoded_bytes());
        hasher.update(&[0]);
        hasher.update(&(content.len() as u64).to_le_bytes());
        bytes += content.len();
    }
    for number in poses.iter().flat_map(|pose| pose.isometry().to_homogeneous().as_slice().to_vec()) {
        hasher.update(&number.to_bits().to_le_bytes());
    }
    format!("{} files, {bytes} bytes, blake3 {}", files.len(), &hasher.finalize().to_hex()[..32])
}

#[test]
fn fingerprints_of_pcd_files_are_those_of_earlier_versions() {
    let folder = TempDir::new().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    let files = ["2", "10"].map(|number| scans.join(format!("{number}.pcd")));
    files.iter().for_each(|path| fs::write(path, pcd("ascii", &points(2))).unwrap());
    let poses = folder.path().join("poses.txt");
    let fingerprint = |options: &ReadOptions| open_scans(&scans, options).unwrap().fingerprint().unwrap();
    assert_eq!(
        fingerprint(&ReadOptions::default()),
        fingerprint_of(&files, &[]),
        "the VIEWPOINT is in the files"
    );
    let identity = fingerprint_of(&files, &[Pose::identity(); 2]);
    assert_eq!(fingerprint(&with_poses(Path::new("identity"))), identity);
    fs::write(&poses, "0 1 2 3 0 0 0.3 0.4\n1 4 5 6 0.1 0 -0.6 0.8\n").unwrap();
    let tum = [([1.0, 2.0, 3.0], [0.0, 0.0, 0.3, 0.4]), ([4.0, 5.0, 6.0], [0.1, 0.0, -0.6, 0.8])]
        .map(|(position_m, xyzw)| Pose::from_quaternion(position_m, xyzw).unwrap());
    assert_eq!(fingerprint(&with_poses(&poses)), fingerprint_of(&files, &tum));
    fs::write(&poses, "0.28 -0.96 0 1 0.96 0.28 0 2 0 0 1.0003 3\n1 0 0 4 0 1 0 5 0 0 1 6\n").unwrap();
    let kitti = [
        [[0.28, -0.96, 0.0, 1.0], [0.96, 0.28, 0.0, 2.0], [0.0, 0.0, 1.0003, 3.0]],
        [[1.0, 0.0, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 6.0]],
    ]
    .map(|rows| Pose::from_matrix(&rows).unwrap());
    assert_eq!(fingerprint(&with_poses(&poses)), fingerprint_of(&files, &kitti));
}

#[test]
fn folders_of_other_programs_have_the_known_numbers_of_scans_and_points() {
    for (name, folder, scans, points) in [
        ("scans_1", Some(fixtures("scans_1")), 6, 1800),
        ("fastlio_hku_1", shared_data("fastlio_hku_1"), 314, 1_603_961),
        ("mulran_riverside02_a", shared_data("mulran_riverside02_a"), 75, 996_768),
        ("balm_os0_hall", shared_data("balm_os0_hall"), 36, 2_727_114),
    ] {
        let Some(folder) = folder else { continue };
        let read = all_scans(&folder);
        assert_eq!(read.len(), scans, "{name}");
        assert_eq!(read.iter().map(|scan| scan.points_in_sensor.len()).sum::<usize>(), points, "{name}");
        assert!(read.iter().all(|scan| scan.intensities.is_some()));
        let poses_of = |name: &str| -> Vec<_> {
            let mut source = open_scans(&folder, &with_poses(&folder.join(name))).unwrap();
            std::iter::from_fn(|| source.next_scan().unwrap()).map(|scan| scan.world_from_sensor).collect()
        };
        for (a, b) in poses_of("poses_tum.txt").iter().zip(poses_of("poses_kitti.txt")) {
            assert!(
                (a.isometry().to_homogeneous() - b.isometry().to_homogeneous()).abs().max() < 1e-5,
                "{name}"
            );
        }
    }
}

#[test]
fn scan_graphs_of_octomap_are_read_to_their_ends() {
    let counts =
        |path: PathBuf| all_scans(&path).iter().map(|scan| scan.points_in_sensor.len()).collect::<Vec<_>>();
    assert_eq!(counts(fixtures("octomap_1").join("three_scans.graph")), [150; 3]);
    let Some(folder) = shared_data("octomap_maps") else { return };
    assert_eq!(counts(folder.join("spherical_scan.graph")), [10_201]);
}

/// A graph of two scans, as OctoMap writes it.
pub fn graph() -> Vec<u8> {
    let mut file = 2_u32.to_le_bytes().to_vec();
    let vector = |file: &mut Vec<u8>, numbers: &[f64]| {
        file.extend((numbers.len() as i32).to_le_bytes());
        numbers.iter().for_each(|number| file.extend(number.to_le_bytes()));
    };
    for id in [4_u32, 5] {
        file.extend(2_u32.to_le_bytes());
        vector(&mut file, &[1.0, 2.0, 3.0]);
        vector(&mut file, &[-1.0, 0.5, 0.25]);
        vector(&mut file, &[10.0, 0.0, 1.0]);
        vector(&mut file, &[0.8, 0.0, 0.0, 0.6]);
        file.extend(id.to_le_bytes());
    }
    file.extend(0_u32.to_le_bytes());
    file
}

#[test]
fn graphs_and_logs_are_read_and_hostile_ones_are_errors() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.graph");
    fs::write(&path, graph()).unwrap();
    let scans = all_scans(&path);
    assert_eq!(
        (scans.len(), scans[1].name.as_str(), scans[1].points_in_sensor[1]),
        (2, "5", [-1.0, 0.5, 0.25])
    );
    let log = folder.path().join("a.log");
    let yaw = 2.0 * 0.6_f64.asin();
    fs::write(
        &log,
        format!("# a log\nNODE 10 0 1 0 0 {yaw}\n1 2 3\n-1 0.5 0.25\n\n skipped\nNODE 0 0 0 0 0 0\n"),
    )
    .unwrap();
    let from_log = all_scans(&log);
    assert_eq!(from_log.iter().map(|scan| scan.points_in_sensor.len()).collect::<Vec<_>>(), [2, 0]);
    let [a, b] = [&scans[0], &from_log[0]].map(|scan| scan.world_from_sensor.isometry().to_homogeneous());
    assert!((a - b).abs().max() < 1e-6);

    let read = |path: &Path| {
        let mut source = open_scans(path, &ReadOptions::default())?;
        while source.next_scan()?.is_some() {}
        Ok::<(), voxtile::Error>(())
    };
    for length in 1..graph().len() - 4 {
        fs::write(&path, &graph()[..length]).unwrap();
        assert!(read(&path).is_err(), "cut to {length}");
    }
    let mut endless = graph();
    let qx = endless.len() - 4 - 4 - 24;
    endless[qx..qx + 8].copy_from_slice(&1e300_f64.to_le_bytes());
    fs::write(&path, endless).unwrap();
    assert!(message_of(read(&path)).contains("a quaternion too long to be a rotation"));
    let mut bomb = graph();
    bomb[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
    fs::write(&path, bomb).unwrap();
    assert!(message_of(read(&path)).contains("4294967295 points are announced"));
    for (text, message) in [
        ("1 2 3\n", "line 1: there are points before the first NODE line"),
        ("NODE 1 2 3\n", "line 1: fewer than 6 numbers"),
        ("NODE 0 0 0 0 0 0\n1 two 3\n", "line 2: `two` is not a number"),
        ("NODE 0 0 0 0 0 nan\n", "the pose has a number that is not finite"),
    ] {
        fs::write(&log, text).unwrap();
        let error = message_of(read(&log));
        assert!(error.contains(message), "{error}");
    }
}
