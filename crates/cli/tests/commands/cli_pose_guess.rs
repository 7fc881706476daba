//! Tests of ambiguous poses with the command.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn voxtile(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("voxtile").unwrap();
    command.args(arguments);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Writes PCD files of these points.
fn write_scans(folder: &Path, scans: &[(String, Vec<[f64; 3]>)]) -> PathBuf {
    let folder = folder.join("scans");
    fs::create_dir_all(&folder).unwrap();
    for (name, points) in scans {
        let count = points.len();
        let head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
        let lines: String = points.iter().map(|[x, y, z]| format!("{x:.3} {y:.3} {z:.3}\n")).collect();
        let tail = format!("WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA ascii\n{lines}");
        fs::write(folder.join(format!("{name}.pcd")), format!("{head}{tail}")).unwrap();
    }
    folder
}

/// Positions and headings of a robot that drives a bend between posts.
fn way() -> Vec<([f64; 2], f64)> {
    (0..10).map(f64::from).map(|k| ([2.0 * k, 0.12 * k * k], 0.12 * k)).collect()
}

/// Scans of the posts in the sensor frame.
fn seen() -> Vec<(String, Vec<[f64; 3]>)> {
    let posts: Vec<[f64; 2]> = (0..90)
        .map(|k: u64| [k * 7919 % 61, k * 104_729 % 53].map(|n| n as f64))
        .map(|[x, y]| [x - 15.0, y - 22.0])
        .collect();
    let scan = |(number, ([x, y], yaw)): (usize, ([f64; 2], f64))| {
        let mut points = Vec::new();
        for [px, py] in &posts {
            let (dx, dy) = (px - x, py - y);
            if dx.hypot(dy) < 22.0 {
                let (sin, cos) = yaw.sin_cos();
                let own = [cos * dx + sin * dy, cos * dy - sin * dx];
                points.extend((0..12).map(|height| [own[0], own[1], 0.3 * f64::from(height) - 1.0]));
            }
        }
        (format!("{number:06}"), points)
    };
    way().into_iter().enumerate().map(scan).collect()
}

fn remarks(output: &std::process::Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    summary["remarks"].to_string()
}

#[test]
fn misfitting_poses_give_a_remark_or_fail_with_strict() {
    let folder = TempDir::new().unwrap();
    let scans = write_scans(folder.path(), &seen());
    let (poses, map) = (folder.path().join("poses.txt"), folder.path().join("map"));
    let right: String = way()
        .iter()
        .map(|([x, y], yaw)| {
            let (sin, cos) = yaw.sin_cos();
            format!("{cos} {} 0 {x} {sin} {cos} 0 {y} 0 0 1 0\n", -sin)
        })
        .collect();
    let inverse: String = way()
        .iter()
        .map(|([x, y], yaw)| {
            let (sin, cos) = yaw.sin_cos();
            let (ox, oy) = (-cos * x - sin * y, sin * x - cos * y);
            format!("{cos} {sin} 0 {ox} {} {cos} 0 {oy} 0 0 1 0\n", -sin)
        })
        .collect();
    let build = |more: &[&str]| {
        let options = ["build", text(&scans), "-o", text(&map), "--poses", text(&poses), "--json"];
        voxtile(&[&options, more].concat()).output().unwrap()
    };
    fs::write(&poses, right).unwrap();
    assert_eq!(remarks(&build(&["--strict"])), "[]");
    fs::remove_dir_all(&map).unwrap();
    fs::write(&poses, inverse).unwrap();
    let refused = build(&["--strict"]);
    let reported =
        String::from_utf8_lossy(&refused.stdout).into_owned() + &String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && !map.exists(), "{reported}");
    assert!(
        reported.contains("they are the inverse, world to sensor") && reported.contains("without --strict"),
        "{reported}"
    );
    let reported = remarks(&build(&[]));
    assert!(reported.contains("they are the inverse, world to sensor"), "{reported}");
}

