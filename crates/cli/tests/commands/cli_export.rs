use crate::cli::{failure, json, output, scans, text, voxtile};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use voxtile::space::Grid;
use voxtile_formats::read_pcd;

/// Builds a map of three scans of a wall.
fn near_map(folder: &TempDir) -> PathBuf {
    let map = folder.path().join("map");
    output(&["build", text(&scans(folder)), "-o", text(&map)]);
    map
}

/// Builds a map of twenty points around a position.
fn far_map(folder: &TempDir, place: &str) -> PathBuf {
    let (cloud, map) = (folder.path().join("far.pcd"), folder.path().join("far"));
    let mut content = format!(
        "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 20\nHEIGHT 1\nVIEWPOINT {place} 1 0 0 0\nDATA ascii\n"
    );
    for k in 0..20 {
        content += &format!("{} {} 3\n", 0.37 * f64::from(k), 20.0 - 1.21 * f64::from(k));
    }
    fs::write(&cloud, content).unwrap();
    output(&["build", text(&cloud), "-o", text(&map)]);
    map
}

/// Returns the names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn origin_file_of(file: &Path) -> Option<Value> {
    let origin_file = file.with_added_extension("origin.json");
    fs::read(origin_file).ok().map(|text| serde_json::from_slice(&text).unwrap())
}

/// Returns the voxel centers of a CSV file in metres, relative to the file's origin.
fn centers(file: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(file).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let numbers: Vec<f64> = line.split(',').take(3).map(|word| word.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    });
    rows.collect()
}

#[test]
fn concurrent_exports_to_one_name_leave_one_complete_file() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    for extension in ["ply", "bt", "csv"] {
        let file = out.join("a").with_extension(extension);
        // The files differ in length, so that a mixture equals none of them.
        let regions: Vec<Vec<String>> = (1..=6)
            .map(|k| ["-9", "-9", "-9", &k.to_string(), "9", "9"].map(String::from).to_vec())
            .collect();
        let arguments = |region: &[String]| {
            let region = region.iter().map(String::as_str);
            ["export", text(&map), "-o", text(&file), "--region"]
                .into_iter()
                .chain(region)
                .map(String::from)
                .collect::<Vec<_>>()
        };
        let whole: Vec<Vec<u8>> = regions
            .iter()
            .map(|region| {
                voxtile(&arguments(region).iter().map(String::as_str).collect::<Vec<_>>()).assert().success();
                fs::read(&file).unwrap()
            })
            .collect();
        for _ in 0..4 {
            let runs: Vec<_> = regions
                .iter()
                .map(|region| {
                    std::process::Command::new(env!("CARGO_BIN_EXE_voxtile"))
                        .args(arguments(region))
                        .stdout(std::process::Stdio::null())
                        .spawn()
                        .unwrap()
                })
                .collect();
            for mut run in runs {
                assert!(run.wait().unwrap().success());
            }
            assert!(whole.contains(&fs::read(&file).unwrap()), "{extension}: a mixture");
        }
    }
    assert_eq!(names(&out), ["a.bt", "a.csv", "a.ply"]);
}

#[test]
fn leftovers_of_a_killed_export_do_not_block_the_next() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let file = out.join("a.bt");
    for milliseconds in 0..12 {
        let mut run = std::process::Command::new(env!("CARGO_BIN_EXE_voxtile"))
            .args(["export", text(&map), "-o", text(&file)])
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
        run.kill().unwrap();
        run.wait().unwrap();
    }
    output(&["export", text(&map), "-o", text(&file)]);
    let whole = fs::read(&file).unwrap();
    output(&["export", text(&map), "-o", text(&file)]);
    assert_eq!(fs::read(&file).unwrap(), whole);
    assert!(names(&out).iter().all(|name| name == "a.bt" || name.ends_with(".part")), "{:?}", names(&out));
}

