use super::cli::{failure, json, output, text, voxtile};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Builds a map of three scans from the origin of a wall of 5 x 5 voxels at `x` m.
fn wall_at(folder: &Path, name: &str, x: &str, more: &[&str]) -> PathBuf {
    let map = folder.join(name);
    let across = ["-0.15", "-0.05", "0.05", "0.15", "0.25"];
    let lines: String =
        across.iter().flat_map(|y| across.iter().map(move |z| format!("{x} {y} {z}\n"))).collect();
    let files: Vec<PathBuf> = (0..3).map(|number| folder.join(format!("{name}{number}.xyz"))).collect();
    files.iter().for_each(|file| fs::write(file, &lines).unwrap());
    let mut arguments = vec!["build", "-o", text(&map), "--poses", "identity", "--resolution", "0.1"];
    arguments.extend(files.iter().map(|file| text(file)));
    arguments.extend(more);
    output(&arguments);
    map
}

const GUARDED: [&str; 2] = ["--clearing", "guarded"];

#[test]
fn changes_are_counted_listed_and_written() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let crs = ["--crs", "EPSG:25832", "--clearing", "guarded"];
    let (before, after) =
        (wall_at(folder.path(), "before", "2.05", &crs), wall_at(folder.path(), "after", "4.05", &GUARDED));
    let maps = ["compare", text(&before), text(&after)];
    let run = |more: &[&str]| json(&[&maps[..], more, &["--json"]].concat());
    let found = run(&[]);
    assert_eq!((&found["before"]["occupied"], &found["before"]["changed"]), (&25.into(), &25.into()), "{found}");
    assert_eq!((&found["after"]["occupied"], &found["after"]["not_seen"]), (&25.into(), &25.into()), "{found}");
    assert_eq!((&found["vanished"]["clusters"], &found["appeared"]["clusters"]), (&1.into(), &0.into()));
    let change = &found["changes"][0];
    assert_eq!((&change["kind"], &change["voxels"], &change["number"]), (&"vanished".into(), &25.into(), &1.into()));
    assert_eq!(change["bounds_m"], serde_json::json!({"min": [2.0, -0.2, -0.2], "max": [2.1, 0.3, 0.3]}));
    assert_eq!((&found["tolerance_voxels"], &found["crs"]), (&1.into(), &"EPSG:25832".into()));
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("only one of the maps names a coordinate"), "{warnings}");

    // The reverse: what appeared is known now, what is behind it is not.
    let back = json(&["compare", text(&after), text(&before), "--json"]);
    assert_eq!((&back["before"]["not_seen"], &back["after"]["changed"]), (&25.into(), &25.into()));
    // Files.
    let (csv, geojson, all_json) = (path("a.csv"), path("a.geojson"), path("a.json"));
    for list in [&csv, &geojson, &all_json] {
        assert_eq!(run(&["--list", text(list)])["list"], text(list));
    }
    let lines = fs::read_to_string(&csv).unwrap();
    assert!(lines.starts_with("number,kind,voxels,volume_m3,min_x") && lines.contains("\n1,vanished,25,"), "{lines}");
    let features: serde_json::Value = serde_json::from_slice(&fs::read(&geojson).unwrap()).unwrap();
    assert_eq!(features["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::25832");
    assert_eq!(features["features"][0]["geometry"]["coordinates"][0][2], serde_json::json!([2.1, 0.3]));
    let listed: serde_json::Value = serde_json::from_slice(&fs::read(&all_json).unwrap()).unwrap();
    assert_eq!(listed["changes"], found["changes"]);
    for (file, options, voxels) in
        [("v.ply", &[][..], 25), ("all.ply", &["--all"], 50), ("v.csv", &[], 25), ("v.las", &[], 25)]
    {
        let file = path(file);
        let written = run(&[&["-o", text(&file)][..], options].concat());
        assert_eq!(written["output_voxels"], voxels, "{written}");
        if text(&file).ends_with(".csv") {
            let lines = fs::read_to_string(&file).unwrap();
            assert!(lines.lines().count() == 26 && lines.contains(",66"), "{lines}");
        }
        if text(&file).ends_with(".las") {
            // Point format 7: the class is byte 16 of a point.
            let bytes = fs::read(&file).unwrap();
            let first = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
            assert_eq!((bytes[104] & 63, bytes[first + 16]), (7, 66));
        }
    }
    let summary = output(&maps);
    for part in ["tolerance 1 voxel (0.100 m)", "vanished  1 cluster of 25 voxels", "1  vanished 25 voxels at 2.1 0.1 0.1"] {
        assert!(summary.contains(part), "{summary}");
    }
    assert!(run(&["--min-voxels", "26"])["vanished"]["small_voxels"] == 25);
    assert!(run(&["--region", "3", "-1", "-1", "5", "1", "1"])["before"]["occupied"] == 0);
    // Octree files.
    let bt = path("after.bt");
    output(&["export", text(&after), "-o", text(&bt)]);
    let of_file = json(&["compare", text(&before), text(&bt), "--json"]);
    assert_eq!(of_file["changes"], found["changes"]);
    assert!(of_file["warnings"].to_string().contains("OctoMap's rule of clearing"), "{of_file}");
}

