use super::cli::{failure, json, output, text};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Poses of three scans, one per line.
const POSES: &str =
    "1 0 0 0.05 0 1 0 0.05 0 0 1 0.05\n1 0 0 1.05 0 1 0 0.55 0 0 1 0.05\n1 0 0 2.05 0 1 0 0.05 0 0 1 0.05\n";

fn digest(map: &Path) -> String {
    output(&["digest", text(map)]).split(' ').next().unwrap().to_owned()
}

fn wall(scan: usize) -> String {
    (0..40).map(|k| format!("{} {} 0.55\n", 4.05 + 0.2 * scan as f64, 0.1 * f64::from(k) - 2.0)).collect()
}

fn write_clouds(folder: &Path) -> [PathBuf; 3] {
    fs::create_dir(folder).unwrap();
    std::array::from_fn(|scan| {
        let path = folder.join(format!("{scan}.xyz"));
        fs::write(&path, wall(scan)).unwrap();
        path
    })
}

/// Writes recordings of two scans each.
fn write_logs(folder: &Path) -> [PathBuf; 3] {
    std::array::from_fn(|at| {
        let path = folder.join(["first.log", "second.log", "third.log"][at]);
        let node =
            |scan: usize| format!("NODE {}.05 0.05 0.05 0 0 0\n{}", 2 * at + scan, wall(2 * at + scan));
        fs::write(&path, node(0) + &node(1)).unwrap();
        path
    })
}

/// Runs a build of these inputs with options.
fn build(inputs: &[&Path], map: &Path, options: &[&str]) -> serde_json::Value {
    let inputs: Vec<&str> = inputs.iter().map(|input| text(input)).collect();
    json(&[&["build"][..], &inputs, &["-o", text(map), "--json"], options].concat())
}

fn refusal(inputs: &[&Path], map: &Path, options: &[&str]) -> (i32, String) {
    let inputs: Vec<&str> = inputs.iter().map(|input| text(input)).collect();
    failure(&[&["build"][..], &inputs, &["-o", text(map)], options].concat())
}

