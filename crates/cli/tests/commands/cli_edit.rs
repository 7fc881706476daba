use crate::cli::{failure, json, output, scans, text, voxtile};
use std::path::PathBuf;
use tempfile::TempDir;

const BOX: [&str; 7] = ["--region", "-1", "-2.5", "0", "4", "0.05", "1"];
const ELSEWHERE: [&str; 7] = ["--region", "100", "100", "100", "101", "101", "101"];

/// Builds a map of three scans of a wall; also returns a free path next to it.
fn built(folder: &TempDir, how: &[&str]) -> (PathBuf, PathBuf) {
    let (scans, map) = (scans(folder), folder.path().join("map"));
    let build = ["build", text(&scans), "-o", text(&map), "--tile-size", "2"];
    output(&[&build[..], how].concat());
    (map, folder.path().join("out"))
}

fn digest(map: &str) -> String {
    output(&["digest", map])
}

/// Commands that need a map folder explain how to convert an OctoMap file.
#[test]
fn octomap_files_are_refused_with_a_hint_where_a_folder_is_needed() {
    let folder = TempDir::new().unwrap();
    let [tree, other] = ["a.bt", "a.txt"].map(|name| folder.path().join(name));
    output(&["export", text(&built(&folder, &[]).0), "-o", text(&tree)]);
    std::fs::write(&other, "no map").unwrap();
    for arguments in [
        &["verify"][..],
        &["repair"],
        &["snapshot", "before"],
        &["snapshot", "before", "--delete"],
        &["snapshots"],
        &["revert", "before"],
        &["clear", "--region", "0", "0", "0", "1", "1", "1"],
        &["decay", "--halflife", "5"],
        &["remap", "--poses", "poses.txt"],
        &["remove-scans", "--scans", "1"],
        &["remove-points", "--region", "0", "0", "0", "1", "1", "1"],
        &["convert", "--storage", "compact", "-o", text(&folder.path().join("new"))],
    ] {
        for (file, named) in [
            (&tree, "convert it to a map with `voxtile import`"),
            (&other, "is a file, but not an OctoMap file"),
        ] {
            let [command, rest @ ..] = arguments else { unreachable!() };
            let (code, stderr) = failure(&[&[*command, text(file)], rest].concat());
            assert!(code == 2 && stderr.contains(named), "{arguments:?}: {stderr}");
        }
    }
}

#[test]
fn cropped_parts_merge_to_the_whole() {
    for storage in ["octomap", "compact"] {
        let folder = TempDir::new().unwrap();
        let (map, out) = built(&folder, &["--storage", storage]);
        let (map, inside) = (text(&map), text(&out));
        let cropped = json(&[&["crop", map, "-o", inside, "--json"], &BOX[..]].concat());
        let outside = format!("{inside}_rest");
        let reported = output(&[&["crop", map, "-o", &outside, "--outside"], &BOX[..]].concat());
        assert!(reported.starts_with("map       ") && reported.contains("occupied"), "{reported}");
        let [all, some, rest] = [map, inside, &outside].map(|map| json(&["info", map, "--json"]));
        assert_eq!(cropped["voxels"], some["voxels"]);
        let sum = some["voxels"].as_u64().unwrap() + rest["voxels"].as_u64().unwrap();
        assert_eq!(Some(sum), all["voxels"].as_u64());
        let again = format!("{inside}_again");
        let merged = json(&["merge", inside, &outside, "-o", &again, "--prefer", "first", "--json"]);
        assert_eq!(merged["common_voxels"].as_u64(), Some(0));
        assert_eq!(merged["warnings"].as_array().map(Vec::len), Some(0));
        assert_eq!(digest(&again), digest(map));
        assert!(output(&["verify", &again]).contains("intact"));
    }
}

#[test]
fn a_part_is_cleared_in_place() {
    let folder = TempDir::new().unwrap();
    let (map, out) = built(&folder, &[]);
    let (map, out) = (text(&map), text(&out));
    let before = digest(map);
    output(&[&["crop", map, "-o", out, "--outside"], &BOX[..]].concat());
    let cleared = json(&[&["clear", map, "--json"], &ELSEWHERE[..]].concat());
    assert_eq!((cleared["voxels_cleared"].as_u64(), digest(map)), (Some(0), before));
    let cleared = json(&[&["clear", map, "--json"], &BOX[..]].concat());
    assert!(
        cleared["voxels_cleared"].as_u64() > Some(0) && cleared["tiles_removed"].as_u64() > Some(0),
        "{cleared}"
    );
    assert_eq!(digest(map), digest(out));
    assert!(output(&["verify", map]).contains("intact"));
    // New scans can map the cleared voxels again.
    let scans = folder.path().join("scans");
    output(&["build", text(&scans), "-o", map, "--append", "--again"]);
    assert_eq!(json(&["info", map, "--json"])["scan_number"].as_u64(), Some(6));
    let reported = output(&[&["clear", map, "--outside"], &ELSEWHERE[..]].concat());
    assert!(reported.contains("tiles     0; "), "{reported}");
    assert_eq!(json(&["info", map, "--json"])["voxels"].as_u64(), Some(0));
}

