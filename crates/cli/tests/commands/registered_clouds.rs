use crate::bag1::bag1;
use crate::cli::{failure, json, text};
use crate::message::{F32, MessageWriter};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const START_NS: i64 = 1_700_000_000_000_000_000;

/// Writes a recording of clouds in `frame` and of a sensor that moves along x in `camera_init`, on these topics.
fn write_bag(path: &Path, frame: &str, odometries: &[&str]) {
    let topics: Vec<(&str, &str)> = odometries
        .iter()
        .map(|name| (*name, "nav_msgs/Odometry"))
        .chain([("/cloud_registered", "sensor_msgs/PointCloud2")])
        .collect();
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let mut messages = Vec::new();
    for k in 0..4 {
        let at = START_NS + k * 100_000_000;
        let pose = [0.3 * k as f64, 0.1, 0.5, 0.0, 0.0, 0.6, 0.8];
        for number in 0..odometries.len() {
            messages.push((number, at, MessageWriter::ros1().odometry(at, "camera_init", "body", &pose)));
        }
        let point = |j: i32| [4.0, 0.1 * j as f32, 0.31].map(f32::to_le_bytes).concat();
        let points: Vec<Vec<u8>> = (-20..20).map(point).collect();
        messages.push((
            odometries.len(),
            at,
            MessageWriter::ros1().point_cloud2(at, frame, &fields, &points),
        ));
    }
    fs::write(path, bag1(&topics, &messages)).unwrap();
}

#[test]
fn registered_clouds_make_the_map_of_their_poses_in_the_world() {
    let folder = TempDir::new().unwrap();
    let (bag, poses) = (folder.path().join("a.bag"), folder.path().join("poses.txt"));
    write_bag(&bag, "camera_init", &["/Odometry"]);
    let line = |k: i64| {
        let at = START_NS + k * 100_000_000;
        format!("{}.{:09} {} 0.1 0.5 0 0 0.6 0.8\n", at / 1_000_000_000, at % 1_000_000_000, 0.3 * k as f64)
    };
    fs::write(&poses, (0..4).map(line).collect::<String>()).unwrap();
    let digest = |options: &[&str]| {
        let map = folder.path().join(format!("map{}", options.len()));
        let built = json(&[&["build", text(&bag), "-o", text(&map), "--json"], options].concat());
        assert_eq!(built["scans"], 4, "{built}");
        let digest = json(&["digest", text(&map), "--json"])["digest"].clone();
        fs::remove_dir_all(&map).unwrap();
        (digest, built["remarks"].clone())
    };
    let (wanted, _) = digest(&["--poses", text(&poses), "--world-frame"]);
    assert!(wanted.is_string(), "{wanted}");
    let (named, remarks) = digest(&["--odometry", "/Odometry", "--world-frame"]);
    assert_eq!((&named, remarks.as_array().map(Vec::len)), (&wanted, Some(0)), "{remarks}");
    for options in [&["--odometry", "/Odometry"][..], &[]] {
        let (found, remarks) = digest(options);
        assert_eq!(found, wanted);
        assert!(remarks[0].as_str().unwrap().contains("(--odometry /Odometry --world-frame)"), "{remarks}");
    }
}

#[test]
fn errors_name_the_options_for_poses() {
    let folder = TempDir::new().unwrap();
    let (bag, map) = (folder.path().join("a.bag"), folder.path().join("map"));
    for (frame, odometries, reported) in [
        ("camera_init", &["/a", "/b"][..], "select one, for instance --odometry /a --world-frame"),
        (
            "body",
            &["/Odometry"],
            "there are poses in /Odometry (nav_msgs/Odometry, 4 messages): select their topic, for instance \
                                  --odometry /Odometry",
        ),
    ] {
        write_bag(&bag, frame, odometries);
        let (_, error) = failure(&["build", text(&bag), "-o", text(&map)]);
        assert!(error.contains(reported), "{error}");
        assert!(!map.exists());
        // The suggested options work.
        let option = reported.split("--odometry ").nth(1).unwrap();
        let options: Vec<&str> = ["--odometry"].into_iter().chain(option.split(' ')).collect();
        let built = json(&[&["build", text(&bag), "-o", text(&map), "--json"], &options[..]].concat());
        assert_eq!(built["scans"], 4, "{built}");
        fs::remove_dir_all(&map).unwrap();
    }
}
