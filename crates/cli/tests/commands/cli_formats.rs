//! Tests of reading and writing files of other programs with the command.

use crate::cli::json;
use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use testkit::memory_folder::lone_folder;
use voxtile_formats::write::{Origin, OutputFormat, OutputFormats, OutputOption};

fn voxtile(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("voxtile").unwrap();
    command.args(arguments);
    command
}

fn output(arguments: &[&str]) -> String {
    let output = voxtile(arguments).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

fn refusal(arguments: &[&str]) -> String {
    let output = voxtile(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn repository(path: &str) -> String {
    testkit::support::repository(path).to_str().unwrap().to_owned()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Writes three scans of a wall as float32 to folders of three formats with the same poses.
fn make_inputs(folder: &Path) -> Vec<PathBuf> {
    let clouds: Vec<Vec<[f32; 3]>> = (0..3)
        .map(|scan| (0..60).map(|k| [4.0 + 0.01 * scan as f32, 0.1 * k as f32 - 3.0, 0.3]).collect())
        .collect();
    let poses = "1.5 0 0 1 0 0 0 1\n2.5 0.5 0 1 0 0 0.1 0.995\n3.5 1 0.25 1 0 0 0.2 0.98\n";
    let folders: Vec<PathBuf> = ["bin", "xyz", "ply"].iter().map(|name| folder.join(name)).collect();
    for path in &folders {
        fs::create_dir(path).unwrap();
        fs::write(path.join("poses_tum.txt"), poses).unwrap();
    }
    for (number, cloud) in clouds.iter().enumerate() {
        let rows: Vec<String> =
            cloud.iter().map(|[x, y, z]| [*x, *y, *z].map(|c| f64::from(c).to_string()).join(" ")).collect();
        let floats = cloud.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]).flat_map(f32::to_le_bytes);
        fs::write(folders[0].join(format!("{number}.bin")), floats.collect::<Vec<u8>>()).unwrap();
        fs::write(folders[1].join(format!("{number}.xyz")), rows.join("\n")).unwrap();
        let header = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
            rows.len()
        );
        fs::write(folders[2].join(format!("{number}.ply")), header + &rows.join("\n") + "\n").unwrap();
    }
    folders
}

fn digest_of(input: &str, map: &Path, options: &[&str]) -> String {
    let mut arguments = vec!["build", input, "-o", text(map), "--resolution", "0.2"];
    arguments.extend(options);
    output(&arguments);
    let digest = output(&["digest", text(map)]);
    fs::remove_dir_all(map).unwrap();
    digest
}

#[test]
fn the_same_scans_in_other_formats_make_the_same_map() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let digests: Vec<String> =
        make_inputs(folder.path()).iter().map(|input| digest_of(text(input), &map, &[])).collect();
    assert!(digests.iter().all(|digest| *digest == digests[0]), "{digests:?}");
}

#[cfg(feature = "ros")]
#[test]
fn recordings_of_either_ros_make_the_same_map() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let data = |name: &str| repository(&format!("crates/formats/tests/data/ros/{name}"));
    let digests: Vec<String> = ["none.bag", "bz2.bag", "lz4.bag", "none.mcap", "zstd.mcap", "ros1.mcap"]
        .iter()
        .map(|name| digest_of(&data(name), &map, &["--topic", "/points"]))
        .collect();
    assert!(digests.iter().all(|digest| *digest == digests[0]), "{digests:?}");
    let refused = refusal(&["build", &data("none.bag"), "-o", text(&map)]);
    assert!(refused.contains("--topic") && refused.contains("/scan"), "{refused}");
    assert!(!map.exists());
}

/// The shell expands `drive_*.bag` to several arguments. Parts of a recording are one input, others are several.
#[cfg(feature = "ros")]
#[test]
fn recordings_in_several_files_are_mapped_together() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let copy = |from: &str, to: &str| {
        let path = folder.path().join(to);
        fs::copy(repository(&format!("crates/formats/tests/data/ros/{from}")), &path).unwrap();
        path
    };
    let build = |inputs: [&Path; 2]| {
        let [first, second] = inputs.map(text);
        output(&["build", first, second, "-o", text(&map), "--topic", "/points"]);
        let info: serde_json::Value = serde_json::from_str(&output(&["info", text(&map), "--json"])).unwrap();
        fs::remove_dir_all(&map).unwrap();
        let names = info["inputs"].as_array().unwrap().iter();
        let names: Vec<String> = names.map(|input| input["name"].as_str().unwrap().to_owned()).collect();
        (info["scan_number"].as_u64().unwrap(), names.join(", "))
    };
    let parts = ["drive_0.bag", "drive_1.bag"].map(|name| copy("none.bag", name));
    // The order of the parts is that of their numbers.
    assert_eq!(build([&parts[1], &parts[0]]), (8, "drive_0.bag and other files".to_owned()));
    let (first, other) = (copy("none.bag", "first.bag"), copy("none.mcap", "other.mcap"));
    // The same clouds again, in another file.
    let twice = ["build", text(&first), text(&other), "-o", text(&map), "--topic", "/points"];
    let refused = refusal(&twice);
    assert!(refused.contains("other.mcap: the map already has 4 scans"), "{refused}");
    fs::remove_dir_all(&map).unwrap();
    let log = folder.path().join("walk.log");
    fs::write(&log, "NODE 1 1 1 0 0 0\n1 2 3\n").unwrap();
    assert_eq!(build([&first, &log]), (5, "first.bag, walk.log".to_owned()));
}

