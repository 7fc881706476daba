use crate::support::shared_data;
use nalgebra::Rotation3;
use std::fs;
use std::path::PathBuf;
use voxtile::scan::Pose;
use voxtile_formats::poses::{Found, Trajectory, most_gap_ns};
use voxtile_formats::{CloudHead, CloudPoint, CloudSource, RigidPose};

fn read(text: &str) -> voxtile::Result<Trajectory> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    fs::write(&path, text).unwrap();
    Trajectory::read(&path, None)
}

const TUM: &str = "# timestamp tx ty tz qx qy qz qw\n\
                   1403636579.763555584 1 2 3 0 0 0 1\n\
                   1403636580.763555584 3 2 3 0 0 0.7071067811865476 0.7071067811865476\n\
                   1403636590.763555584 3 2 3 0 0 0.707 0.7072\n";
const FIRST_NS: i64 = 1_403_636_579_763_555_584;

#[test]
fn stamps_are_exact_and_poses_are_interpolated() {
    let trajectory = read(TUM).unwrap();
    let first = RigidPose { position_m: [1.0, 2.0, 3.0], ..RigidPose::IDENTITY };
    assert_eq!(trajectory.at(FIRST_NS, 0).unwrap(), Found::Exact(first));
    let before_ns = FIRST_NS - 1_000_001;
    assert_eq!(trajectory.at(before_ns, i64::MAX).unwrap(), Found::Before { first_ns: FIRST_NS });
    let last_ns = FIRST_NS + 11_000_000_000;
    assert_eq!(trajectory.at(last_ns + 1_000_001, i64::MAX).unwrap(), Found::After { last_ns });
    // Poses keep their values even if the quaternion's length is not exactly 1.
    let Found::Exact(last) = trajectory.at(last_ns, 0).unwrap() else { panic!() };
    assert_eq!(last.quaternion, [0.0, 0.0, 0.707, 0.7072]);
    let Found::Between(half) = trajectory.at(FIRST_NS + 500_000_000, 500_000_000).unwrap() else { panic!() };
    assert_eq!(half.position_m, [2.0, 2.0, 3.0]);
    let (sin, cos) = (std::f64::consts::PI / 8.0).sin_cos();
    assert!((half.quaternion[2] - sin).abs() < 1e-12 && (half.quaternion[3] - cos).abs() < 1e-12, "{half:?}");
    // A gap of ten seconds, near its start and in its middle.
    for into_ns in [400_000_000, 5_000_000_000] {
        let at_ns = FIRST_NS + 1_000_000_000 + into_ns;
        assert_eq!(trajectory.at(at_ns, 4_999_999_999).unwrap(), Found::Gap { gap_ns: 10_000_000_000 });
        assert!(matches!(trajectory.at(at_ns, 5_000_000_000).unwrap(), Found::Between(_)));
    }
    // With one pose per second, every moment is within half a second of a pose.
    assert_eq!(
        trajectory.at(FIRST_NS + 1_000_001, 499_999_999).unwrap(),
        Found::Gap { gap_ns: 1_000_000_000 }
    );
    assert_eq!(most_gap_ns(i64::MAX), i64::MAX);
    assert_eq!(most_gap_ns(-1), 0);
    assert_eq!(trajectory.by_number(0).unwrap(), Some(first));
    assert_eq!(trajectory.by_number(3).unwrap(), None);
}

#[test]
fn poses_within_a_millisecond_are_used_in_any_gap() {
    let key_frames =
        "1700000010.000000000 1 0 0 0 0 0 1\n1700000025.5 2 0 0 0 0 0 1\n1700000040.25 3 0 0 0 0 0 1\n";
    let trajectory = read(key_frames).unwrap();
    let [first_ns, second_ns, last_ns] =
        [10.0, 25.5, 40.25].map(|s| 1_700_000_000_000_000_000 + (s * 1e9) as i64);
    let x_m = |stamp_ns: i64| match trajectory.at(stamp_ns, 500_000_000).unwrap() {
        Found::Exact(pose) => Some(pose.position_m[0]),
        _ => None,
    };
    for (stamp_ns, wanted) in [(first_ns, 1.0), (second_ns, 2.0), (last_ns, 3.0)] {
        for apart_ns in [-1_000_000, -74, 0, 74, 1_000_000] {
            assert_eq!(x_m(stamp_ns + apart_ns), Some(wanted), "{apart_ns}");
        }
        for apart_ns in [-1_000_001, 1_000_001] {
            assert_eq!(x_m(stamp_ns + apart_ns), None, "{apart_ns}");
        }
    }
    // If the gap may be interpolated, the pose is interpolated even close to a sample.
    let Found::Between(pose) = trajectory.at(first_ns + 74, i64::MAX).unwrap() else { panic!() };
    assert!(pose.position_m[0] > 1.0);
}

