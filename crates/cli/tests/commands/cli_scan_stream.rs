use crate::cli::{json, text, voxtile};
use std::path::Path;
use tempfile::TempDir;
use voxtile_formats::ScanStreamWriter;
use voxtile_simulation::Survey;

fn drive(label: &str, scans: usize) -> Vec<u8> {
    drive_of(1, label, scans)
}

fn drive_of(seed: u64, label: &str, scans: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ScanStreamWriter::new(&mut bytes, label, true).unwrap();
    Survey::tour(seed, 300).take(scans).for_each(|scan| writer.write_world(&scan).unwrap());
    bytes
}

fn digest(map: &Path) -> String {
    json(&["digest", text(map), "--json"])["digest"].as_str().unwrap().to_owned()
}

#[test]
fn a_map_is_built_from_standard_input_and_resumed_with_the_same_scans() {
    let folder = TempDir::new().unwrap();
    let (map, whole, file) =
        (folder.path().join("map"), folder.path().join("whole"), folder.path().join("drive.scans"));
    let build = |map: &Path, how: &[&str]| {
        let mut arguments = vec!["build", "-", "-o", text(map), "--resolution", "0.5", "--json"];
        arguments.extend(how);
        voxtile(&arguments)
    };
    build(&map, &[]).write_stdin(drive("drive 1", 3)).assert().success();
    // Another stream cannot resume it, whatever its name.
    let other = build(&map, &["--resume"]).write_stdin(drive_of(2, "drive 1", 5)).assert().code(2);
    assert!(String::from_utf8_lossy(&other.get_output().stderr).contains("drive 1"));
    // A longer version of the same stream can: its first three scans are skipped.
    let longer = build(&map, &["--resume"]).write_stdin(drive("", 5)).assert().success();
    let summary: serde_json::Value = serde_json::from_slice(&longer.get_output().stdout).unwrap();
    assert_eq!((summary["scans"].as_u64(), summary["resumed_after"].as_u64()), (Some(2), Some(3)));
    build(&map, &["--resume"]).write_stdin(drive("drive 1", 2)).assert().code(2);

    std::fs::write(&file, drive("", 5)).unwrap();
    json(&["build", text(&file), "-o", text(&whole), "--resolution", "0.5", "--json"]);
    assert_eq!(digest(&map), digest(&whole));
    build(&folder.path().join("bare"), &[]).write_stdin(drive("", 1)).assert().success();
    let nothing = folder.path().join("nothing");
    build(&nothing, &[]).write_stdin(b"no scans".to_vec()).assert().code(1);
    assert!(!nothing.exists());
}

#[test]
fn dropped_scans_are_counted_and_not_added_later() {
    const SCANS: usize = 60;
    let folder = TempDir::new().unwrap();
    let (map, again, file) =
        (folder.path().join("map"), folder.path().join("again"), folder.path().join("drive.scans"));
    for how in ["drop-oldest", "thin"] {
        let _ = std::fs::remove_dir_all(&map);
        let _ = std::fs::remove_dir_all(&again);
        let arguments = ["build", "-", "-o", text(&map), "--resolution", "0.5", "--keep-scans", "--json"];
        let arguments = [&arguments[..], &["--when-behind", how]].concat();
        // All scans at once.
        let built = voxtile(&arguments).write_stdin(drive("", SCANS)).assert().success();
        let summary: serde_json::Value = serde_json::from_slice(&built.get_output().stdout).unwrap();
        let [scans, left_out] = ["scans", "left_out_scans"].map(|key| summary[key].as_u64().unwrap());
        assert_eq!(scans + left_out, SCANS as u64);
        assert!(scans > 0 && left_out > 0, "{summary}");
        // The map equals a build of the scans that it keeps.
        json(&["build", text(&map), "-o", text(&again), "--resolution", "0.5", "--json"]);
        assert_eq!(digest(&map), digest(&again));
        assert_eq!(json(&["info", text(&map), "--json"])["scan_number"], scans);
        // The same input resumes after the last scan; dropped scans are not added.
        let arguments = ["build", "-", "-o", text(&map), "--resolution", "0.5", "--resume", "--json"];
        let resumed = voxtile(&arguments).write_stdin(drive("", SCANS + 2)).assert().success();
        let summary: serde_json::Value = serde_json::from_slice(&resumed.get_output().stdout).unwrap();
        assert_eq!((summary["scans"].as_u64(), summary["left_out_scans"].as_u64()), (Some(2), Some(0)));
    }
    std::fs::write(&file, drive("", 2)).unwrap();
    let new = folder.path().join("new");
    let arguments = ["build", text(&file), "-o", text(&new), "--when-behind", "thin"];
    let refused = voxtile(&arguments).assert().code(2);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("--when-behind"));
}

#[test]
fn a_local_map_reads_scans_from_standard_input() {
    let folder = TempDir::new().unwrap();
    let (file, picture) = (folder.path().join("drive.scans"), folder.path().join("local.png"));
    let local = |scans: &str, how: &[&str]| {
        let arguments = ["local", scans, "-o", text(&picture), "--resolution", "0.5", "--json"];
        voxtile(&[&arguments[..], how].concat())
    };
    let row = |output: assert_cmd::assert::Assert| {
        let row: serde_json::Value = serde_json::from_slice(&output.success().get_output().stdout).unwrap();
        ["scans", "points", "n_occ", "n_inf"].map(|key| row[key].clone())
    };
    let piped = row(local("-", &[]).write_stdin(drive("", 6)).assert());
    std::fs::write(&file, drive("", 6)).unwrap();
    assert_eq!(piped, row(local(text(&file), &[]).assert()));
    assert_eq!(piped[0], 6);
    assert!(picture.exists());
    let refused = local("-", &["--repeat", "2"]).write_stdin(drive("", 6)).assert().code(2);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("only once"));
}