/// A renamed copy is still recognised as a recording, without an option.
#[cfg(feature = "ros")]
#[test]
fn recordings_are_known_by_their_content() {
    let folder = TempDir::new().unwrap();
    let camera = folder.path().join("camera.txt");
    fs::write(&camera, "500 500 320 240\n").unwrap();
    for name in ["none.bag", "none.mcap"] {
        let path = folder.path().join("drive.backup");
        fs::copy(repository(&format!("crates/formats/tests/data/ros/{name}")), &path).unwrap();
        let input = ["scans", text(&path), "--topic", "/points"];
        assert!(output(&[&input[..], &["--json"]].concat()).contains("\"scans\":4,"), "{name}");
        for option in [["--depth-scale", "1000"], ["--intrinsics", text(&camera)]] {
            let refused = refusal(&[&input[..], &option].concat());
            assert!(refused.contains(option[0]) && refused.contains("omit this option"), "{refused}");
        }
    }
}

/// The error for depth images without intrinsics names the option and the default file.
#[test]
fn the_option_for_a_camera_is_named() {
    let (_outer, folder) = lone_folder();
    fs::write(folder.join("0.depth.png"), "").unwrap();
    let refused = refusal(&["scans", text(&folder)]);
    assert!(refused.contains("--intrinsics FILE") && refused.contains("camera-intrinsics.txt"), "{refused}");
}

/// The rule is the same for transforms of a recording and for poses of a file.
#[cfg(feature = "ros")]
#[test]
fn gaps_between_poses_are_filled_up_to_twice_the_tolerance() {
    let folder = TempDir::new().unwrap();
    let (bag, poses) =
        (repository("crates/formats/tests/data/ros/none.bag"), folder.path().join("poses.txt"));
    // Poses as in its transforms: five per second, with the stamps of the clouds between them.
    let rows = (0..4).map(|k| format!("1700000000.{:02} 0 0 1 0 0 0 1\n", 20 * k + 6));
    fs::write(&poses, rows.collect::<String>()).unwrap();
    for own in [&[][..], &["--poses", text(&poses)]] {
        for (tolerance, is_filled) in [("0.1", true), ("0.09", false)] {
            let input = ["scans", &bag, "--topic", "/points", "--pose-tolerance", tolerance, "--json"];
            let reported = output(&[&input, own].concat());
            assert_eq!(
                reported.contains("4 clouds have no pose"),
                !is_filled,
                "{own:?} {tolerance}: {reported}"
            );
            assert_eq!(
                reported.contains("apart; --pose-tolerance permits larger gaps"),
                !is_filled,
                "{reported}"
            );
        }
        let map = folder.path().join("map");
        let input = ["build", &bag, "--topic", "/points", "--pose-tolerance", "0.01", "-o", text(&map)];
        let refused = refusal(&[&input, own].concat());
        assert!(refused.contains("none of its 4 clouds has a pose"), "{refused}");
        assert!(refused.contains("apart; --pose-tolerance permits larger gaps"), "{refused}");
    }
}

#[test]
fn scans_lists_an_input_without_mapping() {
    let folder = TempDir::new().unwrap();
    let inputs = make_inputs(folder.path());
    let reported = output(&["scans", text(&inputs[0]), "--json"]);
    let reported: serde_json::Value = serde_json::from_str(&reported).unwrap();
    assert_eq!((&reported["scans"], &reported["points"]), (&3.into(), &180.into()), "{reported}");
    let each = output(&["scans", text(&inputs[1]), "--each", "--first", "1", "--every", "2"]);
    assert!(each.contains("scans     1, 60 points"), "{each}");
    let unknown = folder.path().join("file.pcap");
    fs::write(&unknown, b"\xd4\xc3\xb2\xa1 and more of a capture").unwrap();
    let refused = refusal(&["scans", text(&unknown)]);
    assert!(refused.contains("pcap"), "{refused}");
}