#[test]
fn unordered_and_duplicate_stamps_are_remarked() {
    let trajectory = read("2 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n").unwrap();
    assert_eq!(
        trajectory.stamps_ns().map(|stamp| stamp.unwrap()).collect::<Vec<_>>(),
        [1_000_000_000, 2_000_000_000]
    );
    let Found::Exact(pose) = trajectory.at(2_000_000_000, 0).unwrap() else { panic!() };
    assert_eq!(pose.position_m[0], 3.0);
    assert_eq!(trajectory.remarks().len(), 2, "{:?}", trajectory.remarks());
    assert_eq!(trajectory.by_number(0).unwrap().map(|pose| pose.position_m[0]), Some(1.0));
}

#[test]
fn invalid_poses_are_errors_with_their_line() {
    for (text, reason) in [
        ("1 nan 0 0 0 0 0 1\n", "line 1: `nan` is not finite"),
        ("0 0 0 0 0 0 0 0\n", "line 1: the quaternion 0 0 0 0 has length 0"),
        // Most lines have another layout.
        (
            "0 0 0 0 0 0 0 1\n\n1 2 3 4 5 6 7 8 9\n1 2 3 4 5 6 7 8 9\n",
            "line 3: 9 numbers, but the lines before have 8",
        ),
        (
            "1 2 3 0.1 0.2 0.3 0.4\n1 2 3 0 0 0 1\n2 2 3 0.1 0.2 0.3 0.4\n",
            "are these roll, pitch and yaw angles?",
        ),
        ("1 2 3 4 5 6\n", "line 1: 6 numbers; a pose is 8 numbers (TUM: t x y z qx qy qz qw), 7 without t"),
        ("1 2 3 4 5 6\n", "roll, pitch and yaw are not supported"),
        ("t x y z roll pitch yaw\n1 2 3 4 0 0 1\n", "line 1: the column `roll` is an angle"),
        ("# t x y z roll pitch yaw\n1 2 3 4 0 0 1\n", "line 2: the column `roll` is an angle"),
        ("# t x[px] y[px] z[px] qx qy qz qw\n1 2 3 4 0 0 0 1\n", "line 2: `px` is an unknown unit of length"),
        (
            "# id t x y z qw qx qy qz\n1 2 3 4 1 0 0 0\n",
            "line 2: 8 columns, but the header line has 9 or more",
        ),
        ("t[min] x y z qx qy qz qw\n1 2 3 4 0 0 0 1\n", "line 1: `min` is an unknown unit of time"),
        ("nan 2 3 4 0 0 0 1\nNA 2 3 4 0 0 0 1\n", "line 1: no time stamp"),
        ("1 0 0 0 0 2 0 0 0 0 1 0\n", "line 1: the matrix is not a rotation"),
        ("one two\n", "line 1: `one two` is neither"),
        ("1 2 3\n", "line 1: 3 numbers"),
        ("# nothing\n", "contains no pose"),
        ("x 0 0 0 0 0 0 1\n", "is neither a pose"),
    ] {
        let error = format!("{:#}", read(text).unwrap_err());
        assert!(error.contains(reason), "{error}");
    }
}

/// Source with an optional number of clouds, which are never read.
struct Clouds(Option<u64>);

impl CloudSource for Clouds {
    fn format(&self) -> &str {
        "nothing"
    }

    fn len_hint(&self) -> Option<u64> {
        self.0
    }

    fn ends(&self) -> Option<[String; 2]> {
        Some(["1.txt", "trajectory.txt"].map(str::to_owned))
    }

    fn next_cloud(&mut self) -> voxtile::Result<Option<CloudHead>> {
        Ok(None)
    }

