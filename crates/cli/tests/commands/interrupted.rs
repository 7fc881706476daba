use crate::cli::{failure, json, output, scans, text};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Removes a scan and its pose from an input of three.
fn drop_first(scans: &Path) {
    fs::remove_file(scans.join("000.pcd")).unwrap();
    let poses = fs::read_to_string(scans.join("poses_kitti.txt")).unwrap();
    fs::write(scans.join("poses_kitti.txt"), poses.split_once('\n').unwrap().1).unwrap();
}

fn digest(map: &str) -> String {
    output(&["digest", map])
}

#[test]
fn a_resumed_build_adds_every_scan_once_and_refuses_other_input() {
    let folder = TempDir::new().unwrap();
    let input = scans(&folder);
    let (path, whole) = (folder.path().join("map"), folder.path().join("whole"));
    let (scans, map, whole) = (text(&input), text(&path), text(&whole));
    let build = |map, more: &[&str]| json(&[&["build", scans, "-o", map, "--json"], more].concat());
    let parameters = ["--resolution", "0.2", "--max-range", "9", "--insert", "per-ray"];
    build(whole, &parameters);
    // The first build starts with --resume. Later ones add nothing, with or without the parameters.
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
        (&[text(&other_input)], "has 2 scans, but the map already has 3 scans of it"),
        (&[text(&changed_input)], "the map already has its first 3 scans, but they have changed"),
        (&[scans, "--resolution", "0.1"], "resolution 0.2 m, not 0.1 m"),
        (&[scans, "--tile-size", "20"], "tile size 10 m, not 20 m"),
        (&[scans, "--max-range", "10"], "ranges of 0 m to 9 m, not 0 m to 10 m"),
        (&[scans, "--min-range", "1"], "ranges of 0 m to 9 m, not 1 m to 9 m"),
        (&[scans, "--insert", "per-scan"], "insert mode per-ray, not per-scan"),
        (&[scans, "--sensor-model", "iwlo"], "sensor model"),
    ];
    for (arguments, message) in cases {
        let (code, stderr) = failure(&[&["build", "-o", map, "--resume"], arguments].concat());
        assert!(code == 2 && stderr.contains(message), "{arguments:?}: {code}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
    assert_eq!(digest(map), digest(whole), "a refused build does not change the map");
}

/// Writes scans at different x, in metres, that differ between seeds.
fn numbered(folder: &Path, seed: u32, numbers: std::ops::Range<u32>) {
    fs::create_dir_all(folder).unwrap();
    for number in numbers {
        let points: String = (0..50)
            .map(|k| format!("{} {} 0.5\n", 3 + seed, 0.1 * f64::from(k) + 0.01 * f64::from(number)))
            .collect();
        let text = format!(
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 50\nHEIGHT 1\nVIEWPOINT {number} 0 0.5 1 0 0 0\nDATA ascii\n{points}"
        );
        fs::write(folder.join(format!("scan{number}.pcd")), text).unwrap();
    }
}

#[test]
fn known_inputs_resume_when_grown_and_are_refused_when_changed() {
    let folder = TempDir::new().unwrap();
    let [a, b, map, whole] = ["a", "b", "map", "whole"].map(|name| folder.path().join(name));
    numbered(&a, 1, 1..6);
    numbered(&b, 2, 1..4);
    let map = text(&map);
    let build =
        |input: &Path, how: &[&str]| json(&[&["build", text(input), "-o", map, "--json"], how].concat());
    // The same command line creates and extends the map.
    let once = ["--append", "--resume"];
    assert_eq!(build(&a, &once)["scans"], 5);
    assert_eq!((&build(&b, &once)["scans"], &build(&a, &once)["scans"]), (&3.into(), &0.into()));
    // New scans whose names are last in numeric order, but not in byte order.
    numbered(&a, 1, 1..13);
    let grown = build(&a, &once);
    assert_eq!(
        (&grown["scans"], &grown["resumed_after"], &grown["scan_number"]),
        (&7.into(), &5.into(), &15.into())
    );
    assert_eq!(build(&a, &["--resume"])["scans"], 0);
    assert_eq!(build(&b, &once)["scans"], 0);

    // Equal to a build without interruptions, because hits and misses of these scans commute.
    let parts = [("b", 1..4, 2), ("a", 1..13, 1)];
    let [first, second] = parts.map(|(name, numbers, seed)| {
        let again = folder.path().join(format!("again_{name}"));
        numbered(&again, seed, numbers);
        again
    });
    for input in [&a, &first, &second] {
        let (code, stderr) = failure(&["build", text(input), "-o", map, "--append"]);
        assert!(code == 2 && stderr.contains("--append --again"), "{stderr}");
    }
    assert_eq!(json(&["info", map, "--json"])["scan_number"], 15);
    output(&["build", text(&a), "-o", text(&whole)]);
    output(&["build", text(&b), "-o", text(&whole), "--append"]);
    assert_eq!(json(&["info", text(&whole), "--json"])["voxels"], json(&["info", map, "--json"])["voxels"]);

    // Change an added scan, and then a pose.
    let third = a.join("scan3.pcd");
    let good = fs::read_to_string(&third).unwrap();
    fs::write(&third, good.replacen("4 0.03", "4 0.04", 1)).unwrap();
    let (code, stderr) = failure(&["build", text(&a), "-o", map, "--resume"]);
    assert!(code == 2 && stderr.contains("but they have changed"), "{stderr}");
    fs::write(&third, good.replacen("VIEWPOINT 3 ", "VIEWPOINT 3.5 ", 1)).unwrap();
    let (code, stderr) = failure(&["build", text(&a), "-o", map, "--append", "--resume"]);
    assert!(code == 2 && stderr.contains("but their poses have changed"), "{stderr}");
    fs::write(&third, good).unwrap();
    assert_eq!(build(&a, &["--append", "--again"])["scans"], 12);
}

#[test]
fn unreadable_scans_are_skipped_named_and_remain_skipped() {
    let folder = TempDir::new().unwrap();
    let [a, good, map, whole] = ["a", "good", "map", "whole"].map(|name| folder.path().join(name));
    numbered(&a, 1, 0..8);
    numbered(&good, 1, 0..8);
    for bad in ["scan2.pcd", "scan7.pcd"] {
        fs::write(a.join(bad), "no cloud\n").unwrap();
        fs::remove_file(good.join(bad)).unwrap();
    }
    let map = text(&map);
    let (code, stderr) = failure(&["build", text(&a), "-o", map]);
    assert!(code == 1 && stderr.contains("scan2.pcd") && stderr.contains("after 2 scans"), "{stderr}");
    let went_on = json(&["build", text(&a), "-o", map, "--resume", "--skip-bad", "--json"]);
    assert_eq!((&went_on["scans"], &went_on["resumed_after"]), (&4.into(), &2.into()));
    let unread: Vec<&str> =
        went_on["unread_scans"].as_array().unwrap().iter().map(|scan| scan.as_str().unwrap()).collect();
    assert!(unread[0].starts_with("scan 2: ") && unread[0].contains("scan2.pcd"), "{unread:?}");
    assert!(unread[1].starts_with("scan 7: ") && unread.len() == 2, "{unread:?}");
    output(&["build", text(&good), "-o", text(&whole)]);
    assert_eq!(digest(map), digest(text(&whole)));

    // The input grows; a skipped scan remains skipped even if it becomes readable, without --skip-bad.
    numbered(&a, 1, 2..3);
    numbered(&a, 1, 8..10);
    numbered(&good, 1, 8..10);
    let grown = json(&["build", text(&a), "-o", map, "--resume", "--json"]);
    assert_eq!((&grown["scans"], &grown["resumed_after"]), (&2.into(), &6.into()));
    output(&["build", text(&good), "-o", text(&whole), "--resume"]);
    assert_eq!(digest(map), digest(text(&whole)));
}

/// Maps of earlier versions record one input, by its files.
#[test]
fn an_input_of_an_earlier_version_resumes() {
    let folder = TempDir::new().unwrap();
    let [a, map, whole] = ["a", "map", "whole"].map(|name| folder.path().join(name));
    numbered(&a, 1, 0..6);
    let config = voxtile::MapConfig::new(0.1, 10.0).unwrap().with_range(0.0, 100.0);
    let mut mapper = voxtile::OutOfCoreTileMapper::create(&map, config).unwrap();
    let mut source = voxtile_formats::open_scans(&a, &Default::default()).unwrap();
    mapper.begin_input(source.fingerprint().unwrap()).unwrap();
    for _ in 0..4 {
        let scan = source.next_scan().unwrap().unwrap().into_scan();
        voxtile::Mapper::insert_scan(&mut mapper, &scan).unwrap();
    }
    voxtile::Mapper::flush(&mut mapper).unwrap();
    drop(mapper);
    let (map, whole) = (text(&map), text(&whole));
    let (code, stderr) = failure(&["build", text(&a), "-o", map, "--append"]);
    assert!(code == 2 && stderr.contains("the map already has 4 scans"), "{stderr}");
    let resumed = json(&["build", text(&a), "-o", map, "--resume", "--json"]);
    assert_eq!((&resumed["scans"], &resumed["resumed_after"]), (&2.into(), &4.into()));
    output(&["build", text(&a), "-o", whole]);
    assert_eq!(digest(map), digest(whole));
    // From here on it is recorded scan by scan.
    numbered(&a, 1, 6..7);
    assert_eq!(json(&["build", text(&a), "-o", map, "--resume", "--json"])["scans"], 1);
}

#[test]
fn an_appended_input_can_be_resumed() {
    let (first, second, folder) = (TempDir::new().unwrap(), TempDir::new().unwrap(), TempDir::new().unwrap());
    let first = scans(&first);
    let second = second.path().join("scans");
    numbered(&second, 1, 0..2);
    let map = folder.path().join("map");
    let map = text(&map);
    output(&["build", text(&first), "-o", map]);
    output(&["build", text(&second), "-o", map, "--append"]);
    let resumed = json(&["build", text(&second), "-o", map, "--resume", "--json"]);
    assert_eq!(
        (&resumed["scans"], &resumed["resumed_after"], &resumed["scan_number"]),
        (&0.into(), &2.into(), &5.into())
    );
    let third = folder.path().join("third");
    numbered(&third, 2, 0..2);
    let (code, stderr) = failure(&["build", text(&third), "-o", map, "--resume"]);
    assert!(code == 2 && stderr.contains("been built from input"), "{stderr}");
    // Another input with the same name.
    for file in fs::read_dir(&third).unwrap().map(|file| file.unwrap().path()) {
        fs::copy(&file, second.join(file.file_name().unwrap())).unwrap();
    }
    let (code, stderr) = failure(&["build", text(&second), "-o", map, "--resume"]);
    let differs = "the input was replaced or its beginning has changed";
    assert!(code == 2 && stderr.contains(differs), "{stderr}");
    let fingerprints: Vec<&str> =
        stderr.split("has the fingerprint ").skip(1).map(|rest| &rest[..12]).collect();
    assert!(matches!(fingerprints[..], [found, wanted] if found != wanted), "{stderr}");
    for wrong in ["0", "-1", "x", "5m", "s"] {
        let (code, stderr) = failure(&["build", text(&first), "-o", map, "--resume", "--flush-every", wrong]);
        assert!(code == 2 && stderr.contains("flush-every"), "{stderr}");
    }
}

#[test]
fn damage_is_reported_with_an_exit_code_and_repaired() {
    let folder = TempDir::new().unwrap();
    let input = scans(&folder);
    let path = folder.path().join("map");
    let map = text(&path);
    output(&["build", text(&input), "-o", map, "--resolution", "0.2"]);
    assert!(output(&["verify", map]).contains("intact: all checksums match"));
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
    assert_eq!(digest(map), before, "the digest does not depend on the octree");
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
    // Scripts must not treat an incomplete map as intact.
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
fn a_map_of_the_original_format_is_unverified_and_not_damaged() {
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

/// Removes everything that is not in the original format.
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

#[test]
fn a_build_started_with_resume_equals_a_plain_build() {
    let folder = TempDir::new().unwrap();
    let cloud = folder.path().join("far.pcd");
    // Beyond the default maximum range.
    let far = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA \
               ascii\n150 0 0\n";
    fs::write(&cloud, far).unwrap();
    let [plain, resumed] = ["plain", "resumed"].map(|name| folder.path().join(name));
    output(&["build", text(&cloud), "-o", text(&plain)]);
    output(&["build", text(&cloud), "-o", text(&resumed), "--resume"]);
    assert_eq!(output(&["digest", text(&plain)]), output(&["digest", text(&resumed)]));
}

/// A scan with a pose too far from the origin fails like an unreadable scan, or is skipped with --skip-bad.
#[test]
fn a_scan_with_a_pose_too_far_away_can_be_skipped() {
    let folder = TempDir::new().unwrap();
    let [a, good, map, whole] = ["a", "good", "map", "whole"].map(|name| folder.path().join(name));
    numbered(&a, 1, 0..5);
    numbered(&good, 1, 0..5);
    for (bad, number) in [("scan0.pcd", 0), ("scan3.pcd", 3)] {
        let text = fs::read_to_string(a.join(bad)).unwrap();
        let pose = format!("VIEWPOINT {number} ");
        assert!(text.contains(&pose), "{text}");
        fs::write(a.join(bad), text.replacen(&pose, "VIEWPOINT 1e12 ", 1)).unwrap();
        fs::remove_file(good.join(bad)).unwrap();
    }
    let map = text(&map);
    let (code, stderr) = failure(&["build", text(&a), "-o", map]);
    assert!(code == 1 && stderr.contains("record 0: ") && !Path::new(map).exists(), "{stderr}");
    fs::rename(a.join("scan0.pcd"), folder.path().join("scan0.pcd")).unwrap();
    let (code, stderr) = failure(&["build", text(&a), "-o", map]);
    assert!(code == 1 && stderr.contains("scan3.pcd") && stderr.contains("after 2 scans"), "{stderr}");
    let (code, stderr) = failure(&["build", text(&a), "-o", map, "--resume"]);
    assert!(code == 1 && stderr.contains("record 2: ") && stderr.contains("after 2 scans"), "{stderr}");
    let went_on = json(&["build", text(&a), "-o", map, "--resume", "--skip-bad", "--json"]);
    assert_eq!((&went_on["scans"], &went_on["resumed_after"]), (&1.into(), &2.into()));
    output(&["build", text(&good), "-o", text(&whole)]);
    assert_eq!(digest(map), digest(text(&whole)));
    // Also as the first scan. Points without rays need no valid origin.
    fs::rename(folder.path().join("scan0.pcd"), a.join("scan0.pcd")).unwrap();
    let other = folder.path().join("other");
    output(&["build", text(&a), "-o", text(&other), "--skip-bad"]);
    assert_eq!(digest(text(&other)), digest(map));
    let points = folder.path().join("points");
    assert_eq!(json(&["build", text(&a), "-o", text(&points), "--no-rays", "--json"])["scans"], 5);
}

/// A later input may have other ranges.
#[test]
fn an_input_resumes_with_its_own_settings() {
    let folder = TempDir::new().unwrap();
    let [a, b, map] = ["a", "b", "map"].map(|name| folder.path().join(name));
    numbered(&a, 1, 0..3);
    numbered(&b, 2, 0..2);
    let map = text(&map);
    let build =
        |input: &Path, how: &[&str]| json(&[&["build", text(input), "-o", map, "--json"], how].concat());
    build(&a, &["--max-range", "50"]);
    assert_eq!(build(&b, &["--append", "--max-range", "1"])["hits"], 0);
    numbered(&a, 1, 3..4);
    let resumed = build(&a, &["--resume"]);
    assert_eq!((&resumed["resumed_after"], &resumed["cut_at_max_range"]), (&3.into(), &0.into()));
    assert!(resumed["hits"].as_u64() > Some(0), "{resumed}");
    numbered(&a, 1, 4..5);
    let (code, stderr) = failure(&["build", text(&a), "-o", map, "--resume", "--max-range", "1"]);
    assert!(code == 2 && stderr.contains("ranges of 0 m to 50 m, not 0 m to 1 m"), "{stderr}");
    assert_eq!(build(&a, &["--resume", "--max-range", "50"])["scans"], 1);
    // The other input also resumes with its own ranges.
    numbered(&b, 2, 2..3);
    let resumed = build(&b, &["--resume"]);
    assert_eq!((&resumed["resumed_after"], &resumed["hits"]), (&2.into(), &0.into()));
}

#[test]
fn points_alone_and_rays_of_one_input_do_not_mix() {
    for begun_alone in [true, false] {
        let folder = TempDir::new().unwrap();
        let [a, map] = ["a", "map"].map(|name| folder.path().join(name));
        numbered(&a, 1, 0..2);
        let alone = |is_alone: bool| if is_alone { &["--no-rays"][..] } else { &[] };
        let build = ["build", text(&a), "-o", text(&map)];
        output(&[&build[..], alone(begun_alone)].concat());
        numbered(&a, 1, 2..3);
        let before = digest(text(&map));
        let (code, stderr) = failure(&[&build[..], &["--resume"], alone(!begun_alone)].concat());
        assert!(code == 2 && stderr.contains("points without rays (--no-rays)"), "{stderr}");
        assert_eq!(digest(text(&map)), before);
        output(&[&build[..], &["--resume"], alone(begun_alone)].concat());
        assert_ne!(digest(text(&map)), before);
    }
}

#[test]
fn an_input_of_only_empty_scans_is_resumed() {
    let folder = TempDir::new().unwrap();
    let [input, map, whole] = ["a", "map", "whole"].map(|name| folder.path().join(name));
    numbered(&input, 1, 2..5);
    for number in 0..2 {
        let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\n";
        let empty = format!("{head}VIEWPOINT {number} 0 0.5 1 0 0 0\nDATA ascii\n");
        fs::write(input.join(format!("scan{number}.pcd")), empty).unwrap();
    }
    let [input, map] = [text(&input), text(&map)];
    output(&["build", input, "-o", map, "--count", "2"]);
    // Another input with the same beginning is not the same input.
    let other = folder.path().join("b");
    fs::create_dir(&other).unwrap();
    for number in 0..5 {
        let name = format!("scan{number}.pcd");
        fs::copy(Path::new(input).join(&name), other.join(&name)).unwrap();
    }
    let (code, stderr) = failure(&["build", text(&other), "-o", map, "--resume"]);
    assert!(code == 2 && stderr.contains("built from input a, not b"), "{stderr}");
    let resumed = json(&["build", input, "-o", map, "--resume", "--json"]);
    assert_eq!((&resumed["scans"], &resumed["resumed_after"]), (&3.into(), &2.into()));
    let again = json(&["build", input, "-o", map, "--resume", "--json"]);
    assert_eq!((&again["scans"], &again["resumed_after"]), (&0.into(), &5.into()));
    output(&["build", input, "-o", text(&whole)]);
    assert_eq!(digest(map), digest(text(&whole)));

    // One of the empty scans has an invalid pose and is skipped. A later build that adds no scan does not change where
    // the input resumes.
    let first = Path::new(input).join("scan0.pcd");
    let far = fs::read_to_string(&first).unwrap().replacen("VIEWPOINT 0 ", "VIEWPOINT 1e12 ", 1);
    fs::write(&first, far).unwrap();
    let skipping = folder.path().join("skipping");
    let build = ["build", input, "-o", text(&skipping), "--skip-bad", "--json"];
    json(&[&build[..], &["--count", "2"]].concat());
    json(&[&build[..], &["--append", "--again", "--first", "99"]].concat());
    let resumed = json(&[&build[..], &["--resume"]].concat());
    assert_eq!((&resumed["scans"], &resumed["resumed_after"]), (&3.into(), &1.into()));
    assert_eq!(digest(text(&skipping)), digest(map));
}