#[cfg(unix)]
#[test]
fn links_are_not_followed_and_non_files_are_reported() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let map = text(&map);
    let of = |name: &str| folder.path().join(name);
    fs::write(of("precious"), "precious").unwrap();
    // Possible temporary names of an export.
    for name in ["a.bt.part", "a.bt.spool", "a.ply.part", "a.bt.next", "a.bt.tmp"] {
        symlink(of("precious"), of(name)).unwrap();
    }
    for name in ["a.bt", "a.ply"] {
        output(&["export", map, "-o", text(&of(name))]);
    }
    symlink(of("precious"), of("link.ply")).unwrap();
    symlink(of("nowhere"), of("dangling.ply")).unwrap();
    for name in ["link.ply", "dangling.ply"] {
        let (code, stderr) = failure(&["export", map, "-o", text(&of(name))]);
        assert!(code == 2 && stderr.contains(name) && stderr.contains("symbolic link"), "{stderr}");
    }
    assert_eq!(fs::read_to_string(of("precious")).unwrap(), "precious");
    assert!(!of("nowhere").exists());
    let (code, stderr) = failure(&["export", map, "-o", "/dev/stdout", "--format", "ply"]);
    assert!(code == 2 && stderr.contains("- for standard output"), "{stderr}");
    fs::create_dir(of("folder.ply")).unwrap();
    let (code, stderr) = failure(&["export", map, "-o", text(&of("folder.ply"))]);
    assert!(code == 2 && stderr.contains("folder.ply is a folder"), "{stderr}");
    // The umask sets the permissions of a new file.
    let mode = |name| fs::metadata(of(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode("a.ply"), mode("precious"));
}

#[cfg(unix)]
#[test]
fn standard_output_pipes_and_devices_receive_the_complete_file() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let map = text(&map);
    for format in ["ply", "pcd", "csv", "bt", "ot"] {
        let file = folder.path().join("a").with_extension(format);
        let summary = json(&["export", map, "-o", text(&file), "--json"]);
        let run = voxtile(&["export", map, "-o", "-", "--format", format, "--json"]).assert().success();
        assert_eq!(run.get_output().stdout, fs::read(&file).unwrap(), "{format}");
        let reported: Value = serde_json::from_slice(&run.get_output().stderr).unwrap();
        assert_eq!(reported["voxels"], summary["voxels"]);
    }
    let (code, stderr) = failure(&["export", map, "-o", "-"]);
    assert!(code == 2 && stderr.contains("--format"), "{stderr}");
    output(&["export", map, "-o", "/dev/null", "--format", "ply"]);
    let (code, stderr) = failure(&["export", map, "-o", "/dev/full", "--format", "ply"]);
    assert!(code == 1 && stderr.contains("/dev/full: cannot write"), "{stderr}");
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    output(&["export", map, "-o", text(&pipe), "--format", "bt"]);
    assert_eq!(reader.join().unwrap(), fs::read(folder.path().join("a.bt")).unwrap());
    assert!(!folder.path().join("pipe.origin.json").exists());
}

#[test]
fn nothing_is_created_inside_a_map() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let before = names(&map);
    let tile = before.iter().find(|name| name.starts_with("tile_")).unwrap();
    let region = ["--region", "-1", "-1", "-1", "9", "9", "9"];
    let mut inside =
        vec![map.join("a"), map.join(tile).join("a"), map.join("new/folder/a"), map.join(tile).join("../a")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(map.join(tile), folder.path().join("link")).unwrap();
        inside.push(folder.path().join("link/a"));
    }
    for place in &inside {
        for extension in ["ply", "bt"] {
            let file = place.with_extension(extension);
            let (code, stderr) = failure(&["export", text(&map), "-o", text(&file)]);
            assert!(code == 2 && stderr.contains("is inside the map"), "{stderr}");
        }
        let crop = [&["crop", text(&map), "-o", text(place)][..], &region].concat();
        let picture = place.with_extension("png");
        for arguments in [
            crop,
            vec!["merge", text(&map), text(&map), "-o", text(place)],
            vec!["convert", text(&map), "-o", text(place), "--storage", "compact"],
            vec!["build", text(&folder.path().join("scans")), "-o", text(place)],
            vec!["demo", "--out", text(place), "--length", "4"],
            vec!["local", text(&folder.path().join("scans")), "-o", text(&picture)],
        ] {
            let (code, stderr) = failure(&arguments);
            assert!(code == 2 && stderr.contains("is inside the map"), "{arguments:?}: {stderr}");
        }
    }
    assert_eq!(names(&map), before);
    output(&["verify", text(&map)]);
    // A folder next to the map, with a path through one of its tiles.
    let next_to_map = map.join(tile).join("../../a.ply");
    output(&["export", text(&map), "-o", text(&next_to_map)]);
    assert!(folder.path().join("a.ply").exists());
}