#[test]
fn a_map_lists_the_origins_of_its_scans() {
    let folder = TempDir::new().unwrap();
    let (inputs, map) = (make_inputs(folder.path()), folder.path().join("map"));
    output(&["build", text(&inputs[2]), "-o", text(&map), "--resolution", "0.2"]);
    let each = output(&["scans", text(&map), "--each", "--json"]);
    let rows: Vec<serde_json::Value> = each.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let origins: Vec<&serde_json::Value> = rows[..3].iter().map(|row| &row["origin_m"]).collect();
    assert_eq!(
        serde_json::json!(origins),
        serde_json::json!([[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [1.0, 0.25, 1.0]])
    );
    assert_eq!(rows[3]["scans"], 3);
}

#[test]
fn points_are_skipped_in_a_box_and_inserted_without_rays() {
    let folder = TempDir::new().unwrap();
    let (inputs, map) = (make_inputs(folder.path()), folder.path().join("map"));
    let count = |options: &[&str], key: &str| {
        let mut arguments = vec!["build", text(&inputs[0]), "-o", text(&map), "--resolution", "0.2"];
        arguments.extend(options);
        output(&arguments);
        let info: serde_json::Value = serde_json::from_str(&output(&["info", text(&map), "--json"])).unwrap();
        fs::remove_dir_all(&map).unwrap();
        info[key].as_u64().unwrap()
    };
    let (all, occupied) = (count(&[], "voxels"), count(&[], "occupied"));
    assert!(all > occupied);
    assert_eq!(count(&["--no-rays"], "voxels"), count(&["--no-rays"], "occupied"));
    let half = ["--ignore-box", "0", "-10", "-10", "10", "0", "10"];
    assert!(count(&half, "occupied") < occupied);
    assert_eq!(count(&["--ignore-box", "-99", "-99", "-99", "99", "99", "99"], "occupied"), 0);
}

#[test]
fn an_octomap_file_is_imported_and_queried_directly() {
    let folder = TempDir::new().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (bt, ot) = (place("map.bt"), place("map.ot"));
    output(&["export", &repository("map_tiles_example"), "-o", &bt]);
    output(&["export", &repository("map_tiles_example"), "-o", &ot]);
    for (file, again) in [(&bt, "again.bt"), (&ot, "again.ot")] {
        let map = place(&format!("{again} map"));
        output(&["import", file, "-o", &map]);
        output(&["export", &map, "-o", &place(again)]);
        assert_eq!(fs::read(file).unwrap(), fs::read(place(again)).unwrap(), "{again}");
        assert_eq!(output(&["digest", file]), output(&["digest", &map]));
        let ray = ["--origin", "8", "-2", "1.8", "--direction", "1", "1", "0"];
        let ask = |map: &str| output(&[&["raycast", map], &ray[..]].concat());
        assert_eq!(ask(file), ask(&map));
        assert!(ask(file).contains("hit at"), "{}", ask(file));
        output(&["verify", &map]);
    }
    let refused = refusal(&["import", &bt, "-o", &place("none"), "--max-voxels", "3"]);
    assert!(refused.contains("--max-voxels 3"), "{refused}");
    let refused = refusal(&["crop", &bt, "-o", &place("none"), "--region", "0", "0", "0", "1", "1", "1"]);
    assert!(refused.contains("voxtile import"), "{refused}");
}

#[test]
fn exports_are_atomic() {
    let folder = TempDir::new().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let map = repository("map_tiles_example");
    output(&["export", &map, "-o", &place("map.csv")]);
    let rows = fs::read_to_string(place("map.csv")).unwrap();
    let mut wanted: Vec<String> =
        rows.lines().skip(1).map(|row| row.split(',').take(3).collect::<Vec<_>>().join(" ")).collect();
    output(&["export", &map, "-o", &place("map.xyz")]);
    let lines = fs::read_to_string(place("map.xyz")).unwrap();
    let mut found: Vec<String> =
        lines.lines().map(|row| row.split(' ').take(3).collect::<Vec<_>>().join(" ")).collect();
    wanted.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, wanted);
    for name in [
        "map.npz",
        "map.glb",
        "map.png",
        "map.pgm",
        "map.las",
        "map.laz",
        "map.copc.laz",
        "map.e57",
        "map.mcap",
    ] {
        output(&["export", &map, "-o", &place(name)]);
        assert!(fs::metadata(place(name)).unwrap().len() > 0, "{name}");
        // An export may replace the output of an earlier one.
        output(&["export", &map, "-o", &place(name)]);
    }
    assert!(Path::new(&place("map.yaml")).exists() && Path::new(&place("map.pgw")).exists());
    output(&["export", &map, "-o", &place("squares"), "--format", "autoware"]);
    assert!(Path::new(&place("squares/pointcloud_map_metadata.yaml")).exists());
    refusal(&["export", &map, "-o", &place("squares"), "--format", "autoware"]);
    refusal(&["export", &map, "-o", "-", "--format", "laz"]);
    let left = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(left.into_iter().all(|name| !name.to_string_lossy().starts_with('.')));
}