fn names(map: &Path) -> Vec<String> {
    let info = json(&["info", text(map), "--json"]);
    info["inputs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|input| input["name"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn files_of_a_folder_make_the_map_of_the_folder() {
    let folder = TempDir::new().unwrap();
    let [map, whole, other] = ["map", "whole", "other"].map(|name| folder.path().join(name));
    let clouds = folder.path().join("clouds");
    let [a, b, c] = write_clouds(&clouds);
    // Also a file that a shell's `clouds/*` lists and that is no cloud.
    let poses = clouds.join("poses_kitti.txt");
    fs::write(&poses, POSES).unwrap();
    build(&[&clouds], &whole, &[]);
    let built = build(&[&a, &b, &c, &poses], &map, &[]);
    assert_eq!((&built["scans"], &built["poses"]), (&3.into(), &text(&poses).into()));
    let remarks = built["remarks"].to_string();
    assert!(remarks.contains("poses_kitti.txt is not a cloud and was left out"), "{remarks}");
    assert_eq!(digest(&map), digest(&whole));
    assert_eq!(names(&map), ["0.xyz and other files"]);
    // The order is that of the arguments.
    let turned = build(&[&c, &b, &a], &other, &[]);
    assert!(turned["remarks"].to_string().contains("2.xyz where the order of the numbers"), "{turned}");
    assert_ne!(digest(&other), digest(&whole));
    // Later files continue the input.
    let grown = folder.path().join("grown");
    let still = folder.path().join("still");
    build(&[&a, &b, &c], &still, &["--poses", "identity"]);
    build(&[&a, &b], &grown, &["--poses", "identity"]);
    let more = build(&[&a, &b, &c], &grown, &["--poses", "identity", "--resume"]);
    assert_eq!((&more["scans"], &more["resumed_after"]), (&1.into(), &2.into()));
    assert_eq!((digest(&grown), names(&grown).len()), (digest(&still), 1));
    let (code, message) = refusal(&[&a, &b], &folder.path().join("few"), &[]);
    assert!(code == 2 && message.contains("3 poses for 2 clouds"), "{message}");
}

#[test]
fn a_pose_file_is_that_of_files_in_several_folders() {
    let folder = TempDir::new().unwrap();
    let (map, whole, poses) =
        (folder.path().join("map"), folder.path().join("whole"), folder.path().join("poses.txt"));
    fs::write(&poses, POSES).unwrap();
    let [a, b, c] = write_clouds(&folder.path().join("clouds"));
    let other = folder.path().join("other");
    fs::create_dir(&other).unwrap();
    let moved = other.join("2.xyz");
    fs::copy(&c, &moved).unwrap();
    build(&[&a, &b, &c], &whole, &["--poses", text(&poses)]);
    build(&[&a, &b, &moved], &map, &["--poses", text(&poses)]);
    assert_eq!(digest(&map), digest(&whole));
    // Without rays no poses are needed.
    let hits = build(&[&a, &moved], &folder.path().join("hits"), &["--no-rays"]);
    assert_eq!(hits["scans"], 2);
}

#[test]
fn recordings_are_inputs_of_their_own() {
    let folder = TempDir::new().unwrap();
    let [a, b, c] = write_logs(folder.path());
    let [map, one_by_one] = ["map", "one by one"].map(|name| folder.path().join(name));
    build(&[&a], &one_by_one, &["--max-range", "30"]);
    build(&[&b], &one_by_one, &["--append", "--max-range", "30"]);
    let built = build(&[&a, &b], &map, &["--max-range", "30", "--resolution", "0.1"]);
    assert_eq!(
        (&built["scans"], &built["scan_number"], &built["points"]),
        (&4.into(), &4.into(), &160.into())
    );
    assert_eq!(digest(&map), digest(&one_by_one));
    assert_eq!(names(&map), ["first.log", "second.log"]);
    // The map knows each of them.
    let (code, message) = refusal(&[&b], &map, &["--append"]);
    assert!(code == 2 && message.contains("second.log: the map already has 2 scans"), "{message}");
    // Inputs that are in the map already are skipped.
    let more = build(&[&a, &b, &c], &map, &["--resume"]);
    assert_eq!((&more["scans"], &more["resumed_after"]), (&2.into(), &4.into()));
    assert_eq!(names(&map), ["first.log", "second.log", "third.log"]);
    build(&[&c], &one_by_one, &["--append", "--max-range", "30"]);
    assert_eq!(digest(&map), digest(&one_by_one));
    let same = build(&[&a, &b, &c], &map, &["--resume"]);
    assert_eq!((&same["scans"], &same["resumed_after"]), (&0.into(), &6.into()));
}

#[test]
fn scans_are_selected_from_all_inputs_together() {
    let folder = TempDir::new().unwrap();
    let [a, b, c] = write_logs(folder.path());
    let all: Vec<u8> = [&a, &b, &c].iter().flat_map(|path| fs::read(path).unwrap()).collect();
    let joined = folder.path().join("joined.log");
    fs::write(&joined, all).unwrap();
    let selections: [&[&str]; 4] = [
        &["--first", "1", "--every", "2"],
        &["--first", "3", "--count", "2"],
        &["--every", "3", "--count", "2"],
        &["--count", "1"],
    ];
    for (number, selection) in selections.into_iter().enumerate() {
        let [map, whole] = ["map", "whole"].map(|name| folder.path().join(format!("{name} {number}")));
        let expected = build(&[&joined], &whole, selection)["scans"].clone();
        let strict = [selection, &["--strict"]].concat();
        assert_eq!(build(&[&a, &b, &c], &map, &strict)["scans"], expected, "{selection:?}");
        assert_eq!(digest(&map), digest(&whole), "{selection:?}");
        let listed = |inputs: &[&str]| {
            let lines = output(&[&["scans"][..], inputs, &["--json", "--each"], selection].concat());
            let lines: Vec<serde_json::Value> =
                lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
            let origins: Vec<_> = lines.iter().filter_map(|line| line.get("origin_m").cloned()).collect();
            (origins, lines.last().unwrap()["scans"].clone())
        };
        let found = listed(&[text(&a), text(&b), text(&c)]);
        assert_eq!(found, listed(&[text(&joined)]), "{selection:?}");
        assert_eq!(found.1, expected);
    }
}

#[test]
fn mistakes_in_a_list_name_the_file() {
    let folder = TempDir::new().unwrap();
    let [a, b, c] = write_logs(folder.path());
    let map = folder.path().join("map");
    let missing = folder.path().join("nothing.log");
    let cases: [(&[&Path], &[&str], &str); 5] = [
        (&[&a, &missing], &[], "nothing.log: there is no such file"),
        (&[&a, &b, &a], &[], "first.log: is given twice"),
        (&[&a, Path::new("-")], &[], "standard input cannot be combined"),
        (&[&a, &b], &["--poses", text(&c)], "has its own poses"),
        (&[], &[], "<SCANS>..."),
    ];
    for (inputs, options, expected) in cases {
        let (code, message) = refusal(inputs, &map, options);
        assert!(code == 2 && message.contains(expected), "{inputs:?}: {message}");
        assert!(!map.exists());
    }
    // Clouds of two formats are two inputs, which cannot share poses by number.
    let clouds = write_clouds(&folder.path().join("clouds"));
    let other = folder.path().join("clouds/3.pcd");
    fs::write(&other, "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n")
        .unwrap();
    let poses = folder.path().join("poses.txt");
    fs::write(&poses, POSES).unwrap();
    let inputs: Vec<&Path> = clouds.iter().chain([&other]).map(|path| &**path).collect();
    let (code, message) = refusal(&inputs, &map, &["--poses", text(&poses)]);
    assert!(code == 2 && message.contains("--poses") && message.contains("several inputs"), "{message}");
    assert!(!map.exists());
    // The scans before a damaged file are in the map.
    fs::write(&b, "NODE 2 0 0 0 0 0\n1 2 3\nNODE 3 0 0 0 0 0\n1 two 3\n").unwrap();
    let (code, message) = refusal(&[&a, &b, &c], &map, &[]);
    assert!(code == 1 && message.contains("second.log: malformed: line 4"), "{message}");
    assert!(message.contains("2 scans of the inputs before"), "{message}");
    assert_eq!(json(&["info", text(&map), "--json"])["scan_number"], 3);
    // Without the damaged file, the same command continues.
    build(&[&a, &c], &map, &["--resume"]);
    assert_eq!(json(&["info", text(&map), "--json"])["scan_number"], 5);
}