#[test]
fn a_far_map_becomes_an_octree_file_with_an_origin() {
    let folder = TempDir::new().unwrap();
    let map = far_map(&folder, "500123.4 4182321.7 57.3");
    let (map, file) = (text(&map), folder.path().join("a.bt"));
    let (code, stderr) = failure(&["export", map, "-o", text(&file)]);
    assert!(code == 2 && stderr.contains("--origin 500000 4182000 0"), "{stderr}");
    assert_eq!(names(folder.path()), ["far", "far.pcd"]);
    // The remedy in the message works.
    let origin = ["--origin", "500000", "4182000", "0"];
    let printed = output(&[&["export", map, "-o", text(&file)], &origin[..]].concat());
    assert!(printed.contains("origin 500000 4182000 0 m"), "{printed}");
    let origin_file = origin_file_of(&file).unwrap();
    assert_eq!(origin_file["origin_m"], serde_json::json!([500000.0, 4182000.0, 0.0]));
    assert_eq!(origin_file["origin_voxel"], serde_json::json!([5_000_000, 41_820_000, 0]));
    let hash = blake3::hash(&fs::read(&file).unwrap()).to_hex();
    assert_eq!(origin_file["blake3"], hash.as_str());

    // The voxels of the file are those of the map, moved by whole voxels.
    let (there, here) = (folder.path().join("there.csv"), folder.path().join("here.csv"));
    output(&["export", map, "-o", text(&there)]);
    output(&["export", text(&file), "-o", text(&here)]);
    let grid = Grid::new(0.1, 10.0).unwrap();
    let mut moved: Vec<_> = centers(&there)
        .into_iter()
        .map(|center| {
            let [x, y, z] = grid.voxel_of(center).unwrap();
            [x - 5_000_000, y - 41_820_000, z]
        })
        .collect();
    moved.sort_unstable();
    let mut found: Vec<_> = centers(&here).into_iter().map(|center| grid.voxel_of(center).unwrap()).collect();
    found.sort_unstable();
    assert!(found.len() >= 20);
    assert_eq!(found, moved);

    // The requested origin is no voxel corner: the nearest corner is used and reported.
    let arguments = ["export", map, "-o", text(&file), "--origin", "500000.04", "4182000.06", "-0.01"];
    let printed = output(&arguments);
    assert!(
        printed.contains("origin 500000 4182000.1 0 m") && printed.contains("nearest to 500000.04"),
        "{printed}"
    );
    assert_eq!(origin_file_of(&file).unwrap()["origin_m"][1], 4182000.1);
    let summary = json(&[&arguments[..], &["--json"]].concat());
    assert_eq!(summary["origin_m"], serde_json::json!([500000.0, 4182000.1, 0.0]));
    assert!(summary["origin_file"].as_str().unwrap().ends_with("a.bt.origin.json"));

    for bad in ["nan", "inf", "1e300"] {
        let (code, stderr) = failure(&["export", map, "-o", text(&file), "--origin", "0", bad, "0"]);
        assert!(code == 2 && stderr.contains("--origin"), "{stderr}");
    }
    // A map wider than the range of OctoMap's keys needs more than an origin.
    let wide = folder.path().join("wide");
    let (again, cloud) = (folder.path().join("again"), folder.path().join("far.pcd"));
    let content = fs::read_to_string(&cloud).unwrap().replace("500123.4", "600123.4");
    fs::write(&cloud, content).unwrap();
    output(&["build", text(&cloud), "-o", text(&again)]);
    output(&["merge", map, text(&again), "-o", text(&wide)]);
    let (code, stderr) = failure(&["export", text(&wide), "-o", text(&file)]);
    assert!(
        code == 2 && stderr.contains("no --origin is sufficient") && stderr.contains("--region"),
        "{stderr}"
    );
}

