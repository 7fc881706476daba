use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

pub fn voxtile(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("voxtile").unwrap();
    command.args(arguments);
    command
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Runs a command that must succeed and returns its standard output.
pub fn output(arguments: &[&str]) -> String {
    String::from_utf8(voxtile(arguments).assert().success().get_output().stdout.clone()).unwrap()
}

pub fn json(arguments: &[&str]) -> Value {
    let object: Value = serde_json::from_str(&output(arguments)).unwrap();
    assert_eq!(object["version"], 1, "{arguments:?}: {object}");
    object
}

/// Runs a command that must fail and returns its exit code and standard error.
pub fn failure(arguments: &[&str]) -> (i32, String) {
    let assert = voxtile(arguments).assert().failure();
    let run = assert.get_output();
    (run.status.code().unwrap(), String::from_utf8(run.stderr.clone()).unwrap())
}

/// Writes a folder of three small ascii scans of a wall; the sensor advances by a metre per scan.
pub fn scans(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("scans");
    fs::create_dir(&path).unwrap();
    for number in 0..3 {
        let mut file = "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 42\nHEIGHT \
                        1\nPOINTS 42\nDATA ascii\n"
            .to_owned();
        for point in 0..40 {
            file += &format!("4.05 {} 0.55 {}\n", -2.0 + 0.1 * f64::from(point), 40 + point);
        }
        file += "nan 0 0 50\n0 0 0 50\n";
        fs::write(path.join(format!("{number:03}.pcd")), file).unwrap();
    }
    fs::write(path.join("poses_kitti.txt"), "1 0 0 0.05 0 1 0 0.05 0 0 1 0.05\n".repeat(3)).unwrap();
    path
}

fn built(folder: &TempDir) -> (PathBuf, PathBuf) {
    let (scans, map) = (scans(folder), folder.path().join("map"));
    output(&["build", text(&scans), "-o", text(&map)]);
    (scans, map)
}

#[test]
fn a_map_is_built_queried_exported_and_extended() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("deep/down/map"));
    let map = text(&map);
    let summary = json(&["build", text(&scans), "-o", map, "--json"]);
    assert_eq!((summary["scans"].as_u64(), summary["points"].as_u64()), (Some(3), Some(126)));
    assert_eq!(
        (summary["skipped"]["not_finite"].as_u64(), summary["skipped"]["no_return"].as_u64()),
        (Some(3), Some(3))
    );
    let info = json(&["info", map, "--json"]);
    assert_eq!((info["scan_number"].as_u64(), info["verified"].as_bool()), (Some(3), Some(true)));
    assert_eq!(info["occupied"], summary["occupied"]);

    let occupied = json(&["query", map, "4.1", "-0.5", "0.6", "--json"]);
    assert_eq!(
        (occupied["state"].as_str(), occupied["observation_count"].as_i64()),
        (Some("occupied"), Some(3))
    );
    assert!(output(&["query", map, "2", "-0.1", "0.3"]).contains("free  probability 0.2286"));
    assert!(output(&["query", map, "-7", "-1e3", "-0.3"]).contains("unknown"));
    let points = folder.path().join("points.csv");
    fs::write(&points, "x,y,z\n4.1,-0.5,0.6\n2 -0.1 0.3\n").unwrap();
    let answers = output(&["query", map, "--points", text(&points)]);
    assert_eq!(
        answers.lines().map(|line| line.split("  ").nth(1).unwrap()).collect::<Vec<_>>(),
        ["occupied", "free"]
    );

    let hit = json(&[
        "raycast",
        map,
        "--origin",
        "0.05",
        "0.05",
        "0.6",
        "--direction",
        "1",
        "-0.01",
        "0",
        "--json",
    ]);
    assert!((hit["hit"]["distance_m"].as_f64().unwrap() - 4.0).abs() < 0.11, "{hit}");
    assert!(
        output(&["raycast", map, "--origin", "0", "0", "0.6", "--direction", "-1", "0", "0"])
            .contains("no hit")
    );

    for (name, bytes) in [("a.ply", 0), ("a.pcd", 0), ("a.csv", 0), ("a.bt", 0), ("a.ot", 0)] {
        let file = folder.path().join(name);
        output(&["export", map, "-o", text(&file)]);
        assert!(fs::metadata(&file).unwrap().len() > bytes);
    }
    let lines = fs::read_to_string(folder.path().join("a.csv")).unwrap().lines().count() as u64;
    assert_eq!(lines, 1 + info["occupied"].as_u64().unwrap());
    let exported = voxtile_formats::read_pcd(&fs::read(folder.path().join("a.pcd")).unwrap()).unwrap();
    assert_eq!(exported.points_in_sensor.len() as u64 + 1, lines);
    let all = folder.path().join("all.csv");
    let count = json(&["export", map, "-o", text(&all), "--min-probability", "0", "--json"]);
    assert_eq!(count["voxels"], info["voxels"]);
    let part = ["export", map, "-o", text(&all), "--region", "-1", "-1", "-1", "2", "2", "2", "--json"];
    assert_eq!(json(&part)["voxels"].as_u64(), Some(0));

    let digest = output(&["digest", map]);
    output(&["build", text(&scans), "-o", map, "--append", "--again"]);
    assert_ne!(output(&["digest", map]), digest);
    assert_eq!(json(&["info", map, "--json"])["scan_number"].as_u64(), Some(6));
}

