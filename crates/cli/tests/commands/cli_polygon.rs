use super::cli::{failure, json, output, text};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn digest(map: &Path) -> String {
    output(&["digest", text(map)]).split(' ').next().unwrap().to_owned()
}

/// Builds a map of a floor of voxels of 0.25 m, from -4 to 4 m at a height of 0.1 m, and a ceiling at 3.1 m.
fn floor(folder: &TempDir) -> PathBuf {
    let (points, map) = (folder.path().join("floor.xyz"), folder.path().join("map"));
    let grid = (0..32).flat_map(|x| (0..32).map(move |y| (x, y)));
    let rows =
        grid.flat_map(|(x, y)| [0.1, 3.1].map(|z| (0.25 * f64::from(x) - 3.9, 0.25 * f64::from(y) - 3.9, z)));
    let text_of = |(x, y, z): (f64, f64, f64)| format!("{x} {y} {z}\n");
    fs::write(&points, rows.map(text_of).collect::<String>()).unwrap();
    let options = ["--no-rays", "--poses", "identity", "--resolution", "0.25", "--tile-size", "2"];
    output(&[&["build", text(&points), "-o", text(&map)][..], &options].concat());
    map
}

fn polygon(folder: &TempDir, name: &str, coordinates: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, format!(r#"{{"type": "Polygon", "coordinates": {coordinates}}}"#)).unwrap();
    path
}

fn cropped(folder: &TempDir, map: &Path, name: &str, options: &[&str]) -> (PathBuf, u64) {
    let part = folder.path().join(name);
    let summary = json(&[&["crop", text(map), "-o", text(&part), "--json"][..], options].concat());
    (part, summary["voxels"].as_u64().unwrap())
}

#[test]
fn crops_keep_the_voxels_in_the_polygons() {
    let folder = TempDir::new().unwrap();
    let map = floor(&folder);
    let square = polygon(&folder, "square.geojson", "[[[-1, -2], [3, -2], [3, 3.5], [-1, 3.5], [-1, -2]]]");
    let (by_polygon, voxels) = cropped(&folder, &map, "by polygon", &["--polygon", text(&square)]);
    let (by_box, _) = cropped(&folder, &map, "by box", &["--region", "-1", "-2", "-9", "3", "3.5", "9"]);
    assert_eq!((digest(&by_polygon), voxels), (digest(&by_box), 16 * 22 * 2));
    let low = ["--polygon", text(&square), "--z", "-inf", "1"];
    assert_eq!(cropped(&folder, &map, "low", &low).1, 16 * 22);
    let (rest, _) = cropped(&folder, &map, "rest", &[&low[..], &["--outside"]].concat());
    let whole = folder.path().join("whole");
    output(&[
        "merge",
        text(&folder.path().join("low")),
        text(&rest),
        "-o",
        text(&whole),
        "--prefer",
        "first",
    ]);
    assert_eq!(digest(&whole), digest(&map));
    // A hole, and a triangle whose oblique edges pass between the centers.
    let hole = polygon(
        &folder,
        "hole.geojson",
        "[[[-4, -4], [4, -4], [4, 4], [-4, 4]], [[-2, -2], [2, -2], [-2, 2]]]",
    );
    let in_hole = (0..16).map(|row| 15 - row).sum::<u64>();
    assert_eq!(cropped(&folder, &map, "hole", &["--polygon", text(&hole)]).1, 2 * (32 * 32 - in_hole));
    // A polygon that contains no part of the map gives an empty map.
    let elsewhere = polygon(&folder, "elsewhere.geojson", "[[[500, 500], [510, 500], [500, 510]]]");
    assert_eq!(cropped(&folder, &map, "elsewhere", &["--polygon", text(&elsewhere)]).1, 0);
}

#[test]
fn mistakes_in_polygons_are_named() {
    let folder = TempDir::new().unwrap();
    let map = floor(&folder);
    let (new, empty) = (folder.path().join("new"), folder.path().join("empty.geojson"));
    fs::write(&empty, "").unwrap();
    let square = polygon(&folder, "square.geojson", "[[[-1, -2], [3, -2], [3, 3.5]]]");
    let degrees = polygon(&folder, "degrees.geojson", "[[[13.1, 52.1], [13.2, 52.1], [13.2, 52.2]]]");
    let line = folder.path().join("line.geojson");
    fs::write(&line, r#"{"type": "LineString", "coordinates": [[0, 0], [1, 1]]}"#).unwrap();
    let cases: [(&[&str], i32, &str); 7] = [
        (&["--polygon", text(&empty)], 2, "empty.geojson: is empty"),
        (&["--polygon", text(&line)], 2, "has a LineString; a Polygon"),
        (&["--polygon", "nowhere.geojson"], 1, "nowhere.geojson"),
        (&["--polygon", text(&degrees)], 2, "look like longitude and latitude"),
        (&["--polygon", text(&square), "--z", "2", "1"], 2, "between 2 and 1 m"),
        (&["--z", "0", "1"], 2, "--polygon"),
        (&[], 2, "--region"),
    ];
    for (options, expected_code, expected) in cases {
        let (code, message) = failure(&[&["crop", text(&map), "-o", text(&new)][..], options].concat());
        assert!(code == expected_code && message.contains(expected), "{options:?}: {code} {message}");
        assert!(!new.exists());
    }
}