#[test]
fn files_next_to_an_output_belong_to_it() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let (map, file) = (text(&map), folder.path().join("a.csv"));
    let origin = ["--origin", "1", "2", "3"];
    output(&[&["export", map, "-o", text(&file)], &origin[..]].concat());
    assert!(origin_file_of(&file).is_some());
    let moved = centers(&file);
    // Without an origin, an origin file of an earlier export must not remain.
    output(&["export", map, "-o", text(&file)]);
    assert!(origin_file_of(&file).is_none());
    for (moved, center) in moved.iter().zip(centers(&file)) {
        let back: [f64; 3] = std::array::from_fn(|k| moved[k] + [1.0, 2.0, 3.0][k] - center[k]);
        assert!(back.iter().all(|x| x.abs() < 1e-9), "{back:?}");
    }
    // A foreign file of that name is kept, and nothing is written.
    let foreign = folder.path().join("a.csv.origin.json");
    fs::write(&foreign, "{}").unwrap();
    let before = fs::read(&file).unwrap();
    for arguments in [vec![], origin.to_vec()] {
        let (code, stderr) = failure(&[&["export", map, "-o", text(&file)], &arguments[..]].concat());
        assert!(code == 2 && stderr.contains("a.csv.origin.json"), "{stderr}");
    }
    assert_eq!((fs::read(&foreign).unwrap(), fs::read(&file).unwrap()), (b"{}".to_vec(), before));
}

#[test]
fn float32_points_of_a_pcd_map_to_their_voxels_at_any_distance() {
    let grid = Grid::new(0.1, 10.0).unwrap();
    for (place, is_moved) in [
        ("0 0 0", false),
        ("500123.4 4182321.7 57.3", true),
        ("-2694044.2 -4266368.8 3888310.6", true),
        ("9e7 1 -9e7", true),
    ] {
        let folder = TempDir::new().unwrap();
        let map = far_map(&folder, place);
        let (cloud, table) = (folder.path().join("a.pcd"), folder.path().join("a.csv"));
        let summary = json(&["export", text(&map), "-o", text(&cloud), "--json"]);
        output(&["export", text(&map), "-o", text(&table)]);
        let bytes = fs::read(&cloud).unwrap();
        let header = String::from_utf8_lossy(&bytes[..400]).into_owned();
        assert!(header.contains("\nSIZE 4 4 4 4 4\nTYPE F F F F I\n"), "{header}");
        assert_eq!(header.contains("# origin "), is_moved, "{header}");
        assert_eq!(origin_file_of(&cloud).is_some(), is_moved);
        let read = read_pcd(&bytes).unwrap();
        let origin = read.world_from_sensor.position_m();
        assert_eq!(serde_json::json!(origin), summary["origin_m"]);
        // PCL also stores VIEWPOINT as float32.
        assert_eq!(origin.map(|x| f64::from(x as f32)), origin);
        let expected: Vec<_> = centers(&table).into_iter().map(|center| grid.voxel_of(center)).collect();
        let found: Vec<_> = read
            .points_in_sensor
            .iter()
            .map(|point| grid.voxel_of(std::array::from_fn(|k| point[k] + origin[k])))
            .collect();
        assert!(found.len() >= 20 && found.iter().all(Option::is_some));
        assert_eq!(found, expected, "{place}");
    }
    // Two positions too far apart for one origin.
    let folder = TempDir::new().unwrap();
    let (first, second) = (far_map(&folder, "0 0 0"), folder.path().join("second"));
    fs::rename(&first, &second).unwrap();
    let (first, wide) = (far_map(&folder, "3e6 0 0"), folder.path().join("wide"));
    output(&["merge", text(&first), text(&second), "-o", text(&wide)]);
    let file = folder.path().join("a.pcd");
    let (code, stderr) = failure(&["export", text(&wide), "-o", text(&file)]);
    assert!(code == 2 && stderr.contains(".ply") && stderr.contains("--region"), "{stderr}");
    assert!(!file.exists());
    let region = ["--region", "2999000", "-99", "-99", "3000100", "99", "99"];
    output(&[&["export", text(&wide), "-o", text(&file)], &region[..]].concat());
}

