use crate::cli::{output, scans, text, voxtile};
use serde_json::Value;
use std::fs;
use tempfile::TempDir;

/// Runs a command that must succeed and returns the objects on its standard output.
fn objects(arguments: &[&str]) -> Vec<Value> {
    output(arguments).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Checks the conventions of all objects: a position is `[x, y, z]`, a box has `min` and `max`, and names of lengths
/// end with their unit.
fn check(name: &str, value: &Value) {
    let is_place = |value: &Value| {
        value.as_array().is_some_and(|numbers| numbers.len() == 3 && numbers.iter().all(Value::is_number))
    };
    if let Some(object) = value.as_object() {
        if let (Some(min), Some(max)) = (object.get("min"), object.get("max")) {
            let is_statistic = min.is_number() && max.is_number();
            assert!(object.len() == 2 && is_place(min) && is_place(max) || is_statistic, "{name}: {value}");
        }
        object.iter().for_each(|(name, value)| check(name, value));
    } else if let Some(array) = value.as_array() {
        assert!(!name.ends_with("_m") || is_place(value), "{name}: {value}");
        let is_of_numbers = !array.is_empty() && array.iter().all(Value::is_number);
        let is_index = ["tile", "voxel", "min", "max"].contains(&name) || name.ends_with("_voxel");
        assert!(is_place(value) == (name.ends_with("_m") || is_index) || !is_of_numbers, "{name}: {value}");
        array.iter().for_each(|value| check("", value));
    }
    assert!(!["x", "y", "z", "lower", "upper", "corner"].contains(&name), "{name}: {value}");
}

#[test]
fn every_object_has_the_version_and_the_same_shapes() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let scans = text(&scans);
    let (map, bt, csv) = (&*path("map"), &*path("a.bt"), &*path("a.csv"));
    let (crop, merged, small, demo) = (&*path("crop"), &*path("merged"), &*path("small"), &*path("demo"));
    let field = &*path("field");
    let (picture, points) = (&*path("local.png"), &*path("points.txt"));
    fs::write(points, "4.1 -0.5 0.6\n1 0 0.6\n99 99 99\n").unwrap();
    let part = ["--region", "0", "-1", "0", "5", "1", "2"];
    let ray = ["--origin", "0.05", "0.05", "0.6", "--direction"];
    let runs: [&[&str]; 26] = [
        &["build", scans, "-o", map],
        &["info", map],
        &["query", map, "--points", points],
        &[&["raycast", map][..], &ray, &["1", "-0.01", "0"]].concat(),
        &[&["raycast", map][..], &ray, &["-1", "0", "0"]].concat(),
        &["export", map, "-o", bt],
        &["export", map, "-o", csv, "--origin", "100", "0", "0"],
        &["info", bt],
        &["digest", map],
        &["distance", map, "-o", field, "--max-distance", "1"],
        &["snapshot", map, "good"],
        &["build", scans, "-o", map, "--append", "--again"],
        &["snapshots", map],
        &["diff", map, "good", "now"],
        &[&["crop", map, "-o", crop][..], &part].concat(),
        &["merge", map, crop, "-o", merged, "--prefer", "first"],
        &["convert", map, "-o", small, "--storage", "compact"],
        &[&["clear", merged][..], &part].concat(),
        &["decay", merged, "--halflife", "3", "--scans", "3"],
        &["info", &format!("{map}@good")],
        &["revert", map, "good", "--keep-as", "late"],
        &["snapshot", map, "late", "--delete"],
        &["verify", map],
        &["repair", map],
        &["local", scans, "-o", picture],
        &["demo", "--out", demo, "--length", "4"],
    ];
    for run in runs {
        let objects = objects(&[run, &["--json"]].concat());
        assert_eq!(objects.len(), if run.contains(&"--points") { 3 } else { 1 }, "{run:?}");
        for object in objects {
            assert_eq!(object["version"], 1, "{run:?}: {object}");
            check("", &object);
        }
    }
    let info = &objects(&["info", map, "--json"])[0];
    assert!(info["bounds_m"]["min"][0].is_number() && info["tile_bounds"]["max"][2].is_number(), "{info}");
}

/// Runs a command that must fail; returns exit code, error object and text on standard error.
fn failed(arguments: &[&str]) -> (i32, Value, String) {
    let run = voxtile(arguments).assert().failure();
    let run = run.get_output();
    let printed = String::from_utf8(run.stderr.clone()).unwrap();
    let mut reported: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(reported["version"], 1);
    check("", &reported);
    let error = reported["error"].take();
    assert!(printed.ends_with(&format!("voxtile: {}\n", error["message"].as_str().unwrap())), "{printed}");
    (run.status.code().unwrap(), error, printed)
}