#[test]
fn the_example_prints_the_output_in_the_readme() {
    let example = testkit::support::repository("map_tiles_example");
    let example = example.to_str().unwrap();
    let answer = output(&["raycast", example, "--origin", "8", "-2", "1.8", "--direction", "1", "1", "0"]);
    let readme = include_str!("../../../../README.md");
    assert!(readme.contains(answer.trim()), "{answer}");
}

#[test]
fn the_digest_does_not_depend_on_the_cache() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let digests: Vec<String> = ["1", "3", "1000"]
        .iter()
        .map(|tiles| {
            let map = folder.path().join(tiles);
            let build =
                ["build", text(&scans), "-o", text(&map), "--cache-tiles", tiles, "--tile-size", "0.5"];
            output(&build);
            output(&["digest", text(&map)])
        })
        .collect();
    assert!(digests.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn the_digest_does_not_depend_on_the_octree_and_its_cache() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let choices: [(&[&str], _); 7] = [
        (&[], None),
        (&["--octree", "bricks", "--voxel-cache", "off"], None),
        (&["--octree", "pointers"], Some("none")),
        (&["--octree", "pointers", "--voxel-cache", "off"], Some("none")),
        (&["--voxel-cache", "serial"], Some("serial")),
        (&["--voxel-cache", "serial", "--tau", "1", "--buckets", "1"], Some("serial")),
        (
            &["--octree", "pointers", "--voxel-cache", "parallel", "--tau", "1", "--buckets", "2"],
            Some("parallel"),
        ),
    ];
    let mut digests = Vec::new();
    for (number, (choice, cache)) in choices.into_iter().enumerate() {
        let map = folder.path().join(number.to_string());
        let build =
            ["build", text(&scans), "-o", text(&map), "--insert", "per-ray", "--cache-tiles", "2", "--json"];
        let summary = json(&[&build, choice].concat());
        let of = |name: &str| summary.pointer(&format!("/octrees/{name}")).and_then(Value::as_u64);
        assert_eq!(summary.get("octrees").is_some(), cache.is_some(), "{choice:?}");
        assert_eq!(of("voxels_written").is_some_and(|voxels| voxels > 0), cache.is_some(), "{summary}");
        let has_cache = matches!(cache, Some("serial" | "parallel"));
        assert_eq!(of("voxel_cache/hits").is_some_and(|hits| hits > 0), has_cache, "{summary}");
        assert_eq!(summary.pointer("/octrees/hit_rate").is_some(), has_cache, "{summary}");
        assert_eq!(
            of("queue/voxels_in").is_some_and(|voxels| voxels > 0),
            cache == Some("parallel"),
            "{summary}"
        );
        digests.push(output(&["digest", text(&map)]));
    }
    assert!(digests.windows(2).all(|pair| pair[0] == pair[1]));

    let map = folder.path().join("reported");
    let reported = output(&["build", text(&scans), "-o", text(&map), "--voxel-cache", "parallel"]);
    for line in ["cache     ", "hit rate", "octrees   ", "queue     ", "stages    "] {
        assert!(reported.contains(line), "{reported}");
    }
    let reported =
        output(&["build", text(&scans), "-o", text(&map), "--append", "--again", "--voxel-cache", "serial"]);
    assert!(reported.contains("hit rate") && !reported.contains("queue"), "{reported}");
    let out = folder.path().join("demo");
    let demo = ["demo", "--out", text(&out), "--length", "4", "--voxel-cache", "parallel", "--json"];
    assert!(json(&demo).pointer("/octrees/voxel_cache/misses").and_then(Value::as_u64) > Some(0));
}