#[test]
fn doubtful_and_unsuitable_maps_are_named() {
    let folder = TempDir::new().unwrap();
    let of = |name: &str, more: &[&str]| wall_at(folder.path(), name, "2.05", more);
    let map = of("map", &[]);
    output(&["snapshot", text(&map), "first"]);
    let snapshot = format!("{}@first", text(&map));
    let found = json(&["compare", &snapshot, text(&map), "--json"]);
    assert_eq!((&found["before"]["unchanged"], &found["maps"][0]["snapshot"]), (&25.into(), &"first".into()));
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("states of one map") && warnings.contains("clearing guarded"), "{warnings}");
    let far = wall_at(folder.path(), "far", "300.05", &GUARDED);
    let alone = of("alone", &["--region", "0", "-1", "-1", "10", "1", "1", "--clearing", "guarded"]);
    let found = json(&["compare", text(&alone), text(&far), "--json"]);
    println!("{found}");
    let coarse = of("coarse", &["--resolution", "0.2"]);
    let (code, message) = failure(&["compare", text(&map), text(&coarse)]);
    assert!(code == 2 && message.contains("0.1 m and 0.2 m cannot be compared"), "{message}");
    let utm = of("utm", &["--crs", "EPSG:25832"]);
    let other = of("other", &["--crs", "EPSG:25833"]);
    let (code, message) = failure(&["compare", text(&utm), text(&other)]);
    assert!(code != 0 && message.contains("coordinate reference system"), "{message}");
    for (arguments, part) in [
        (["--tolerance", "9"], "--tolerance: must be from 0 to 1.6 m"),
        (["--certainty", "0.4"], "--certainty: must be above 0.5"),
        (["--list", "a.txt"], "--list: a.txt: a list of changes is .csv, .json or .geojson"),
        (["-o", "a.pcd"], "--output: a.pcd: voxels with classes are .las .laz"),
    ] {
        let (code, message) = failure(&[&["compare", text(&map), text(&map)][..], &arguments].concat());
        assert!(code == 2 && message.contains(part), "{message}");
    }
    voxtile(&["compare", text(&map), "missing"]).assert().failure();
}

#[test]
fn frontiers_are_listed() {
    let folder = TempDir::new().unwrap();
    let map = wall_at(folder.path(), "map", "2.05", &GUARDED);
    let region = ["--region", "0", "-0.2", "-0.2", "2.1", "0.3", "0.3"];
    let found = json(&[&["coverage", text(&map), "--json"][..], &region].concat());
    let share = found["observed_share"].as_f64().unwrap();
    assert!(found["occupied"] == 25 && (0.2..1.0).contains(&share), "{found}");
    assert_eq!(found["frontiers"].as_array().unwrap().len(), 1, "{found}");
    assert!(found["frontiers"][0]["area_m2"].as_f64().unwrap() > 0.5, "{found}");
    let summary = output(&["coverage", text(&map)]);
    assert!(summary.contains("observed  25 occupied voxels") && summary.contains("1 frontier,"), "{summary}");
}
