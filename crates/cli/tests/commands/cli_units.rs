//! Exports in feet and in other coordinate systems.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;

fn voxtile(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = Command::cargo_bin("voxtile").unwrap().current_dir(folder).args(arguments).output().unwrap();
    match output.status.success() {
        true => Ok(String::from_utf8(output.stdout).unwrap()),
        false => Err(String::from_utf8(output.stderr).unwrap()),
    }
}

/// Options of builds from points without rays. Builds also look for poses next to the folder, where other tests may have
/// files.
const HITS: [&str; 5] = ["--resolution", "0.5", "--no-rays", "--poses", "identity"];

/// Makes a map of points near a corner of California's zone 5, which `EPSG:2229` describes in US survey feet.
fn make_map(folder: &Path) {
    let points: Vec<String> = (0..300)
        .map(|k| {
            format!(
                "{} {} {}",
                1_970_000.25 + f64::from(k % 20),
                560_000.25 + f64::from(k / 20),
                0.2 * f64::from(k)
            )
        })
        .collect();
    fs::write(folder.join("points.xyz"), points.join("\n")).unwrap();
    voxtile(folder, &[&["build", "points.xyz", "-o", "map", "-q"][..], &HITS].concat()).unwrap();
}

fn csv(folder: &Path, map: &str) -> String {
    voxtile(folder, &["export", map, "-o", "-", "--format", "csv", "-q"]).unwrap()
}

#[test]
fn files_in_feet_give_the_same_map() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    make_map(folder);
    let expected = csv(folder, "map");
    for (name, options) in [
        ("a.laz", &["--crs", "EPSG:2229"][..]),
        ("b.copc.laz", &["--crs", "EPSG:2229", "--unit", "us-ft"]),
        ("c.las", &["--crs", "PROJCS[\"own\",UNIT[\"foot\",0.3048]]"]),
    ] {
        voxtile(folder, &[&["export", "map", "-o", name], options].concat()).unwrap();
        let build = [&["build", name, "-o", "again", "--json"][..], &HITS].concat();
        let summary: Value = serde_json::from_str(&voxtile(folder, &build).unwrap()).unwrap();
        let remarks = summary["remarks"].to_string();
        assert!(remarks.contains("coordinates are converted to metres: x and y times 0.3048"), "{remarks}");
        assert_eq!(csv(folder, "again"), expected, "{name}");
        fs::remove_dir_all(folder.join("again")).unwrap();
    }
    voxtile(folder, &["export", "map", "-o", "feet.xyz", "--unit", "ft"]).unwrap();
    let text = fs::read_to_string(folder.join("feet.xyz")).unwrap();
    let x: f64 = text.split_whitespace().next().unwrap().parse().unwrap();
    assert!((x - 1_970_000.25 / 0.3048).abs() < 100.0, "{x}");
}

#[test]
fn contradictory_units_and_systems_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    make_map(folder);
    let refused = |options: &[&str]| {
        let arguments = [&["export", "map", "-o"], options].concat();
        voxtile(folder, &arguments).unwrap_err()
    };
    for (options, expected) in [
        (
            &["a.laz", "--crs", "EPSG:2229", "--unit", "m"][..],
            "--unit: m, but the unit of EPSG:2229 is us-ft",
        ),
        (&["a.laz", "--crs", "GEOGCS[\"x\",UNIT[\"degree\",0.01745]]"], "degrees"),
        (&["a.ply", "--unit", "ft"], "--unit: ply does not support it"),
        (&["a.e57", "--crs", "EPSG:2229"], "--crs: e57 does not support it"),
        (&["a.laz", "--unit", "yd"], "possible values: m, ft, us-ft"),
    ] {
        let message = refused(options);
        assert!(message.contains(expected), "{options:?}: {message}");
    }
    // The map names a system in metres.
    voxtile(folder, &["export", "map", "-o", "utm.laz", "--crs", "EPSG:25832"]).unwrap();
    voxtile(folder, &[&["build", "utm.laz", "-o", "utm", "-q"][..], &HITS].concat()).unwrap();
    let message = voxtile(folder, &["export", "utm", "-o", "a.laz", "--unit", "ft"]).unwrap_err();
    assert!(message.contains("the coordinate system of the map is in metres (EPSG:25832)"), "{message}");
    assert!(!folder.join("a.laz").exists());
}