/// Cases of arguments, exit code and a part of the message.
#[test]
fn bad_inputs_print_one_line_with_a_remedy() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = built(&folder);
    let (scans, map) = (text(&scans), text(&map));
    let new = folder.path().join("new");
    let new = text(&new);
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let empty_folder = folder.path().join("empty");
    fs::create_dir(&empty_folder).unwrap();
    let few = file("few.txt", b"0 0 0 0 0 0 0 1\n");
    let many = file("many.txt", "0 0 0 0 0 0 0 1\n".repeat(4).as_bytes());
    let wrong_header = file(
        "wrong.pcd",
        b"VERSION .7\nFIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n0 0\n",
    );
    let truncated =
        file("cut.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 9\nHEIGHT 1\nDATA binary\nabc");
    let plain =
        file("plain.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n");
    let points = file("points.txt", b"1 2 3\n4 five 6\n");
    let other = file("scans.pcap", b"\xd4\xc3\xb2\xa1 and more of a capture");
    let cases: Vec<(Vec<&str>, i32, &str)> = vec![
        (vec!["build", scans, "-o", map], 2, "use --resume to continue with these scans"),
        (vec!["build", "nowhere", "-o", new], 2, "nowhere: there is no such file or folder"),
        (vec!["build", text(&empty_folder), "-o", new], 2, "no file of a known format"),
        (vec!["build", &other, "-o", new], 2, "pcap"),
        (vec!["build", scans, "-o", new, "--poses", &few], 2, "1 poses for 3 clouds"),
        (vec!["build", scans, "-o", new, "--poses", &many], 2, "4 poses for 3 clouds"),
        (vec!["build", &wrong_header, "-o", new], 1, "line 7: the points have no field z"),
        (vec!["build", &truncated, "-o", new], 1, "the file ends after 0 of 9 points"),
        (vec!["build", &plain, "-o", new, "--sensor-model", "iwlo"], 2, "needs an intensity per point"),
        (vec!["build", scans, "-o", new, "--intensity-max", "9"], 2, "add --sensor-model iwlo"),
        (
            vec![
                "build",
                scans,
                "-o",
                new,
                "--sensor-model",
                "iwlo",
                "--probabilities",
                "0.7",
                "0.4",
                "0.1",
                "0.9",
            ],
            2,
            "only the sensor model log-odds has these",
        ),
        (vec!["build", scans, "-o", new, "--probabilities", "0.3", "0.4", "0.1", "0.9"], 2, "hit"),
        (
            vec!["build", scans, "-o", map, "--append", "--occupancy-threshold", "0.6"],
            2,
            "the map has 0.5: omit this option",
        ),
        (
            vec!["build", scans, "-o", new, "--sensor-model", "iwlo", "--intensity-max", "35"],
            2,
            "the largest intensity must be above the intensity threshold",
        ),
        (
            vec!["build", scans, "-o", new, "--resolution", "0.3", "--tile-size", "10"],
            2,
            "add --tile-size 9.9 or --tile-size 10.2",
        ),
        (
            vec!["build", scans, "-o", new, "--resolution", "7", "--tile-size", "10"],
            2,
            "add --tile-size 14, or choose another",
        ),
        (
            vec!["build", scans, "-o", map, "--append", "--resolution", "0.15"],
            2,
            "resolution 0.1 m, not 0.15 m",
        ),
        (vec!["build", scans, "-o", &plain], 2, "is a file, but a map is a folder"),
        (
            vec!["build", scans, "-o", map, "--append"],
            2,
            "the map already has 3 scans of an input with the same beginning",
        ),
        (vec!["build", scans, "-o", map, "--again"], 2, "--append"),
        (vec!["build", scans, "-o", new, "--resolution", "-1"], 2, "resolution"),
        (
            vec!["build", scans, "-o", new, "--max-range", "0"],
            2,
            "max range: must be a length above the min range, in metres, not 0",
        ),
        (vec!["build", scans, "-o", new, "--cache-tiles", "0"], 2, "cache tiles: must be at least 1, not 0"),
        (vec!["build", scans, "-o", new, "--memory", "0"], 2, "0 bytes are too few for tiles of 10 m"),
        (vec!["build", scans, "-o", new, "--memory", "1 mile"], 2, "--memory"),
        (vec!["build", scans, "-o", new, "--memory", "64MiB", "--cache-tiles", "3"], 2, "--cache-tiles"),
        (
            vec!["build", scans, "-o", new, "--memory", "20MiB"],
            2,
            "20971520 bytes are too few for tiles of 10 m at 0.1 m: allow at least 42182144 (41 MiB), \
             or use tiles of at most 5.4 m",
        ),
        (vec!["build", scans, "-o", new, "--octree", "trees"], 2, "--octree"),
        (vec!["build", scans, "-o", new, "--voxel-cache", "maybe"], 2, "--voxel-cache"),
        (vec!["build", scans, "-o", new, "--voxel-cache", "serial", "--tau", "x"], 2, "--tau"),
        (vec!["build", scans, "-o", new, "--voxel-cache", "serial", "--tau", "-1"], 2, "--tau"),
        (
            vec!["build", scans, "-o", new, "--voxel-cache", "serial", "--tau", "0"],
            2,
            "tau: must be 1 to 65536 voxels per bucket, not 0",
        ),
        (
            vec!["build", scans, "-o", new, "--voxel-cache", "parallel", "--buckets", "48"],
            2,
            "buckets: must be a power of two up to 2^24, not 48",
        ),
        (
            vec!["build", scans, "-o", new, "--voxel-cache", "serial", "--buckets", "33554432"],
            2,
            "buckets: must be a power of two up to 2^24, not 33554432",
        ),
        (vec!["build", scans, "-o", new, "--tau", "4"], 2, "--tau, --buckets: need a voxel cache"),
        (
            vec!["build", scans, "-o", new, "--octree", "pointers", "--voxel-cache", "off", "--buckets", "4"],
            2,
            "add --voxel-cache serial or --voxel-cache parallel",
        ),
        (
            vec!["build", scans, "-o", new, "--octree", "bricks", "--voxel-cache", "serial"],
            2,
            "--voxel-cache: bricks have no voxel cache",
        ),
        (vec!["demo", "--out", new, "--tau", "4"], 2, "--tau, --buckets: need a voxel cache"),
        (
            vec!["build", scans, "-o", map, "--append", "--resolution", "0.2"],
            2,
            "resolution 0.1 m, not 0.2 m",
        ),
        (vec!["build", scans, "-o", new, "--append"], 1, "no map here"),
        (vec!["build", scans, "-o", scans], 2, "there is a map or other content already"),
        (vec!["info", text(&empty_folder)], 1, "no map here (metadata.json is missing)"),
        (vec!["query", map, "1", "2"], 2, "3 values required"),
        (vec!["query", map, "1", "2", "nan"], 2, "is not finite"),
        (vec!["query", map, "--points", &points], 1, "line 2: `4 five 6` is not a point"),
        (
            vec!["raycast", map, "--origin", "0", "0", "0", "--direction", "0", "0", "0"],
            2,
            "has no usable length",
        ),
        (vec!["export", map, "-o", "a.abc"], 2, "its extension is unknown"),
        (vec!["export", map, "-o", "a.ply", "--region", "1", "1", "1", "0", "2", "2"], 2, "needs X0 < X1"),
        (vec!["export", map, "-o", "no/such/a.ply"], 1, "no/such/a.ply: cannot create"),
    ];
    for (arguments, code, message) in cases {
        let (found, stderr) = failure(&arguments);
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
        assert_eq!(found, code, "{arguments:?}: {stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
        if stderr.starts_with("voxtile: ") {
            assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        }
        assert!(!Path::new(new).exists(), "{arguments:?} left a map behind");
    }
}