/// A `.yaml` or a world file next to the output would replace an output of that name.
#[test]
fn outputs_with_the_name_of_their_second_file_are_refused() {
    let folder = TempDir::new().unwrap();
    let map = repository("map_tiles_example");
    for (format, name, hint) in
        [("nav2", "map.yaml", "map.pgm"), ("heightmap", "h.json", "h.png"), ("heightmap", "h.pgw", "h.png")]
    {
        let path = folder.path().join(name);
        let reported = refusal(&["export", &map, "-o", text(&path), "--format", format]);
        assert!(reported.contains(name) && reported.contains(hint), "{reported}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The user named only the output: a file with the name of its second file may belong to another program.
#[test]
fn the_second_file_is_replaced_only_with_its_output() {
    let folder = TempDir::new().unwrap();
    let map = repository("map_tiles_example");
    let path = |name: &str| folder.path().join(name);
    let names = || {
        let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
        names.sort_unstable();
        names
    };
    fs::write(path("package.json"), "{}").unwrap();
    let reported = refusal(&["export", &map, "-o", text(&path("package.png"))]);
    assert!(reported.contains("package.json") && reported.contains("move or remove"), "{reported}");
    assert_eq!(
        (names(), fs::read(path("package.json")).unwrap()),
        (vec!["package.json".into()], b"{}".to_vec())
    );
    // All output names are checked before the first file is written.
    fs::create_dir(path("h.pgw")).unwrap();
    let reported = refusal(&["export", &map, "-o", text(&path("h.png"))]);
    assert!(reported.contains("h.pgw"), "{reported}");
    assert_eq!(names(), ["h.pgw", "package.json"]);
    fs::remove_dir(path("h.pgw")).unwrap();

    output(&["export", &map, "-o", text(&path("h.png"))]);
    let written = fs::read(path("h.json")).unwrap();
    // As after a killed export: the second file exists without its output.
    fs::remove_file(path("h.png")).unwrap();
    output(&["export", &map, "-o", text(&path("h.png"))]);
    // The second file of an earlier output is replaced.
    fs::write(path("h.json"), "{}").unwrap();
    output(&["export", &map, "-o", text(&path("h.png"))]);
    assert_eq!(fs::read(path("h.json")).unwrap(), written);
    assert_eq!(names(), ["h.json", "h.pgw", "h.png", "package.json"]);
}

/// A usual layout: clouds in `scans`, their metadata next to it.
#[test]
fn text_files_next_to_clouds_are_no_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("set/scans");
    fs::create_dir_all(&scans).unwrap();
    fs::write(folder.path().join("set/README.md"), "1 2 3\n").unwrap();
    fs::write(folder.path().join("set/camera-intrinsics.txt"), "585 0 320\n0 585 240\n0 0 1\n").unwrap();
    fs::write(folder.path().join("set/poses_tum.txt"), "0 0 0 1 0 0 0 1\n1 0 0 1 0 0 0 1\n").unwrap();
    for name in ["0.ply", "1.ply"] {
        let header =
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
        fs::write(scans.join(name), format!("{header}end_header\n4 0 0\n")).unwrap();
    }
    let set = folder.path().join("set");
    for arguments in [vec!["scans", text(&set)], vec!["scans", text(&set), "--format", "ply"]] {
        let reported = output(&arguments);
        assert!(reported.contains("PLY") && reported.contains("set/poses_tum.txt"), "{reported}");
    }
}

/// A text file of poses may have any name in the folder of clouds.
#[test]
fn a_file_of_poses_is_no_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for number in 0..2 {
        fs::write(scans.join(format!("{number}.txt")), "4 0 0\n").unwrap();
    }
    let poses = scans.join("optimized.txt");
    fs::write(&poses, "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n").unwrap();
    for format in [&[][..], &["--format", "xyz"]] {
        let input = ["scans", text(&scans), "--poses", text(&poses), "--json"];
        let reported: serde_json::Value = serde_json::from_str(&output(&[&input, format].concat())).unwrap();
        assert_eq!((&reported["scans"], &reported["points"]), (&2.into(), &2.into()), "{reported}");
    }
    let other = folder.path().join("other.txt");
    fs::copy(&poses, &other).unwrap();
    let reported = output(&["scans", text(&scans), "--poses", text(&other)]);
    assert!(
        reported.contains("scans     2,")
            && reported.contains("optimized.txt (poses: its rows are matrices)"),
        "{reported}"
    );
    fs::write(scans.join("2.txt"), "4 0 0\n").unwrap();
    let refused = refusal(&["scans", text(&scans), "--poses", text(&other)]);
    assert!(refused.contains("2 poses for 3 clouds (0.txt to 2.txt), "), "{refused}");
}

/// Clouds and poses have different clocks: an empty map would be misleading.
#[test]
fn clouds_without_any_pose_make_no_map() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for stamp in ["1600000000.000000000", "1600000001.000000000"] {
        fs::write(scans.join(format!("{stamp}.xyz")), "4 0 0\n4 1 0\n").unwrap();
    }
    let poses = folder.path().join("gps.txt");
    fs::write(&poses, "1284035200 0 0 1 0 0 0 1\n1284035210 0 0 1 0 0 0 1\n").unwrap();
    let map = folder.path().join("map");
    let reported = refusal(&["build", text(&scans), "--poses", text(&poses), "-o", text(&map)]);
    for part in ["none of its 2 clouds has a pose", "315964790.000 s after the last pose", "clocks differ"] {
        assert!(reported.contains(part), "{reported}");
    }
    // One pose is enough.
    fs::write(&poses, "1599999999.5 0 0 1 0 0 0 1\n1600000000.5 0 0 1 0 0 0 1\n").unwrap();
    let map = folder.path().join("other");
    output(&["build", text(&scans), "--poses", text(&poses), "-o", text(&map)]);
    let reported = output(&["scans", text(&scans), "--poses", text(&poses)]);
    let named = "1 cloud has no pose: skipped (1600000001.000000000.xyz: it is 0.500 s after the last pose)";
    assert!(reported.contains(named), "{reported}");
    assert!(output(&["scans", text(&map)]).contains("1600000000"), "{}", output(&["scans", text(&map)]));
}