    fn read_points(&mut self, _: &mut dyn FnMut(CloudPoint) -> voxtile::Result<()>) -> voxtile::Result<()> {
        Ok(())
    }
}

#[test]
fn poses_by_number_must_match_the_number_of_clouds() {
    let trajectory = read(TUM).unwrap();
    assert_eq!(trajectory.of_cloud(2, &Clouds(Some(3))).unwrap(), trajectory.by_number(2).unwrap());
    assert_eq!(trajectory.of_cloud(2, &Clouds(None)).unwrap(), trajectory.by_number(2).unwrap());
    for (number, clouds, counts) in [
        (0, Some(4), "3 poses for 4 clouds (1.txt to trajectory.txt), and not both have time stamps"),
        (0, Some(2), "3 poses for 2 clouds (1.txt to trajectory.txt), "),
        (3, None, "3 poses for at least 4 clouds, "),
    ] {
        let error = format!("{:#}", trajectory.of_cloud(number, &Clouds(clouds)).unwrap_err());
        assert!(error.contains("poses.txt: ") && error.contains(counts), "{error}");
    }
}

#[test]
fn tables_have_named_columns() {
    let euroc = "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n\
                 1403636579763555584,1,2,3,0,1,0,0\n";
    let csv = "qw,qz,qy,qx,z,y,x,timestamp,note\n0,0,0,1,3,2,1,1403636579.763555584,9\n";
    for text in [euroc, csv] {
        let trajectory = read(text).unwrap();
        let wanted = RigidPose { position_m: [1.0, 2.0, 3.0], quaternion: [1.0, 0.0, 0.0, 0.0] };
        assert_eq!(trajectory.at(FIRST_NS, 0).unwrap(), Found::Exact(wanted), "{text}");
    }
}

#[test]
fn units_of_columns_are_used() {
    let wanted = RigidPose { position_m: [1.5, -0.25, 3.0], quaternion: [0.0, 0.0, 1.0, 0.0] };
    for (text, unit) in [
        (
            "timestamp [ns],x [mm],y [mm],z [mm],qx,qy,qz,qw\n1700000000000000000,1500,-250,3000,0,0,1,0\n",
            "mm",
        ),
        (
            "# t[s] tx(cm) ty(cm) tz(cm) qw qx qy qz\n# of the left sensor\n1700000000 150 -25 300 0 0 0 1\n",
            "cm",
        ),
        ("time_ms;x_mm;y_cm;z_m;q_x;q_y;q_z;q_w\n1700000000000;1500,0;-25,0;3;0;0;1;0\n", "mm, cm and m"),
        ("sec,nsec,x,y,z,qx,qy,qz,qw\n1700000000,0,1.5,-0.25,3,0,0,1,0\n", ""),
        ("#sec,nsec,x/mm,y/mm,z/mm,qx,qy,qz,qw\n1700000000,000000000,1500,-250,3000,0,0,1,0\n", "mm"),
    ] {
        let trajectory = read(text).unwrap();
        assert_eq!(trajectory.at(1_700_000_000_000_000_000, 0).unwrap(), Found::Exact(wanted), "{text}");
        let remarks = trajectory.remarks().join("\n");
        let expected = format!("positions are in {unit}, as stated in their column names");
        assert!(if unit.is_empty() { remarks.is_empty() } else { remarks.contains(&expected) }, "{remarks}");
    }
}