#[cfg(unix)]
#[test]
fn names_may_be_any_bytes() {
    use std::os::unix::ffi::OsStrExt;
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    for name in
        [&b"b\xff\xfe.ply"[..], b"two\nlines.csv", "kärtli 地図.pcd".as_bytes(), b"-dash.bt", b"..ply"]
    {
        let name = std::ffi::OsStr::from_bytes(name);
        for json in [&[][..], &["--json"]] {
            let mut run = voxtile(&["export", text(&map), "--format", "csv"]);
            run.args(json)
                .arg("-o")
                .arg(Path::new("./").join(name))
                .current_dir(folder.path())
                .assert()
                .success();
        }
        assert!(folder.path().join(name).is_file());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn failing_outputs_are_reported_without_a_panic() {
    use std::process::{Command, Stdio};
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let map = text(&map);
    let run = |arguments: &[&str], stdout: Stdio, stderr: Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_voxtile"));
        command.args(arguments).stdin(Stdio::null()).stdout(stdout).stderr(stderr);
        command.spawn().unwrap().wait_with_output().unwrap()
    };
    let full = || Stdio::from(fs::File::options().write(true).open("/dev/full").unwrap());
    let closed = || Stdio::from(std::io::pipe().unwrap().1);
    let ray = ["raycast", map, "--origin", "0", "0", "0.6", "--direction", "1e300", "1e290", "1e200"];
    for arguments in [
        &["info", map][..],
        &["info", map, "--json"],
        &["query", map, "1", "2", "3"],
        &ray,
        &["diff", map, map],
        &["digest", map],
        &["verify", map],
        &["snapshots", map],
        &["export", map, "-o", "-", "--format", "csv"],
    ] {
        let refused = run(arguments, full(), Stdio::piped());
        let stderr = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains("standard output: cannot write: No space left"), "{arguments:?}: {stderr}");
        // A closed pipe is no error.
        let unread = run(arguments, closed(), Stdio::piped());
        assert_eq!((unread.status.code(), unread.stderr.len()), (Some(0), 0), "{arguments:?}");
    }
    for stderr in [full(), closed()] {
        assert_eq!(run(&["info", "nowhere"], Stdio::null(), stderr).status.code(), Some(1));
    }
    assert!(output(&ray).contains("hit at"));
}