/// A cloud that cannot be opened keeps its number and pose; unused poses are reported.
#[test]
fn poses_by_number_belong_to_their_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    let cloud = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n4 0 0\n";
    for (name, text) in [("0", cloud), ("1", "ply\nformat of no kind\n"), ("2", cloud)] {
        fs::write(scans.join(format!("{name}.ply")), text).unwrap();
    }
    let poses = folder.path().join("poses.txt");
    let rows: Vec<String> = (0..3).map(|k| format!("1 0 0 {} 0 1 0 0 0 0 1 0\n", 10 * k)).collect();
    fs::write(&poses, rows.concat()).unwrap();
    let map = folder.path().join("map");
    output(&["build", text(&scans), "--poses", text(&poses), "-o", text(&map), "--skip-bad"]);
    let reported = output(&["scans", text(&map), "--each", "--json"]);
    let scans = reported.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let origins: Vec<f64> = scans.filter_map(|scan| scan["origin_m"][0].as_f64()).collect();
    assert_eq!(origins, [0.0, 20.0]);

    // The number of scans in a folder of E57 is unknown before they are read.
    let several = folder.path().join("several");
    fs::create_dir(&several).unwrap();
    fs::copy(repository("crates/formats/tests/data/scans.e57"), several.join("a.e57")).unwrap();
    fs::copy(repository("crates/formats/tests/data/scans.e57"), several.join("b.e57")).unwrap();
    fs::write(&poses, rows.concat().repeat(10)).unwrap();
    let reported = output(&["scans", text(&several), "--poses", text(&poses)]);
    assert!(reported.contains("more poses than clouds"), "{reported}");
}

/// A killed recorder of ROS 1 leaves `.bag.active`, possibly as the only file.
#[test]
fn a_recording_that_was_not_closed_is_found_in_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let bag = PathBuf::from(repository("crates/formats/tests/data/ros/none.bag"));
    let alone = output(&["scans", text(&bag), "--topic", "/points", "--each", "--json"]);
    fs::copy(&bag, folder.path().join("drive.bag.active")).unwrap();
    let reported = output(&["scans", text(folder.path()), "--topic", "/points", "--each", "--json"]);
    assert_eq!(reported, alone);
    assert_eq!(reported.lines().count(), 4 + 1);
}

/// Far clouds with a coordinate reference system: the map keeps it, and exports record it if the format can.
#[test]
fn coordinate_reference_systems_are_kept_and_written_back() {
    let (_outer, folder) = lone_folder();
    let path = |name: &str| folder.join(name);
    let points = path("points.xyz");
    fs::write(&points, "600000.25 5300000.25 400.5\n600001.25 5300000.75 401.5\n").unwrap();
    let (plain, other) = (path("plain"), path("other"));
    output(&["build", text(&points), "-o", text(&plain), "--no-rays", "--resolution", "0.5"]);
    assert!(!output(&["info", text(&plain)]).contains("crs"));
    // Add a coordinate reference system to the exported file.
    let named = path("named.las");
    output(&["export", text(&plain), "-o", text(&named), "-q"]);
    name_crs(&named, "EPSG:25832");
    output(&["build", text(&named), "-o", text(&other), "--no-rays", "--resolution", "0.5"]);
    assert!(output(&["info", text(&other)]).contains("25832"), "{}", output(&["info", text(&other)]));
    assert_eq!(output(&["digest", text(&other)]), output(&["digest", text(&plain)]));
    let again = path("again.laz");
    output(&["export", text(&other), "-o", text(&again), "-q"]);
    let third = path("third");
    output(&["build", text(&again), "-o", text(&third), "--no-rays", "--resolution", "0.5"]);
    assert!(output(&["info", text(&third), "--json"]).contains("25832"));
    // Points in another system would be misplaced, so they are refused.
    let mixed = path("mixed.las");
    output(&["export", text(&plain), "-o", text(&mixed), "-q"]);
    name_crs(&mixed, "EPSG:25833");
    let reported = refusal(&["build", text(&mixed), "-o", text(&other), "--no-rays", "--append"]);
    assert!(reported.contains("25833") && reported.contains("25832"), "{reported}");
    let fourth = path("fourth");
    output(&["build", text(&mixed), "-o", text(&fourth), "--no-rays", "--resolution", "0.5"]);
    let reported = refusal(&["merge", text(&other), text(&fourth), "-o", text(&path("merged"))]);
    assert!(reported.contains("coordinate reference system") && reported.contains("25833"), "{reported}");
    // A map without a system accepts any, and parts of a map keep theirs.
    output(&["merge", text(&other), text(&plain), "-o", text(&path("merged"))]);
    output(&[
        "crop",
        text(&other),
        "-o",
        text(&path("part")),
        "--region",
        "600000",
        "5300000",
        "0",
        "600001",
        "5300001",
        "999",
    ]);
    for map in ["merged", "part"] {
        assert!(output(&["info", text(&path(map))]).contains("25832"), "{map}");
    }
}