#[test]
fn a_stray_far_point_is_cut_or_skipped_and_reported() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("stray.pcd");
    let header = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n";
    fs::write(&path, format!("{header}1 2 3\n1e8 0 0\n")).unwrap();
    let map = folder.path().join("map");
    let summary = json(&["build", text(&path), "-o", text(&map), "--json"]);
    assert_eq!(summary["cut_at_max_range"].as_u64(), Some(1));
    let far = folder.path().join("far");
    let summary = json(&["build", text(&path), "-o", text(&far), "--max-range", "1e9", "--json"]);
    assert_eq!(summary["skipped"]["ray_too_long"].as_u64(), Some(1));
}

#[test]
fn a_second_writer_and_damage_are_reported_with_the_path() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = built(&folder);
    let config = voxtile::MapReader::config_of(&map).unwrap();
    let writer = voxtile::OutOfCoreTileMapper::open(&map, config).unwrap();
    let (code, stderr) = failure(&["build", text(&scans), "-o", text(&map), "--append"]);
    assert!(code == 1 && stderr.contains("another process is writing to this map"), "{stderr}");
    drop(writer);
    let table = map.join("tile_0_0_0/iwlo_meta.bin");
    let mut bytes = fs::read(&table).unwrap();
    bytes[40] ^= 1;
    fs::write(&table, bytes).unwrap();
    let (code, stderr) = failure(&["digest", text(&map)]);
    assert!(
        code == 1 && stderr.contains("tile_0_0_0") && stderr.contains("tile (0, 0, 0) is damaged"),
        "{stderr}"
    );
    let metadata = map.join("metadata.json");
    let changed = fs::read_to_string(&metadata).unwrap().replace("\"scan_number\": 3", "\"scan_number\": 4");
    fs::write(&metadata, changed).unwrap();
    let (_, stderr) = failure(&["info", text(&map)]);
    assert!(stderr.contains("metadata.json") && stderr.contains("checksum"), "{stderr}");
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_is_reported() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    // Root can write to any directory, so use /proc.
    let target =
        if fs::write(closed.join("probe"), "").is_ok() { "/proc/map".into() } else { closed.join("map") };
    let (code, stderr) = failure(&["build", text(&scans), "-o", text(&target)]);
    assert!(code == 1 && stderr.contains("cannot create"), "{stderr}");
}