#[test]
fn invalid_rows_keep_their_numbers_and_are_remarked() {
    for (row, reason) in [
        ("2 nan nan nan nan nan nan nan", "line 3: `nan` is not finite"),
        ("2 -nan(ind) 0 0 0 0 0 1", "line 3: `-nan(ind)` is not finite"),
        ("2 20 0 0 0 0 0 0", "line 3: the quaternion 0 0 0 0 has length 0"),
        ("2 lost", "line 3: 2 numbers, but the lines before have 8"),
        ("2 20 x 0 0 0 0 1", "line 3: `x` is not a number"),
        ("2", "line 3: 1 numbers"),
        ("2,,,,,,,", "line 3: 1 numbers"),
    ] {
        let text =
            format!("# t x y z qx qy qz qw\n1 10 0 0 0 0 0 1\n{row}\n3 30 0 0 0 0 0 1\n4 40 0 0 0 0 0 1\n");
        let trajectory = read(&text.replace("# t x y z qx qy qz qw", "# by hand")).unwrap();
        assert_eq!(trajectory.len(), 4, "{row}");
        let x_m = |number: usize| trajectory.by_number(number).unwrap().map(|pose| pose.position_m[0]);
        assert_eq!([0, 1, 2, 3].map(x_m), [Some(10.0), None, Some(30.0), Some(40.0)], "{row}");
        assert_eq!(trajectory.of_cloud(1, &Clouds(Some(4))).unwrap(), None);
        assert_eq!(trajectory.at(2_000_000_000, i64::MAX).unwrap(), Found::Lost, "{row}");
        assert_eq!(trajectory.at(2_000_900_000, i64::MAX).unwrap(), Found::Lost, "{row}");
        assert!(matches!(trajectory.at(2_100_000_000, i64::MAX).unwrap(), Found::Between(_)), "{row}");
        assert!(matches!(trajectory.at(3_000_000_000, 0).unwrap(), Found::Exact(_)));
        let remarks = trajectory.remarks();
        assert!(
            remarks.len() == 1
                && remarks[0].starts_with("1 row of poses is invalid and skipped, the first: "),
            "{remarks:?}"
        );
        assert!(remarks[0].contains(reason), "{remarks:?}");
    }
    // Words between poses do not count as a row; a pose with an unreadable stamp keeps its number.
    let text =
        "t x y z qx qy qz qw\n1 10 0 0 0 0 0 1\nt x y z qx qy qz qw\nnan 20 0 0 0 0 0 1\n3 30 0 0 0 0 0 1\n";
    let trajectory = read(text).unwrap();
    assert_eq!(trajectory.len(), 3);
    assert_eq!(trajectory.by_number(1).unwrap().map(|pose| pose.position_m[0]), Some(20.0));
    assert_eq!(
        trajectory.stamps_ns().map(|stamp| stamp.unwrap() / 1_000_000_000).collect::<Vec<_>>(),
        [1, 3]
    );
    let remarks = trajectory.remarks().join("\n");
    assert!(remarks.contains("line 3: `t x y z") && remarks.contains("line 4: no time stamp"), "{remarks}");
    // A matrix on four lines is lost as a whole.
    let matrix = |x: &str| format!("1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    let trajectory = read(&["1", "nan", "3"].map(matrix).concat()).unwrap();
    let x_m = |number: usize| trajectory.by_number(number).unwrap().map(|pose| pose.position_m[0]);
    assert_eq!((trajectory.len(), [0, 1, 2].map(x_m)), (3, [Some(1.0), None, Some(3.0)]));
}

/// Poses of a cart that turns left: `x y z` and the quaternion as `w x y z`.
fn turning_cart() -> Vec<([f64; 3], [f64; 4])> {
    let at = |k: i32| (f64::from(k), 0.04 * f64::from(k));
    (0..12)
        .map(at)
        .map(|(x, yaw)| ([x, 0.1 * x, 0.0], [(yaw / 2.0).cos(), 0.0, 0.0, (yaw / 2.0).sin()]))
        .collect()
}

#[test]
fn quaternion_order_is_detected_by_upright_sensors() {
    let text = |is_first: bool, head: &str| {
        let line = |(k, (p, [w, x, y, z])): (usize, ([f64; 3], [f64; 4]))| {
            let q = if is_first { [w, x, y, z] } else { [x, y, z, w] };
            let words: Vec<String> = p.iter().chain(&q).map(f64::to_string).collect();
            format!("{k} {}\n", words.join(" "))
        };
        head.to_owned() + &turning_cart().into_iter().enumerate().map(line).collect::<String>()
    };
    for (is_first, head, is_guess) in [
        (false, "", false),
        (true, "", true),
        (true, "# k x y z\n", true),
        (true, "# t x y z qw qx qy qz\n", false),
        (true, "t x y z qw qx qy qz\n", false),
        (false, "# t x y z qx qy qz qw\n", false),
    ] {
        let trajectory = read(&text(is_first, head)).unwrap();
        for (number, (position_m, [w, x, y, z])) in turning_cart().into_iter().enumerate() {
            let wanted = RigidPose { position_m, quaternion: [x, y, z, w] };
            assert_eq!(trajectory.by_number(number).unwrap(), Some(wanted), "{is_first} {head}");
            let Found::Exact(found) = trajectory.at(number as i64 * 1_000_000_000, 0).unwrap() else {
                panic!()
            };
            assert_eq!(found, wanted);
        }
        let remarks = trajectory.remarks().join("\n");
        assert_eq!(remarks.contains("are read as qw qx qy qz"), is_guess, "{remarks}");
    }
}

#[test]
fn kitti_camera_poses_are_converted_to_lidar_poses() {
    let folder = tempfile::tempdir().unwrap();
    let (poses, calib) = (folder.path().join("00.txt"), folder.path().join("calib.txt"));
    // The camera looks along the lidar's x and moved 5 m forward.
    fs::write(&poses, "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 5\n").unwrap();
    fs::write(&calib, "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 -0.08 1 0 0 -0.27\n").unwrap();
    let trajectory = Trajectory::read(&poses, Some(&calib)).unwrap();
    let moved = trajectory.by_number(1).unwrap().unwrap();
    for (found, wanted) in moved.position_m.iter().zip([5.0, 0.0, 0.0]) {
        assert!((found - wanted).abs() < 1e-12, "{moved:?}");
    }
    assert_eq!(trajectory.at(0, 0).unwrap(), Found::WithoutStamps);
    let plain = Trajectory::read(&poses, None).unwrap();
    assert_eq!(plain.by_number(1).unwrap().unwrap().position_m, [0.0, 0.0, 5.0]);
}

/// This reader and `Pose::from_matrix` must convert matrices to the same bits, so that a map built with one can be
/// resumed with the other.
#[test]
fn pose_graphs_are_read_in_the_order_of_their_ids() {
    let graph = "FIX 7\n\
                 VERTEX_SE3:QUAT 0 1 2 3 0 0 0 1\n\
                 VERTEX_TRACKXYZ 1 9 9 9\n\
                 VERTEX_SE3:QUAT 8646911284551352321 4 5 6 0 0 0.7071067811865476 0.7071067811865476\n\
                 EDGE_SE3:QUAT 0 8646911284551352321 3 3 3 0 0 0 1 1 0 0 0 0 0\n";
    let trajectory = read(graph).unwrap();
    assert_eq!((trajectory.len(), trajectory.has_stamps()), (2, false));
    let last = trajectory.by_number(1).unwrap().unwrap();
    assert_eq!((last.position_m, last.quaternion[3]), ([4.0, 5.0, 6.0], 0.5_f64.sqrt()));
    for (text, words) in [
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "vertex 0 follows vertex 1"),
        ("VERTEX_SE3:QUAT -1 0 0 0 0 0 0 1\n", "needs an id"),
        ("VERTEX_SE3:QUAT\n", "needs an id"),
        ("VERTEX_SE2 0 0 0 0\n", "VERTEX_SE2"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0\n", "vertex 0: 5 numbers"),
        ("VERTEX_SE3:QUAT 0 0 0 0 1 1 1 1\n", "length 2.000"),
        ("EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1\n", ""),
    ] {
        let message = format!("{:#}", read(text).unwrap_err());
        assert!(message.contains(words), "{text}: {message}");
    }
    // A lost pose keeps its place.
    let lost = "VERTEX_SE3:QUAT 0 nan 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nVERTEX_SE3:QUAT 2 2 0 0 0 0 0 1\n";
    let trajectory = read(lost).unwrap();
    assert!(trajectory.by_number(0).unwrap().is_none() && trajectory.by_number(2).unwrap().is_some());
    // Prose may begin like a graph.
    assert_eq!(read("FIX the poses\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").unwrap().len(), 2);
}

#[test]
fn matrices_give_bit_identical_poses_to_the_engine() {
    let (mut text, mut wanted) = (String::new(), Vec::new());
    let mut next = 1_u64;
    let mut random = || {
        next = next.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (next >> 11) as f64 / (1_u64 << 53) as f64
    };
    for k in 0..3000 {
        let [roll, pitch, yaw] = [0; 3].map(|_| 6.4 * random() - 3.2);
        let rotation = Rotation3::from_euler_angles(roll, pitch, yaw);
        // From the fewest digits that form a rotation up to the digits of a double.
        let digits = 4 + k % 14;
        let rows: [[f64; 4]; 3] = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let number = if column < 3 { rotation[(row, column)] } else { 1e3 * random() };
                format!("{number:.digits$}").parse().unwrap()
            })
        });
        let words: Vec<String> = rows.iter().flatten().map(f64::to_string).collect();
        text += &(words.join(" ") + "\n");
        wanted.push(Pose::from_matrix(&rows).unwrap());
    }
    let bits = |pose: &Pose| (pose.position_m().map(f64::to_bits), pose.quaternion().map(f64::to_bits));
    let trajectory = read(&text).unwrap();
    for (number, wanted) in wanted.iter().enumerate() {
        let found = trajectory.by_number(number).unwrap().unwrap();
        let found = Pose::from_quaternion(found.position_m, found.quaternion).unwrap();
        assert_eq!(bits(&found), bits(wanted), "{number}");
    }
}