/// Adds a coordinate reference system as GeoTIFF keys to a LAS file without one.
fn name_crs(file: &Path, crs: &str) {
    let mut bytes = fs::read(file).unwrap();
    let number: u16 = crs.strip_prefix("EPSG:").unwrap().parse().unwrap();
    let mut record = vec![0_u8; 54];
    record[2..2 + 16].copy_from_slice(b"LASF_Projection\0");
    record[18..20].copy_from_slice(&34735_u16.to_le_bytes());
    record[20..22].copy_from_slice(&24_u16.to_le_bytes());
    let keys: [u16; 12] = [1, 1, 0, 2, 3072, 0, 1, number, 3076, 0, 1, 9001];
    record.extend(keys.iter().flat_map(|key| key.to_le_bytes()));
    let header = u16::from_le_bytes(bytes[94..96].try_into().unwrap()) as usize;
    let extra = record.len() as u32;
    let points = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) + extra;
    let records = u32::from_le_bytes(bytes[100..104].try_into().unwrap()) + 1;
    bytes[96..100].copy_from_slice(&points.to_le_bytes());
    bytes[100..104].copy_from_slice(&records.to_le_bytes());
    bytes.splice(header..header, record);
    // Clear the WKT flag.
    bytes[6] &= !16;
    fs::write(file, bytes).unwrap();
}

/// Writes numbered clouds of one point each; those in `bad` are damaged.
fn numbered(folder: &Path, count: usize, bad: &[usize]) -> (PathBuf, PathBuf) {
    let scans = folder.join("scans");
    fs::create_dir(&scans).unwrap();
    let head =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    for number in 0..count {
        let text = match bad.contains(&number) {
            true => "ply\nformat of no kind\n".to_owned(),
            false => format!("{head}end_header\n4 0 0\n"),
        };
        fs::write(scans.join(format!("{number}.ply")), text).unwrap();
    }
    let poses = folder.join("poses.txt");
    let rows: Vec<String> = (0..count).map(|k| format!("1 0 0 {k} 0 1 0 0 0 0 1 0\n")).collect();
    fs::write(&poses, rows.concat()).unwrap();
    (scans, poses)
}

fn origins_of(map: &Path) -> Vec<f64> {
    let reported = output(&["scans", text(map), "--each", "--json"]);
    let scans = reported.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    scans.filter_map(|scan| scan["origin_m"][0].as_f64()).collect()
}

/// A damaged cloud has a number too, and does not end a build that never reads it.
#[test]
fn damaged_clouds_shift_no_others_of_a_selection() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, poses) = numbered(folder.path(), 40, &[5, 20]);
    let build = |map: &Path, options: &[&str]| {
        let input = ["build", text(&scans), "--poses", text(&poses), "-o", text(map)];
        output(&[&input, options].concat());
        origins_of(map)
    };
    let map = |name: &str| folder.path().join(name);
    assert_eq!(build(&map("a"), &["--every", "10", "--skip-bad"]), [0.0, 10.0, 30.0]);
    assert_eq!(build(&map("b"), &["--every", "12"]), [0.0, 12.0, 24.0, 36.0]);
    assert_eq!(build(&map("c"), &["--first", "7", "--count", "2"]), [7.0, 8.0]);
    let reported = output(&["scans", text(&scans), "--poses", text(&poses), "--first", "7", "--count", "2"]);
    assert!(reported.contains("1 of the skipped scans cannot be read"), "{reported}");
}

/// These bytes make the LAZ decoder panic.
#[test]
fn a_panic_of_a_decoder_prints_one_line_with_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("damaged.laz");
    let whole = fs::read(repository("crates/formats/tests/data/withheld.laz")).unwrap();
    let points_at = u32::from_le_bytes(whole[96..100].try_into().unwrap()) as usize;
    for at in [143, 149, 176] {
        let mut bytes = whole.clone();
        bytes[points_at + at..points_at + at + 16].fill(0xff);
        fs::write(&file, bytes).unwrap();
        let printed = refusal(&["scans", text(&file)]);
        assert!(
            printed.contains("damaged.laz") && printed.contains("its decoder failed (decoders.rs:"),
            "{printed}"
        );
        assert!(printed.lines().count() == 1 && !printed.contains("panicked"), "{printed}");
    }
}