#[test]
fn log_odds_decay_once_per_new_scan() {
    let folder = TempDir::new().unwrap();
    let (map, _) = built(&folder, &[]);
    let map = text(&map);
    let log_odds = || json(&["query", map, "4.1", "-0.5", "0.6", "--json"])["log_odds"].as_f64().unwrap();
    let before = log_odds();
    let decayed = json(&["decay", map, "--halflife", "3", "--json"]);
    assert_eq!((decayed["scans"].as_u64(), decayed["factor"].as_f64()), (Some(3), Some(0.5)));
    assert_eq!(log_odds(), before / 2.0);
    assert_eq!(json(&["info", map, "--json"])["decayed_scan"].as_u64(), Some(3));
    let reported = output(&["decay", map, "--halflife", "3"]);
    assert!(reported.contains("by 0 scans"), "{reported}");
    assert_eq!(log_odds(), before / 2.0);
    output(&["decay", map, "--halflife", "3", "--scans", "3", "--forget-below", "0.4"]);
    assert_eq!(log_odds(), before / 4.0);
    assert!(output(&["query", map, "2", "-0.1", "0.3"]).contains("unknown"), "was free, and is forgotten");
    assert!(output(&["verify", map]).contains("intact"));
}

#[test]
fn related_maps_give_a_warning_and_count_twice() {
    let folder = TempDir::new().unwrap();
    let (map, out) = built(&folder, &[]);
    let (map, out) = (text(&map), text(&out));
    let run = voxtile(&["merge", map, map, "-o", out, "--json"]).assert().success();
    let run = run.get_output();
    let merged: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let warning = merged["warnings"][0].as_str().unwrap();
    assert!(warning.contains("counts twice"), "{warning}");
    assert!(String::from_utf8_lossy(&run.stderr).contains(warning));
    let count = |map| json(&["query", map, "4.1", "-0.5", "0.6", "--json"])["observation_count"].as_i64();
    assert_eq!((count(map), count(out)), (Some(3), Some(6)));
    let once = format!("{out}_once");
    let merged = json(&["merge", map, map, "-o", &once, "--prefer", "more-observed", "--json"]);
    assert_eq!(merged["warnings"].as_array().map(Vec::len), Some(0));
    assert_eq!(digest(&once), digest(map));
}

#[test]
fn impossible_requests_print_one_line() {
    let folder = TempDir::new().unwrap();
    let (map, out) = built(&folder, &[]);
    let (map, out) = (text(&map), text(&out));
    let nowhere = format!("{out}/nowhere");
    let flat = ["--region", "0", "0", "0", "1", "1", "0"];
    let cases: [(&[&str], i32, &str); 8] = [
        (&["merge", map, "-o", out], 2, "2 values required"),
        (&["merge", map, &nowhere, "-o", out], 1, "no map here"),
        (&["merge", map, map, "-o", map], 2, "choose a folder that does not exist yet"),
        (&[&["crop", map, "-o", map], &BOX[..]].concat(), 2, "choose a folder"),
        (&[&["crop", map, "-o", out], &flat[..]].concat(), 2, "needs X0 < X1"),
        (&[&["clear", map], &flat[..]].concat(), 2, "needs X0 < X1"),
        (&["decay", map, "--halflife", "0"], 2, "halflife: 0 is not a number of scans above 0"),
        (&["decay", map, "--halflife", "3", "--forget-below", "-1"], 2, "--forget-below"),
    ];
    for (arguments, code, reason) in cases {
        let (found, message) = failure(arguments);
        assert!(found == code && message.contains(reason), "{arguments:?}: {found} {message}");
    }
    assert!(!folder.path().join("out").exists());
    for command in ["merge", "crop", "clear", "decay"] {
        let help = output(&[command, "--help"]);
        assert!(
            help.contains("--json") && help.contains(if command == "merge" { "log-odds" } else { "MAP" }),
            "{help}"
        );
    }
}