#[test]
fn w_first_quaternions_are_detected_and_reported() {
    let folder = TempDir::new().unwrap();
    let scans = write_scans(folder.path(), &seen());
    let map = folder.path().join("map");
    let digest = |lines: &dyn Fn(usize, [f64; 2], f64) -> String, reported: &str| {
        let poses = folder.path().join("poses.json");
        let all: String =
            way().into_iter().enumerate().map(|(k, ([x, y], yaw))| lines(k, [x, y], yaw / 2.0)).collect();
        fs::write(&poses, all).unwrap();
        let built = voxtile(&["build", text(&scans), "-o", text(&map), "--poses", text(&poses), "--json"])
            .output()
            .unwrap();
        let remarks = remarks(&built);
        assert!(remarks.contains(reported) && (remarks == "[]") == reported.is_empty(), "{remarks}");
        let digest = voxtile(&["digest", text(&map)]).output().unwrap().stdout;
        fs::remove_dir_all(&map).unwrap();
        digest
    };
    let w_last = digest(&|_, [x, y], half| format!("{x} {y} 0 0 0 {} {}\n", half.sin(), half.cos()), "");
    let w_first = |_, [x, y]: [f64; 2], half: f64| format!("{x} {y} 0 {} 0 0 {}\n", half.cos(), half.sin());
    assert_eq!(digest(&w_first, "qw qx qy qz, because"), w_last);
    let named = |k, p: [f64; 2], half| {
        let head = if k == 0 { "# tx ty tz qw qx qy qz\n" } else { "" };
        head.to_owned() + &w_first(k, p, half)
    };
    assert_eq!(digest(&named, ""), w_last);
}

#[test]
fn a_calib_file_next_to_camera_poses_is_suggested() {
    let folder = TempDir::new().unwrap();
    let scans = write_scans(folder.path(), &seen()[..3]);
    let poses = folder.path().join("poses.txt");
    let overview = |options: &[&str]| {
        let reported =
            voxtile(&[&["scans", text(&scans), "--poses", text(&poses)], options].concat()).output().unwrap();
        assert!(reported.status.success(), "{}", String::from_utf8_lossy(&reported.stderr));
        String::from_utf8(reported.stdout).unwrap()
    };
    let along = |axis: usize, step: f64| -> String {
        let line = |k: i32| {
            let mut p = [0.0; 3];
            p[axis] = step * f64::from(k);
            format!("1 0 0 {} 0 1 0 {} 0 0 1 {}\n", p[0], p[1], p[2])
        };
        (0..3).map(line).collect()
    };
    fs::write(&poses, along(2, 1.0)).unwrap();
    let reported = overview(&[]);
    assert!(reported.contains("moves along its z axis") && reported.contains("--calib FILE"), "{reported}");
    let calib = folder.path().join("calib.txt");
    fs::write(&calib, "P0: 1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    assert!(!overview(&[]).contains("calib.txt"), "it has no Tr");
    fs::write(&calib, "Tr: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n").unwrap();
    let reported = overview(&[]);
    assert!(reported.contains(&format!("add --calib {}", calib.display())), "{reported}");
    assert!(reported.contains("these move along z") && !reported.contains("its z axis"), "{reported}");
    let reported = overview(&["--calib", text(&calib)]);
    assert!(!reported.contains("note"), "{reported}");
    // Poses without motion do not show the direction of travel.
    fs::write(&poses, along(2, 0.0)).unwrap();
    let reported = overview(&[]);
    assert!(reported.contains("add --calib") && !reported.contains("these move"), "{reported}");
    // Lidar poses move along x.
    fs::write(&poses, along(0, 1.0)).unwrap();
    assert!(!overview(&[]).contains("note"));
    // With a calib that does not belong to these poses, the sensor moves along -y.
    let reported = overview(&["--calib", text(&calib)]);
    assert!(reported.contains("with --calib the sensor moves along its -y axis"), "{reported}");
    fs::write(&poses, "1 0 0 0 0 -1 0 0 0 0 -1 0\n".repeat(3)).unwrap();
    assert!(overview(&[]).contains("upside down"));
}

#[test]
fn times_in_names_may_lack_zeros_or_points() {
    let folder = TempDir::new().unwrap();
    let nanoseconds = [8_555_574_u64, 58_555_574, 108_555_574, 958_555_574];
    let poses: String =
        (0..200).map(|k| format!("{}.{:02} {k} 0 0 0 0 0 1\n", 1_500_000_000 + k / 100, k % 100)).collect();
    let file = folder.path().join("poses.txt");
    fs::write(&file, poses).unwrap();
    for (number, name) in [
        |ns: u64| format!("1500000000.{ns}"),
        |ns: u64| format!("1500000000_{ns:09}"),
        |ns| format!("c_1500000000-{ns}"),
    ]
    .into_iter()
    .enumerate()
    {
        let own = folder.path().join(number.to_string());
        let named: Vec<_> = nanoseconds.iter().map(|ns| (name(*ns), vec![[4.0, 0.0, 0.0]])).collect();
        let scans = write_scans(&own, &named);
        let reported =
            voxtile(&["scans", text(&scans), "--poses", text(&file), "--each", "--json"]).output().unwrap();
        assert!(reported.status.success(), "{}", String::from_utf8_lossy(&reported.stderr));
        let lines = std::str::from_utf8(&reported.stdout).unwrap().lines();
        let x_m: Vec<f64> = lines
            .filter_map(|line| serde_json::from_str::<Value>(line).unwrap()["origin_m"][0].as_f64())
            .collect();
        let wanted = [0.8555574, 5.8555574, 10.8555574, 95.8555574];
        assert_eq!(x_m.len(), 4, "{number}: {x_m:?}");
        assert!(
            x_m.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-5),
            "{number}: {x_m:?}"
        );
    }
    // Names without a time are reported.
    let scans = write_scans(&folder.path().join("none"), &seen()[..3]);
    let reported = voxtile(&["scans", text(&scans), "--poses", text(&file)]).output().unwrap();
    let reported = String::from_utf8(reported.stderr).unwrap();
    assert!(
        reported.contains("200 poses for 3 clouds")
            && reported.contains("names of the clouds contain no times"),
        "{reported}"
    );
}