/// A truncated LAS file keeps its points with a remark; a truncated PLY file is a bad cloud with an offset.
#[test]
fn truncated_clouds_are_kept_or_reported_with_an_offset() {
    let folder = tempfile::tempdir().unwrap();
    let inputs = make_inputs(folder.path());
    let path = |name: &str| folder.path().join(name);
    output(&["build", text(&inputs[2]), "-o", text(&path("map")), "--resolution", "0.2"]);
    let cut = |name: &str| {
        let file = path(name);
        output(&["export", text(&path("map")), "-o", text(&file)]);
        let bytes = fs::read(&file).unwrap();
        fs::write(&file, &bytes[..bytes.len() - 100]).unwrap();
        file
    };
    let build = |file: &Path, map: &str| {
        let map = path(map);
        json(&["build", text(file), "-o", text(&map), "--no-rays", "--skip-bad", "--json"])
    };
    // Points have 42 bytes.
    let las = cut("voxels.las");
    let reported = json(&["scans", text(&las), "--json"]);
    let points = reported["points"].as_u64().unwrap();
    let remark = format!("the file is truncated: {points} of {} points exist and are read", points + 3);
    assert!(reported["remarks"].to_string().contains(&remark), "{reported}");
    assert_eq!(build(&las, "las.map")["points"], points);
    let ply = cut("voxels.ply");
    let run = voxtile(&["scans", text(&ply), "--json"]).assert().failure().code(1);
    let reported: serde_json::Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let error = &reported["error"];
    assert_eq!((&error["kind"], error["path"].as_str()), (&"malformed".into(), Some(text(&ply))));
    assert!(error["offset"].as_u64() > Some(0) && error["record"].is_null(), "{error}");
    assert_eq!(build(&ply, "ply.map")["points"], 0);
}

/// Points that deskewing cannot move, and clouds without times, give a remark.
#[test]
fn points_not_moved_by_deskewing_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    let path = scans.join("1600000000.000000000.xyz");
    fs::write(&path, "x y z time\n4 0 0 0\n4 1 0 0.5\n4 2 0 0.75\n4 3 0 0.8\n").unwrap();
    fs::write(scans.join("1600000000.500000000.xyz"), "4 0 0\n").unwrap();
    let poses = folder.path().join("poses.txt");
    fs::write(&poses, "1599999999.9 0 0 1 0 0 0 1\n1600000000.6 7 0 1 0 0 0 1\n").unwrap();
    let input = ["scans", text(&scans), "--poses", text(&poses), "--pose-tolerance", "2"];
    let reported = output(&[&input[..], &["--deskew"]].concat());
    for part in [
        "1 cloud has no point times or no stamp: --deskew had no effect there",
        "2 points not deskewed: there is no pose at their own times",
    ] {
        assert!(reported.contains(part), "{reported}");
    }
    assert!(!output(&input).contains("--deskew"));
    let refused = refusal(&[&input[..], &["--deskew", "--world-frame"]].concat());
    assert!(refused.contains("--deskew") && refused.contains("--world-frame"), "{refused}");
}

/// The system's temporary folder may be in memory, so builds unpack next to the map.
#[cfg(feature = "ros")]
#[test]
fn packed_recordings_are_unpacked_next_to_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    fs::create_dir(&bag).unwrap();
    let plain = fs::read(repository("crates/formats/tests/data/ros/none.mcap")).unwrap();
    fs::write(bag.join("a.mcap.zstd"), zstd::encode_all(plain.as_slice(), 3).unwrap()).unwrap();
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n  - a.mcap.zstd\n";
    fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    // Three cases: the folder of the map exists, the folder is created, the map exists.
    let maps = ["map", "new/folder/map", "map"].map(|map| folder.path().join(map));
    for (map, again) in maps.iter().zip([&[][..], &[], &["--append", "--again"]]) {
        let build = ["build", text(&bag), "--topic", "/points", "-o", text(map)];
        let how = if again.is_empty() { &["--resolution", "0.2"] } else { again };
        let arguments = [&build, how].concat();
        let built = voxtile(&arguments).env("TMPDIR", folder.path().join("gone")).output().unwrap();
        assert!(built.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&built.stderr));
    }
}

/// A day in parts of a minute has more files than a process may open.
#[cfg(all(feature = "ros", unix))]
#[test]
fn a_recording_may_have_more_parts_than_files_may_be_open() {
    for extension in ["mcap", "bag"] {
        let folder = tempfile::tempdir().unwrap();
        let part = repository(&format!("crates/formats/tests/data/ros/none.{extension}"));
        for number in 0..60 {
            fs::copy(&part, folder.path().join(format!("{number}.{extension}"))).unwrap();
        }
        let mut limited = Command::new("sh");
        limited
            .args(["-c", "ulimit -n 40 && exec \"$@\"", "sh"])
            .arg(assert_cmd::cargo::cargo_bin("voxtile"));
        let reported = limited.args(["scans", text(folder.path()), "--topic", "/points"]).output().unwrap();
        let printed = String::from_utf8_lossy(&reported.stdout);
        assert!(reported.status.success(), "{extension}: {}", String::from_utf8_lossy(&reported.stderr));
        assert!(printed.contains("240"), "{extension}: 4 scans a part: {printed}");
    }
}