#[test]
fn numpy_arrays_are_read() {
    let at = |name: &str| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    let tum = Trajectory::read(&at("poses_tum.npy"), None).unwrap();
    assert_eq!(tum.span_ns().unwrap(), Some([1_700_000_000_250_000_000, 1_700_000_001_250_000_000]));
    for name in ["poses_4x4.npy", "poses_3x4_f4.npy"] {
        let matrices = Trajectory::read(&at(name), None).unwrap();
        assert_eq!(matrices.len(), 2);
        for number in 0..2 {
            let (a, b) =
                (tum.by_number(number).unwrap().unwrap(), matrices.by_number(number).unwrap().unwrap());
            assert_eq!(a.position_m, b.position_m, "{name}");
            let cosine: f64 = a.quaternion.iter().zip(b.quaternion).map(|(a, b)| a * b).sum();
            assert!((cosine.abs() - 1.0).abs() < 1e-7, "{name}: {a:?} {b:?}");
        }
    }
    // Without times, and with a lost pose.
    let folder = tempfile::tempdir().unwrap();
    let rows = [[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0], [f64::NAN; 7], [4.0, 5.0, 6.0, 0.0, 0.0, 1.0, 0.0]];
    let numbers = rows.as_flattened().iter().flat_map(|number| number.to_le_bytes());
    let mut bytes = npy(1, "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 7), }\n", 0);
    bytes.extend(numbers);
    let path = folder.path().join("seven.npy");
    fs::write(&path, bytes).unwrap();
    let seven = Trajectory::read(&path, None).unwrap();
    let x_m = |number: usize| seven.by_number(number).unwrap().map(|pose| pose.position_m[0]);
    assert_eq!((seven.len(), [0, 1, 2].map(x_m)), (3, [Some(1.0), None, Some(4.0)]));
    assert!(seven.remarks()[0].contains("record 1: a number is not finite"), "{:?}", seven.remarks());
    let cut = folder.path().join("cut.npy");
    let bytes = fs::read(at("poses_tum.npy")).unwrap();
    fs::write(&cut, &bytes[..bytes.len() - 1]).unwrap();
    let error = format!("{:#}", Trajectory::read(&cut, None).unwrap_err());
    assert!(error.contains("the file ends after 1 of 2 poses"), "{error}");
}