/// Every format writes exactly the selected voxels. Options that a format does not support are refused, not ignored.
#[test]
fn every_format_selects_the_same_voxels() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let map = testkit::support::repository("map_tiles_example");
    let map = map.to_str().unwrap();
    let run = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("voxtile").unwrap();
        command.args(["export", map]).args(arguments).output().unwrap()
    };
    let rows = |what: &str, format: &str| {
        let file = path(&format!("{what}.{format}"));
        let output = run(&["-o", &file, "--what", what, "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let voxels = summary["voxels"].as_u64().unwrap();
        let text = String::from_utf8_lossy(&std::fs::read(&file).unwrap()).into_owned();
        if format != "ply" {
            let is_row = |line: &&str| line.starts_with(|first: char| first == '-' || first.is_ascii_digit());
            assert_eq!(text.lines().filter(is_row).count() as u64, voxels, "{file}");
        } else {
            assert!(text.contains(&format!("element vertex {voxels}\n")), "{file}");
        }
        voxels
    };
    let counts =
        ["csv", "xyz", "ply"].map(|format| ["occupied", "free", "all"].map(|what| rows(what, format)));
    assert_eq!(counts, [counts[0]; 3]);
    let [occupied, free, all] = counts[0];
    assert!(occupied > 0 && free > 0 && occupied + free == all, "{counts:?}");
    for refused in [
        vec!["-o", "a.bt", "--what", "free"],
        vec!["-o", "a.ply", "--z-min", "1"],
        vec!["-o", "a.laz", "--z-max", "1"],
        vec!["-o", "a.csv", "--cell", "5"],
    ] {
        let output = run(&refused);
        let reported = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && reported.contains(refused[2]), "{refused:?}: {reported}");
    }
    // The autoware format supports --origin.
    let squares = path("squares");
    let output = run(&["-o", &squares, "--format", "autoware", "--origin", "10", "0", "0"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Every file in a tileset exists, and its mesh is inside the node's box after all transforms.
#[test]
fn a_3d_tiles_folder_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let points = folder.path().join("0.xyz");
    // A wall, and long rays through tiles without a hit.
    let rows: Vec<String> = (0..400)
        .map(|k| format!("{} {} 1.5", 12.3 + f64::from(k % 20) * 0.1, 0.1 * f64::from(k / 20)))
        .collect();
    std::fs::write(&points, rows.join("\n") + "\n-45 3 1\n500 1 1\n").unwrap();
    let (map, tiles) = (folder.path().join("map"), folder.path().join("tiles"));
    let scans = points.to_str().unwrap();
    output(&["build", scans, "-o", map.to_str().unwrap(), "--max-range", "60"]);
    let reported = output(&[
        "export",
        map.to_str().unwrap(),
        "-o",
        tiles.to_str().unwrap(),
        "--format",
        "3dtiles",
        "--json",
    ]);
    let reported: Value = serde_json::from_str(&reported).unwrap();
    let read = |path: &Path| -> Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
    let mut open = vec![(read(&tiles.join("tileset.json"))["root"].clone(), tiles.clone(), [0.0; 3])];
    let mut nodes = 0;
    while let Some((node, base, mut offset)) = open.pop() {
        for k in 0..3 {
            offset[k] += node["transform"][12 + k].as_f64().unwrap_or(0.0);
        }
        open.extend(
            node["children"]
                .as_array()
                .into_iter()
                .flatten()
                .map(|child| (child.clone(), base.clone(), offset)),
        );
        let Some(uri) = node["content"]["uri"].as_str() else { continue };
        let path = base.join(uri);
        if uri.ends_with(".json") {
            open.push((read(&path)["root"].clone(), path.parent().unwrap().to_owned(), offset));
            continue;
        }
        let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let mesh: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let number = |value: &Value| value.as_f64().unwrap();
        let (at, scale) = (&mesh["nodes"][0]["translation"], number(&mesh["nodes"][0]["scale"][0]));
        let bound = |end: &str, k: usize| number(&at[k]) + scale * number(&mesh["accessors"][0][end][k]);
        // glTF has y up: z of the map is -y.
        let low = [bound("min", 0), -bound("max", 2), bound("min", 1)];
        let high = [bound("max", 0), -bound("min", 2), bound("max", 1)];
        let around = &node["boundingVolume"]["box"];
        for k in 0..3 {
            let (middle, half) = (number(&around[k]), number(&around[3 + 4 * k]));
            assert!(middle - half <= low[k] + 1e-9 && high[k] <= middle + half + 1e-9, "{}", path.display());
            // In the map's frame: the wall, and the hits of the long rays.
            assert!((-61.0..61.0).contains(&(offset[k] + low[k])), "{}", path.display());
        }
        nodes += 1;
    }
    assert_eq!(reported["nodes"], nodes);
    assert!(reported["voxels"].as_u64().unwrap() > 300);
}

/// The probability of these voxels is exactly 0.5, the default threshold of occupied voxels.
#[test]
fn decayed_free_voxels_stay_free_in_files_from_above() {
    let folder = TempDir::new().unwrap();
    let map = near_map(&folder);
    let files = |when: &str| {
        ["pgm", "png", "glb", "tif"].map(|extension| {
            // The name is the same before and after, because a file next to the picture contains it.
            let out = folder.path().join(when);
            fs::create_dir_all(&out).unwrap();
            let out = out.join(format!("map.{extension}"));
            output(&["export", text(&map), "-o", text(&out), "--what", "all"]);
            fs::read(out).unwrap()
        })
    };
    let before = files("before");
    let picture = &before[0];
    assert!(picture.contains(&254) && picture.contains(&0), "free and occupied columns");
    output(&["decay", text(&map), "--halflife", "0.001"]);
    let faded = files("faded");
    for (number, name) in ["pgm", "png", "glb", "tif"].into_iter().enumerate() {
        assert!(faded[number] == before[number], "{name}");
    }
}