/// Pixels without depth are rays without a return, even if the range of clearing is taken from the map.
#[test]
fn a_resumed_build_keeps_clearing_rays_without_a_return() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let depth = path("depth");
    fs::create_dir(&depth).unwrap();
    let add = |number: usize| {
        let file = fs::File::create(depth.join(format!("{number}.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, 4, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let depths = [2000_u16, 0, 2000, 0, 0, 2000, 0, 1000];
        let bytes: Vec<u8> = depths.iter().flat_map(|depth| depth.to_be_bytes()).collect();
        encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
        let rows: Vec<String> = (0..=number).map(|k| format!("1 0 0 {k} 0 1 0 0 0 0 1 0\n")).collect();
        fs::write(path("poses.txt"), rows.concat()).unwrap();
    };
    fs::write(path("camera.txt"), "4 4 2 1\n").unwrap();
    let build = |map: &Path, how: &[&str]| {
        let poses = path("poses.txt");
        let camera = path("camera.txt");
        let input = ["build", text(&depth), "--poses", text(&poses), "--intrinsics", text(&camera)];
        output(&[&input[..], &["-o", text(map), "--json"], how].concat())
    };
    (0..2).for_each(add);
    build(&path("map"), &["--clear-no-return", "3"]);
    add(2);
    let reported: serde_json::Value = serde_json::from_str(&build(&path("map"), &["--resume"])).unwrap();
    assert_eq!((&reported["resumed_after"], &reported["scans"]), (&2.into(), &1.into()), "{reported}");
    build(&path("whole"), &["--clear-no-return", "3"]);
    build(&path("without"), &[]);
    let digest = |name: &str| output(&["digest", text(&path(name))]);
    assert_eq!(digest("map"), digest("whole"));
    assert_ne!(digest("whole"), digest("without"));
}

/// The registry of formats, the help, the document and the Python package list the same formats.
#[test]
fn output_formats_are_the_same_in_help_pages_and_python() {
    let formats = OutputFormats::default();
    let names = |wanted: &dyn Fn(&OutputFormat) -> bool, name: &dyn Fn(&OutputFormat) -> String| {
        formats.all().iter().filter(|format| wanted(format)).map(name).collect::<Vec<_>>()
    };
    // Folders have no extension.
    let end = |format: &OutputFormat| match format.extension {
        Some(extension) => format!(".{extension}"),
        None => format.name.to_owned(),
    };
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");

    let help = words(&output(&["export", "--help"]));
    let about = |option: &str| help.split_once(option).unwrap().1.split(" --").next().unwrap();
    let outputs = about("--output <FILE>");
    for extension in names(&|format| format.extension.is_some(), &end) {
        assert!(outputs.split([' ', ',']).any(|word| word == extension), "{extension}: {outputs}");
    }
    let streams = names(&OutputFormat::is_stream, &end);
    assert!(outputs.contains(&format!("standard output ({})", streams.join(" "))), "{outputs}");
    let takers = |option| names(&|format| format.takes.contains(&option), &end);
    let heights = takers(OutputOption::Heights).join(", ");
    assert!(about("--z-min <M>").trim_start().starts_with(&heights), "{heights}");
    assert!(about("--z-max <M>").trim_start().starts_with(&heights), "{heights}");
    assert!(about("--cell <M>").trim_start().starts_with(&takers(OutputOption::Cell).join(", ")));
    assert!(about("--quantize").trim_start().starts_with(&takers(OutputOption::Quantized).join(", ")));

    let page = fs::read_to_string(repository("docs/formats.md")).unwrap();
    let (_, page) = page.split_once("\n## Out\n").unwrap();
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with('|')).collect();
    let firsts = rows.iter().map(|row| row.split('|').nth(1).unwrap());
    for format in formats.all() {
        let word = format!("`{}`", end(format));
        assert!(firsts.clone().any(|first| first.contains(&word)), "docs/formats.md does not mention {word}");
    }
    let quoted =
        |names: Vec<String>| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let takes = |format: &OutputFormat, option| format.takes.contains(&option);
    let but = |option| format!("all but {}", quoted(names(&|format| !takes(format, option), &end)));
    for (option, wanted) in [
        ("--what occupied\\|free\\|all`, `--min-probability", but(OutputOption::Which)),
        ("--region", but(OutputOption::Region)),
        ("--z-min`, `--z-max", quoted(takers(OutputOption::Heights))),
        ("--cell", quoted(takers(OutputOption::Cell))),
        ("--quantize", quoted(takers(OutputOption::Quantized))),
        ("--origin", quoted(names(&|format| format.origin != Origin::Map, &end))),
        ("-o -` (standard output)", quoted(streams)),
    ] {
        let row = match option.ends_with(')') {
            true => format!("| `{option} | {wanted} |"),
            false => format!("| `{option}` | {wanted} |"),
        };
        assert!(rows.contains(&row.as_str()), "docs/formats.md lacks the row {row}");
    }

    let python = words(&fs::read_to_string(repository("python/python/voxtile/files.py")).unwrap());
    let all = names(&|_| true, &|format| format.name.to_owned()).join(" ");
    assert!(python.contains(&all), "python/python/voxtile/files.py lacks: {all}");
}