#[test]
fn a_merged_octree_beyond_octomaps_keys_names_the_region() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("far.pcd");
    let header = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 500000 4000000 10 1 0 0 0\nDATA ascii\n";
    fs::write(&path, format!("{header}1 2 3\n")).unwrap();
    let map = folder.path().join("map");
    output(&["build", text(&path), "-o", text(&map)]);
    let file = folder.path().join("a.bt");
    let (code, stderr) = failure(&["export", text(&map), "-o", text(&file)]);
    assert!(code == 2 && stderr.contains("--region"), "{stderr}");
    assert!(!file.exists() && !folder.path().join("a.bt.part").exists());
    assert!(output(&["query", text(&map), "500001.05", "4000002.05", "13.05"]).contains("occupied"));
}

#[test]
fn octomap_files_are_described_and_exported_and_a_bomb_is_refused() {
    let folder = TempDir::new().unwrap();
    let (_, map) = built(&folder);
    let [bt, ot, csv] = ["a.bt", "a.ot", "a.csv"].map(|name| folder.path().join(name));
    output(&["export", text(&map), "-o", text(&bt)]);
    let (of_file, of_map) = (json(&["info", text(&bt), "--json"]), json(&["info", text(&map), "--json"]));
    assert_eq!(of_file["occupied_voxels"], of_map["occupied"]);
    let exported = json(&["export", text(&bt), "-o", text(&csv), "--json"]);
    assert_eq!(exported["voxels"], of_map["occupied"]);
    output(&["export", text(&bt), "-o", text(&ot)]);
    assert_eq!(json(&["info", text(&ot), "--json"])["nodes"], of_file["nodes"]);

    let bomb = folder.path().join("bomb.bt");
    let header = "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.1\ndata\n";
    fs::write(&bomb, [header.as_bytes(), &[0xaa, 0xaa]].concat()).unwrap();
    let (code, stderr) = failure(&["export", text(&bomb), "-o", text(&csv)]);
    assert!(code == 1 && stderr.contains("281474976710656, more than the limit of 268435456"), "{stderr}");
    fs::write(&bomb, header).unwrap();
    let (code, stderr) = failure(&["info", text(&bomb)]);
    assert!(code == 1 && stderr.contains("bomb.bt: malformed: offset"), "{stderr}");

    let pointer = folder.path().join("pointer.bt");
    fs::write(&pointer, "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n").unwrap();
    let (_, stderr) = failure(&["info", text(&pointer)]);
    assert!(stderr.contains("pointer.bt: is a Git LFS pointer, not the file itself"), "{stderr}");
}