#[test]
fn a_failure_prints_an_object_and_a_line() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let (map, none) = (folder.path().join("map"), folder.path().join("none"));
    let (map, none) = (text(&map), text(&none));
    output(&["build", text(&scans), "-o", map]);

    let (code, error, _) = failed(&["info", none, "--json"]);
    assert_eq!((code, &error["kind"], &error["path"]), (1, &"no_map".into(), &none.into()));
    assert!(
        error.get("tile").is_none() && error.get("line").is_none(),
        "fields that do not apply are absent"
    );

    let upside_down = ["clear", map, "--json", "--region", "0", "0", "0", "1", "1", "-1"];
    let (code, error, _) = failed(&upside_down);
    assert_eq!((code, &error["kind"]), (2, &"invalid_argument".into()));
    assert_eq!(error["argument"], "--region");

    let (code, error, _) = failed(&["build", text(&scans), "-o", map, "--json"]);
    assert_eq!((code, &error["kind"], &error["path"]), (2, &"already_exists".into(), &map.into()));
    let misfit = ["build", text(&scans), "-o", none, "--resolution", "0.3", "--tile-size", "10", "--json"];
    let (code, error, _) = failed(&misfit);
    assert_eq!((code, &error["kind"]), (2, &"grid".into()));

    let scan = scans.join("001.pcd");
    let whole = fs::read_to_string(&scan).unwrap();
    fs::write(&scan, whole.replacen("4.05 ", "", 1)).unwrap();
    let (code, error, printed) = failed(&["build", text(&scans), "-o", none, "--json"]);
    assert_eq!((code, &error["kind"], &error["path"]), (1, &"malformed".into(), &text(&scan).into()));
    assert_eq!(error["line"], 10);
    assert!(printed.contains("after 1 scan,") && printed.contains("malformed: line 10: "), "{printed}");
    assert_eq!(printed.matches("line 10").count(), 1, "{printed}");

    // Without --json standard output is empty; also for an invalid command line.
    for (arguments, code) in [(&["info", "/no/map"][..], 1), (&["info", map, "--json", "--never"], 2)] {
        let run = voxtile(arguments).assert().failure();
        let run = run.get_output();
        assert_eq!((run.status.code(), run.stdout.len()), (Some(code), 0), "{arguments:?}");
        assert!(!run.stderr.is_empty());
    }
    // The exported file is on standard output, so the error object is on standard error.
    let no_map = &format!("{none}/no_map");
    let run = voxtile(&["export", no_map, "-o", "-", "--format", "csv", "--json"]).assert().failure();
    let run = run.get_output();
    let printed = String::from_utf8(run.stderr.clone()).unwrap();
    let error: Value = serde_json::from_str(printed.lines().last().unwrap()).unwrap();
    assert!(run.stdout.is_empty() && printed.starts_with("voxtile: "), "{printed}");
    assert_eq!((&error["version"], &error["error"]["kind"]), (&1.into(), &"no_map".into()));
}

#[test]
fn a_failure_reports_file_tile_and_offset_of_damage() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let map = folder.path().join("map");
    output(&["build", text(&scans), "-o", text(&map)]);
    let table = map.join("tile_0_0_0/iwlo_meta.bin");
    fs::write(&table, b"OLWI").unwrap();
    let (code, error, printed) = failed(&["digest", text(&map), "--json"]);
    assert_eq!((code, &error["kind"]), (1, &"damaged".into()));
    assert_eq!(error["path"], text(&table));
    assert_eq!(error["tile"], serde_json::json!([0, 0, 0]));
    assert!(error["offset"].is_number());
    assert!(printed.contains("`voxtile repair`") && printed.contains("offset "), "{printed}");
    // Damage is the result of verify, not an error.
    let run = voxtile(&["verify", text(&map), "--json"]).assert().code(1);
    let report: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!((&report["whole"], report.get("error")), (&false.into(), None));
}

#[test]
fn every_kind_of_error_is_explained() {
    let page = testkit::support::repository("docs/json.md");
    let page = fs::read_to_string(page).unwrap();
    let source = testkit::support::repository("src/error.rs");
    let source = fs::read_to_string(source).unwrap();
    let kinds = source.split("pub fn kind").nth(1).unwrap().split("    }\n\n").next().unwrap();
    let kinds: Vec<&str> = kinds.split('"').skip(1).step_by(2).collect();
    assert!(kinds.len() > 10);
    for kind in kinds.into_iter().chain(["other"]) {
        assert!(page.contains(&format!("\n| `{kind}` |")), "docs/json.md has no {kind}");
    }
}