#[test]
fn real_poses_of_two_forms_agree() {
    let Some(folder) = shared_data("balm_os0_hall") else { return };
    let tum = Trajectory::read(&folder.join("poses_tum.txt"), None).unwrap();
    let kitti = Trajectory::read(&folder.join("poses_kitti.txt"), None).unwrap();
    let stacked = Trajectory::read(&folder.join("alidarPose_all177.csv"), None).unwrap();
    assert_eq!((tum.len(), kitti.len(), stacked.len()), (36, 36, 177));
    assert_eq!(stacked.span_ns().unwrap().map(|[first, _]| first), Some(1_630_577_758_569_490_000));
    for number in 0..36 {
        let (a, b) = (tum.by_number(number).unwrap().unwrap(), kitti.by_number(number).unwrap().unwrap());
        let point = [10.0, -20.0, 5.0];
        let (a, b) = (a.apply(point), b.apply(point));
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3), "{number}: {a:?} {b:?}");
    }
}

/// Returns a NumPy file of a version, with this header and this many data bytes.
fn npy(version: u8, header: &str, bytes: usize) -> Vec<u8> {
    let length = header.len() as u32;
    let length =
        if version == 1 { length.to_le_bytes()[..2].to_vec() } else { length.to_le_bytes().to_vec() };
    [b"\x93NUMPY".to_vec(), vec![version, 0], length, header.as_bytes().to_vec(), vec![0; bytes]].concat()
}