#[test]
fn a_scan_without_a_pose_is_skipped_and_named() {
    let folder = TempDir::new().unwrap();
    let named = |stamp: &dyn Fn(usize) -> String| -> Vec<_> {
        (0..4).map(|k| (stamp(k), vec![[4.0, 0.0, 0.0]])).collect()
    };
    let counted = write_scans(folder.path(), &named(&|k| format!("{k:06}")));
    let timed = write_scans(&folder.path().join("timed"), &named(&|k| format!("1500000000.{k}")));
    let file = folder.path().join("lost.txt");
    for row in ["1500000000.2 nan nan nan nan nan nan nan", "1500000000.2 lost", "1500000000.2 0 0 0 0 0 0 0"]
    {
        let line = |k: i32| format!("1500000000.{k} {k} 0 0 0 0 0 1\n");
        fs::write(&file, line(0) + &line(1) + row + "\n" + &line(3)).unwrap();
        for scans in [&counted, &timed] {
            let map = folder.path().join("map");
            let built = voxtile(&["build", text(scans), "--poses", text(&file), "-o", text(&map), "--json"]);
            let built = { built }.output().unwrap();
            let reported = remarks(&built);
            fs::remove_dir_all(&map).unwrap();
            let summary: Value = serde_json::from_slice(&built.stdout).unwrap();
            assert_eq!(summary["scans"], 3, "{row}");
            assert!(
                reported.contains("1 row of poses is invalid and skipped") && reported.contains("line 3"),
                "{row}: {reported}"
            );
            assert!(
                reported.contains("1 cloud has no pose: skipped (") && reported.contains(" was lost)"),
                "{row}: {reported}"
            );
        }
    }
}