#[test]
fn a_map_of_any_resolution_has_tiles_of_nearly_10_m() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let expected = [("0.15", 10.05), ("0.3", 9.9), ("7", 14.0), ("25", 50.0), ("0.001", 0.256)];
    for (resolution, tile_m) in expected {
        let map = folder.path().join(resolution);
        // Rays of 4000 voxels are not needed to see the tiles.
        let build = ["build", text(&scans), "-o", text(&map), "--resolution", resolution, "--max-range", "1"];
        let built = json(&[&build[..], &["--json", "--no-rays"]].concat());
        assert_eq!(built["resolution_m"].as_f64().unwrap().to_string(), resolution);
        assert_eq!(built["tile_size_m"], tile_m);
        let info = json(&["info", text(&map), "--json"]);
        assert_eq!(info["tile_size_m"], tile_m);
    }
    let digest = |name: &str, options: &[&str]| {
        let map = folder.path().join(name);
        output(&[&["build", text(&scans), "-o", text(&map)][..], options].concat());
        output(&["digest", text(&map)]).split(' ').next().unwrap().to_owned()
    };
    assert_eq!(digest("default", &[]), digest("given", &["--resolution", "0.1", "--tile-size", "10"]));
    let found = digest("found", &["--resolution", "0.15"]);
    assert_eq!(found, digest("same", &["--resolution", "0.15", "--tile-size", "10.05"]));
    // Scans can be added without `--resolution`, and with the map's own.
    let map = folder.path().join("found");
    for same in [&[][..], &["--resolution", "0.15"]] {
        let again = ["build", text(&scans), "-o", text(&map), "--append", "--again"];
        assert!(output(&[&again[..], same].concat()).contains("of 10.05 m"));
    }
}