#[test]
fn invalid_arrays_report_the_expected_layout() {
    let folder = tempfile::tempdir().unwrap();
    let fail = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        format!("{:#}", Trajectory::read(&path, None).unwrap_err())
    };
    let header = |kind: &str, order: &str, shape: &str| {
        format!("{{'descr': {kind}, 'fortran_order': {order}, 'shape': ({shape}), }}\n")
    };
    let plain = header("'<f8'", "False", "2, 8");
    for (bytes, wanted) in [
        (
            npy(1, &header("'<i8'", "False", "2, 8"), 128),
            "numbers of type `<i8`; poses are little-endian floats",
        ),
        (npy(2, &header("'>f8'", "False", "2, 8"), 128), "numbers of type `>f8`"),
        (npy(1, &header("'|O'", "False", "2, 8"), 128), "numbers of type `|O`"),
        (npy(3, &header("[('t', '<f8'), ('x', '<f8')]", "False", "2,"), 32), "is a structured array"),
        (npy(1, &header("'<f8'", "True", "2, 8"), 128), "is in Fortran order"),
        (npy(1, &header("'<f8'", "False", "2, 9"), 144), "has the shape (2, 9); poses are N x 8"),
        (npy(1, &header("'<f8'", "False", "2, 6"), 96), "roll, pitch and yaw are not supported"),
        (npy(1, &header("'<f8'", "False", ""), 8), "has the shape ()"),
        (npy(1, &header("'<f8'", "False", "18446744073709551615, 8"), 0), "the file ends after 0 of"),
        (npy(1, &plain, 40), "the file ends after 0 of 2 poses"),
        (npy(1, &plain, 128), "record 0: the quaternion 0 0 0 0 has length 0.000, not 1"),
        (npy(4, &plain, 128), "its format version is not 1, 2 or 3"),
        (npy(1, "{}", 0), "its header has no type"),
        (npy(1, &plain, 0)[..40].to_vec(), "the file ends within its header"),
        (npy(2, &plain, 0)[..9].to_vec(), "the file ends within its header"),
        (npy(1, &plain, 0)[..7].to_vec(), "is not a NumPy array in spite of its name"),
        (Vec::new(), "is not a NumPy array"),
        (TUM.as_bytes().to_vec(), "is not a NumPy array"),
        (b"\x80\x04\x95numpy".to_vec(), "is not a NumPy array"),
    ] {
        let error = fail("poses.NPY", &bytes);
        assert!(error.contains("poses.NPY") && error.contains(wanted), "{error}\n{wanted}");
    }
    for (name, bytes, wanted) in [
        (
            "poses.npz",
            &b"PK\x03\x04rest"[..],
            "is an archive (.zip, .npz), not a text file of poses: save one array",
        ),
        ("poses.csv.gz", b"\x1f\x8b\x08\x00", "is packed (gzip), not a text file of poses: unpack it first"),
        (
            "drive.bag",
            b"#ROSBAG V2.0\n",
            "is a recording (.bag), not a text file of poses: use the recording itself",
        ),
        ("drive.mcap", b"\x89MCAP0\r\n", "is a recording (.mcap)"),
        ("drive.db3", b"SQLite format 3\0", "is a database"),
        ("poses.csv", b"\xff\xfe1\0 \0", "is text in UTF-16"),
        ("poses.bin", &1.5_f64.to_le_bytes(), "is binary, not a text file of poses: save the poses as text"),
    ] {
        let error = fail(name, bytes);
        assert!(error.contains(wanted), "{error}");
    }
    assert_eq!(read(&format!("\u{feff}{TUM}")).unwrap().len(), 3, "a UTF-8 byte order mark is accepted");
}
