use crate::cli::{failure, json, output, scans, text};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Takes a scan and its pose from an input of three.
fn drop_first(scans: &Path) {
    fs::remove_file(scans.join("000.pcd")).unwrap();
    let poses = fs::read_to_string(scans.join("poses_kitti.txt")).unwrap();
    fs::write(scans.join("poses_kitti.txt"), poses.split_once('\n').unwrap().1).unwrap();
}

fn digest(map: &str) -> String {
    output(&["digest", map])
}

#[test]
fn a_resumed_build_takes_every_scan_once_and_refuses_anything_else() {
    let folder = TempDir::new().unwrap();
    let input = scans(&folder);
    let (path, whole) = (folder.path().join("map"), folder.path().join("whole"));
    let (scans, map, whole) = (text(&input), text(&path), text(&whole));
    let build = |map, more: &[&str]| json(&[&["build", scans, "-o", map, "--json"], more].concat());
    let parameters = ["--resolution", "0.2", "--max-range", "9", "--insert", "per-ray"];
    build(whole, &parameters);
    // Begun by --resume; ended after it, nothing is left to do, with the parameters or without.
    let begun = build(map, &[&["--resume", "--flush-every", "1"], &parameters[..]].concat());
    assert_eq!((&begun["scans"], &begun["resumed_after"]), (&3.into(), &0.into()));
    for parameters in [&parameters[..], &[]] {
        let resumed = build(map, &[&["--resume"], parameters].concat());
        assert_eq!((&resumed["scans"], &resumed["resumed_after"]), (&0.into(), &3.into()));
    }
    assert_eq!(digest(map), digest(whole));

    let other = TempDir::new().unwrap();
    let other_input = crate::cli::scans(&other);
    drop_first(&other_input);
    let changed = TempDir::new().unwrap();
    let changed_input = crate::cli::scans(&changed);
    let file = changed_input.join("001.pcd");
    let text_of_file = fs::read_to_string(&file).unwrap().replacen("0.55", "0.56", 1);
    fs::write(&file, text_of_file).unwrap();
    let cases: [(&[&str], &str); 8] = [
        (&[text(&other_input)], "2 files, "),
        (&[text(&changed_input)], "been built from input 3 files, "),
        (&[scans, "--resolution", "0.1"], "resolution 0.2 m, not 0.1 m"),
        (&[scans, "--tile-size", "20"], "tile size 10 m, not 20 m"),
        (&[scans, "--max-range", "10"], "ranges of 0 m to 9 m, not 0 m to 10 m"),
        (&[scans, "--min-range", "1"], "ranges of 0 m to 9 m, not 1 m to 9 m"),
        (&[scans, "--insert", "per-scan"], "insert mode PerRay, not PerScan"),
        (&[scans, "--sensor-model", "iwlo"], "sensor model"),
    ];
    for (arguments, message) in cases {
        let (code, stderr) = failure(&[&["build", "-o", map, "--resume"], arguments].concat());
        assert!(code == 2 && stderr.contains(message), "{arguments:?}: {code}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
    assert_eq!(digest(map), digest(whole), "what is refused changes nothing");
}

#[test]
fn what_was_added_can_be_resumed_too() {
    let (first, second, folder) = (TempDir::new().unwrap(), TempDir::new().unwrap(), TempDir::new().unwrap());
    let (first, second) = (scans(&first), scans(&second));
    drop_first(&second);
    let map = folder.path().join("map");
    let map = text(&map);
    output(&["build", text(&first), "-o", map]);
    output(&["build", text(&second), "-o", map, "--append"]);
    let resumed = json(&["build", text(&second), "-o", map, "--resume", "--json"]);
    assert_eq!(
        (&resumed["scans"], &resumed["resumed_after"], &resumed["scan_number"]),
        (&0.into(), &2.into(), &5.into())
    );
    let (code, stderr) = failure(&["build", text(&first), "-o", map, "--resume"]);
    assert!(code == 2 && stderr.contains("been built from input 2 files"), "{stderr}");
    let (code, _) = failure(&["build", text(&first), "-o", map, "--resume", "--append"]);
    assert_eq!(code, 2);
    for wrong in ["0", "-1", "x", "5m", "s"] {
        let (code, stderr) = failure(&["build", text(&first), "-o", map, "--resume", "--flush-every", wrong]);
        assert!(code == 2 && stderr.contains("flush-every"), "{stderr}");
    }
}

#[test]
fn damage_has_an_exit_code_and_a_line_and_is_repaired() {
    let folder = TempDir::new().unwrap();
    let input = scans(&folder);
    let path = folder.path().join("map");
    let map = text(&path);
    output(&["build", text(&input), "-o", map, "--resolution", "0.2"]);
    assert!(output(&["verify", map]).contains("whole: every checksum matches"));
    let whole = json(&["verify", map, "--json"]);
    assert_eq!(
        (&whole["whole"], &whole["verified"], &whole["damage"]),
        (&true.into(), &true.into(), &0.into())
    );
    assert!(output(&["repair", map]).contains("nothing to repair"));

    let before = digest(map);
    let tile = fs::read_dir(&path)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("octree.bt").exists())
        .min()
        .unwrap();
    let octree = tile.join("octree.bt");
    let bytes = fs::read(&octree).unwrap();
    let mut flipped = bytes.clone();
    let at = flipped.len() - 3;
    flipped[at] ^= 4;
    fs::write(&octree, flipped).unwrap();
    let (code, stdout) = failing_output(&["verify", map]);
    assert_eq!(code, 1);
    assert!(stdout.contains(&format!("{}: tile (", octree.display())), "{stdout}");
    assert!(stdout.contains(&format!("offset {at}: ")), "{stdout}");
    assert_eq!(digest(map), before, "the table is the truth");
    assert!(output(&["repair", map]).contains("derived: "));
    assert_eq!(fs::read(&octree).unwrap(), bytes);

    let table = tile.join("iwlo_meta.bin");
    fs::write(&table, b"OLWI").unwrap();
    let (code, stderr) = failure(&["digest", map]);
    assert!(code == 1 && stderr.contains("voxtile verify"), "{stderr}");
    let damaged = failing_output(&["verify", map, "--json"]).1;
    let damaged: serde_json::Value = serde_json::from_str(&damaged).unwrap();
    let finding = &damaged["findings"][0];
    assert_eq!((&finding["path"], &finding["offset"]), (&text(&table).into(), &0.into()));
    // A script must not take a map with holes for a whole one.
    let repaired: serde_json::Value =
        serde_json::from_str(&failing_output(&["repair", map, "--json"]).1).unwrap();
    assert_eq!(repaired["tiles_lost"], 1);
    assert_eq!(repaired["done"][0]["kind"], "quarantined");
    let name = tile.file_name().unwrap();
    assert_eq!(fs::read(path.join("quarantine").join(name).join("iwlo_meta.bin")).unwrap(), b"OLWI");
    assert_ne!(digest(map), before);
    assert_eq!(json(&["verify", map, "--json"])["whole"], true);
    let (code, _) = failure(&["verify", text(folder.path())]);
    assert_eq!(code, 1);
}

#[test]
fn a_map_of_the_seeds_own_format_is_unverified_and_not_damaged() {
    let folder = TempDir::new().unwrap();
    let input = scans(&folder);
    let path = folder.path().join("map");
    let map = text(&path);
    output(&["build", text(&input), "-o", map, "--resolution", "0.2"]);
    strip(&path);
    let verified = json(&["verify", map, "--json"]);
    assert_eq!((&verified["whole"], &verified["verified"]), (&true.into(), &false.into()));
    assert!(output(&["verify", map]).contains("unverified"));
    assert!(output(&["repair", map]).contains("nothing to repair"));
}

/// Takes from a map all that is not the seed's.
fn strip(map: &Path) {
    fs::remove_file(map.join("commits.log")).unwrap();
    let metadata = r#"{"version": "1.0", "resolution": 0.2, "tile_size": 10.0, "bounds": {"min": [0,0,0], "max": [0,0,0]}}"#;
    fs::write(map.join("metadata.json"), metadata).unwrap();
    for entry in fs::read_dir(map).unwrap() {
        let table = entry.unwrap().path().join("iwlo_meta.bin");
        if let Ok(bytes) = fs::read(&table) {
            let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap()) as usize;
            fs::write(&table, &bytes[..16 + 18 * count]).unwrap();
        }
    }
}

fn failing_output(arguments: &[&str]) -> (i32, String) {
    let assert = crate::cli::voxtile(arguments).assert().failure();
    let run = assert.get_output();
    (run.status.code().unwrap(), String::from_utf8(run.stdout.clone()).unwrap())
}