#[test]
fn the_demo_makes_a_map_and_a_picture() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let summary = json(&["demo", "--out", text(&out), "--length", "8", "--cache-tiles", "4", "--json"]);
    assert!(summary["occupied"].as_u64().unwrap() > 500);
    assert!(fs::read(out.join("map.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(output(&["info", text(&out.join("map_tiles"))]).contains("scans        4 in 2 flushes"));
    let (code, stderr) = failure(&["demo", "--out", text(&out)]);
    assert!(code == 2 && stderr.contains("choose another --out"), "{stderr}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_flushes_and_reports_the_number_of_scans() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    // Enough copies for a build of some seconds.
    for number in 3..4000 {
        fs::hard_link(scans.join("000.pcd"), scans.join(format!("{number:04}.pcd"))).unwrap();
    }
    fs::remove_file(scans.join("poses_kitti.txt")).unwrap();
    let map = folder.path().join("map");
    let binary = assert_cmd::cargo::cargo_bin("voxtile");
    let child = std::process::Command::new(binary)
        .args(["build", text(&scans), "-o", text(&map), "--resolution", "0.02", "--poses", "identity"])
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while !map.join("metadata.json").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let run = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(130), "{stderr}");
    let words: Vec<&str> = stderr.trim().rsplit('\n').next().unwrap().split(' ').collect();
    let scans: u64 = words[3].parse().unwrap_or_else(|_| panic!("{stderr}"));
    assert!(scans < 4000);
    assert_eq!(json(&["info", text(&map), "--json"])["scan_number"].as_u64(), Some(scans));
}

#[cfg(unix)]
#[test]
fn share_runs_the_program_next_to_this_one_or_explains_its_installation() {
    let folder = tempfile::tempdir().unwrap();
    let voxtile = folder.path().join("voxtile");
    // Write the program in a separate process: a file that a forked child of another test still has open for writing
    // cannot be executed.
    let shell = |line: &str, path: &std::path::Path| {
        let program = env!("CARGO_BIN_EXE_voxtile");
        let status = std::process::Command::new("sh").args(["-c", line, program]).arg(path).status();
        assert!(status.unwrap().success(), "{line}");
    };
    shell(r#"cp "$0" "$1""#, &voxtile);
    let share = |args: &[&str]| {
        let mut command = std::process::Command::new(&voxtile);
        command.arg("share").args(args).env("PATH", folder.path()).output().unwrap()
    };
    let run = || share(&["--subscribe", "-o", "map", "--help"]);
    for help in [&["--help"][..], &["-h"], &["--subscribe", "--help"], &[]] {
        let helped = share(help);
        let printed = String::from_utf8_lossy(&helped.stdout).into_owned();
        assert!(helped.status.success() && helped.stderr.is_empty(), "{help:?}");
        for word in
            ["--publish", "--subscribe", "cargo install --locked --path crates/share-node", "was not found"]
        {
            assert!(printed.contains(word), "{help:?}: {printed}");
        }
    }
    let missing = share(&["--subscribe", "-o", "map"]);
    let printed = String::from_utf8_lossy(&missing.stderr).into_owned();
    assert!(!missing.status.success());
    assert!(printed.contains("cannot run voxtile-share") && printed.lines().count() == 1, "{printed}");

    let program = folder.path().join("voxtile-share");
    shell(r##"printf '#!/bin/sh\necho "$@"\nexit 7\n' >"$1" && chmod +x "$1""##, &program);
    let ran = run();
    assert_eq!(String::from_utf8_lossy(&ran.stdout), "--subscribe -o map --help\n");
    assert_eq!(ran.status.code(), Some(7));
}

#[test]
fn a_compact_map_is_built_converted_and_extended() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = built(&folder);
    let small = folder.path().join("small");
    output(&["build", text(&scans), "-o", text(&small), "--storage", "compact"]);
    let digest = output(&["digest", text(&map)]);
    assert_eq!(output(&["digest", text(&small)]), digest);
    assert!(output(&["verify", text(&small)]).contains("intact"));
    let info = json(&["info", text(&small), "--json"]);
    assert_eq!((info["storage"].as_str(), info["octree_bytes"].as_u64()), (Some("compact"), Some(0)));
    assert!(output(&["info", text(&small)]).contains("in compact tables"));
    assert_eq!(json(&["info", text(&map), "--json"])["storage"], "octomap");

    let (to_small, to_seed) = (folder.path().join("to_small"), folder.path().join("to_seed"));
    let printed = json(&["convert", text(&map), "-o", text(&to_small), "--storage", "compact", "--json"]);
    assert_eq!(printed["from"]["octree_bytes"], json(&["info", text(&map), "--json"])["octree_bytes"]);
    assert!(printed["to"]["table_bytes"].as_u64() < printed["from"]["table_bytes"].as_u64());
    let printed = output(&["convert", text(&small), "-o", text(&to_seed), "--storage", "octomap"]);
    assert!(printed.contains("with compact storage"), "{printed}");
    for map in [&to_small, &to_seed] {
        assert_eq!(output(&["digest", text(map)]), digest);
        // The map has all scans of this input already.
        assert_eq!(json(&["build", text(&scans), "-o", text(map), "--resume", "--json"])["resumed_after"], 3);
    }
    let (code, message) = failure(&["convert", text(&map), "-o", text(&small), "--storage", "compact"]);
    assert_eq!(code, 2);
    assert!(message.contains("small") && message.contains("does not exist yet"), "{message}");
    let again = ["build", text(&scans), "-o", text(&small), "--resume", "--storage"];
    let (code, message) = failure(&[&again[..], &["octomap"]].concat());
    assert_eq!(code, 2);
    assert!(message.contains("stored as compact"), "{message}");
    output(&[&again[..], &["compact"]].concat());
}

/// Numbers in the notation of other programs are not parsed as options.
#[test]
fn negative_numbers_may_have_any_form() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = built(&folder);
    let (map, new) = (text(&map), |name: &str| text(&folder.path().join(name)).to_owned());
    let box_m = ["--region", "-1e+2", "-.5", "-inf", "1e2", "inf", "+inf"];
    let plain = output(&["query", map, "4.05", "-0.00001", "0.55"]);
    for number in ["-1e-05", "-.1e-4", "-.00001", "-1E-5"] {
        assert_eq!(output(&["query", map, "4.05", number, "0.55"]), plain, "{number}");
        output(&["raycast", map, "--origin", number, "0", "0.6", "--direction", "1", number, "0"]);
        output(&["picture", map, "-o", &new("a.png"), "--slice", number]);
    }
    output(&[&["crop", map, "-o", &new("cropped")], &box_m[..]].concat());
    output(&[&["export", map, "-o", &new("a.csv")], &box_m[..]].concat());
    output(&[&["clear", &new("cropped")], &box_m[..]].concat());
    let extrinsic = ["--extrinsic", "0", "0", "0", "0", "0", "-1e-17", "1"];
    output(&[&["build", text(&scans), "-o", &new("turned")], &extrinsic[..]].concat());
    assert_eq!(output(&["digest", &new("turned")]), output(&["digest", map]));
    // After `--` an argument is a name, and text that is no number is unchanged.
    let (code, stderr) = failure(&["info", "--", "-1e5"]);
    assert!(code == 1 && stderr.contains("-1e5: no map"), "{stderr}");
    voxtile(&["query", map, "-x", "0", "0"]).assert().code(2);
}

#[test]
fn files_are_recognised_by_content() {
    let folder = TempDir::new().unwrap();
    let (_, map) = built(&folder);
    let [ot, renamed, ply] = ["a.ot", "map.octomap", "a.ply"].map(|name| folder.path().join(name));
    output(&["export", text(&map), "-o", text(&ot)]);
    output(&["export", text(&map), "-o", text(&ply)]);
    fs::copy(&ot, &renamed).unwrap();
    assert_eq!(output(&["digest", text(&renamed)]), output(&["digest", text(&ot)]));
    assert_eq!(output(&["info", text(&renamed)]), output(&["info", text(&ot)]));
    for command in ["info", "digest"] {
        let (code, stderr) = failure(&[command, text(&ply)]);
        assert!(code == 2 && stderr.contains("is a file, but not an OctoMap file"), "{stderr}");
    }
}

/// OctoMap's files have single precision, but a voxel of exactly one hit still has the probability of a hit.
#[test]
fn every_format_has_the_same_voxels_above_a_probability() {
    let folder = TempDir::new().unwrap();
    let (scans, _) = built(&folder);
    let map = folder.path().join("one_scan");
    output(&["build", text(&scans), "-o", text(&map), "--count", "1"]);
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let (ot, imported) = (path("a.ot"), path("imported"));
    output(&["export", text(&map), "-o", &ot]);
    output(&["import", &ot, "-o", &imported]);
    for probability in ["0.7", "0.4", "0.1192", "0.971"] {
        let count = |from: &str, to: &str| {
            let to = path(to);
            json(&["export", from, "-o", &to, "--min-probability", probability, "--json"])["voxels"].clone()
        };
        let expected = count(text(&map), "map.csv");
        assert!(expected.as_u64() > Some(0) || probability == "0.971", "{probability}: {expected}");
        for from in [&ot, &imported] {
            for to in ["a.csv", "a.xyz", "a.npz"] {
                assert_eq!(count(from, to), expected, "{probability}, {from}, {to}");
            }
        }
    }
}

/// Builds a map of a wall that keeps its scans, with guarded clearing; something passes the wall in the third of six
/// scans. Returns the map and the number of points on what passes.
pub fn map_with_a_passer_by(folder: &Path) -> (PathBuf, u64) {
    let passing = wall_with_a_passer_by(folder);
    let (scans, poses, map) = (folder.join("scans"), folder.join("poses.txt"), folder.join("passed"));
    let options = ["--keep-scans", "--resolution", "0.2", "--clearing", "guarded"];
    output(&[&["build", text(&scans), "--poses", text(&poses), "-o", text(&map)][..], &options].concat());
    (map, passing)
}

/// Writes six scans of a wall; in the third, something is before the wall. Returns the number of its points.
fn wall_with_a_passer_by(folder: &Path) -> u64 {
    fs::create_dir_all(folder.join("scans")).unwrap();
    let mut passing = 0;
    for scan in 0..6 {
        let mut points = String::new();
        for (row, column) in (-40..=40).flat_map(|row| (-40..=40).map(move |column| (row, column))) {
            let (y, z) = (f64::from(column) * 0.05, f64::from(row) * 0.05);
            let is_passing = scan == 2 && y.abs() < 0.8 && z.abs() < 0.8;
            passing += u64::from(is_passing);
            let share = if is_passing { 0.5 } else { 1.0 };
            points += &format!("{} {} {}\n", 5.05 * share, y * share, z * share);
        }
        fs::write(folder.join(format!("scans/{scan}.xyz")), points).unwrap();
    }
    fs::write(folder.join("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(6)).unwrap();
    passing
}
