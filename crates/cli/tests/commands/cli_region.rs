use crate::cli::{failure, json, output, scans, text, voxtile};
use std::path::Path;
use tempfile::TempDir;

const WEST: [&str; 7] = ["--region", "-inf", "-inf", "-inf", "3.1", "inf", "inf"];
const SOUTH_EAST: [&str; 7] = ["--region", "3.1", "-inf", "-inf", "inf", "-0.4", "inf"];
const NORTH_EAST: [&str; 7] = ["--region", "3.1", "-0.4", "-inf", "inf", "inf", "inf"];

fn build<'a>(scans: &'a Path, map: &'a str, how: &[&'a str]) -> Vec<&'a str> {
    [&["build", text(scans), "-o", map, "--tile-size", "1"], how].concat()
}

fn digest(map: &str) -> String {
    output(&["digest", map])
}

#[test]
fn maps_of_adjacent_regions_merge_to_the_whole_map() {
    let modes: [&[&str]; 4] = [&[], &["--insert", "per-ray"], &["--sensor-model", "iwlo"], &["--no-rays"]];
    for mode in modes {
        let folder = TempDir::new().unwrap();
        let scans = scans(&folder);
        let path = |name: &str| text(&folder.path().join(name)).to_owned();
        let whole = path("whole");
        output(&build(&scans, &whole, mode));
        let parts = ["west", "south_east", "north_east"].map(path);
        for (part, region) in parts.iter().zip([WEST, SOUTH_EAST, NORTH_EAST]) {
            let built = json(&build(&scans, part, &[mode, &region, &["--json"]].concat()));
            assert_eq!(built["points"], 126, "{mode:?}");
            assert_eq!(built["scan_number"], 3);
            // Tiles centered at 2.5 m are in the western part, those at 3.5 m in the eastern part.
            assert_eq!(json(&["info", part, "--json"])["region_tiles"], built["region_tiles"]);
            assert!(output(&["info", part]).contains("region       whole tiles: x "));
            let (bound, index) = if *part == parts[0] { ("max", 2) } else { ("min", 3) };
            assert_eq!(built["region_tiles"][bound][0], index);
        }
        let merged = path("merged");
        let reported = json(&["merge", &parts[0], &parts[1], &parts[2], "-o", &merged, "--json"]);
        assert_eq!(reported["is_one_build"], true);
        assert_eq!(digest(&merged), digest(&whole), "{mode:?}");
        let [merged, whole] = [merged, whole].map(|map| json(&["info", &map, "--json"]));
        for same in ["scan_number", "inputs", "voxels", "occupied", "region_tiles"] {
            assert_eq!(merged[same], whole[same], "{same}");
        }
        assert!(merged["map_id"] != whole["map_id"]);
    }
}

#[test]
fn the_summary_prints_the_tiles_of_a_region() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("map"));
    let box_m = ["--region", "0.4", "-1.6", "-inf", "3.6", "1", "1.5"];
    let reported = output(&build(&scans, text(&map), &box_m));
    assert!(reported.contains("region    whole tiles: x 0 to 4, y -2 to 1, z -inf to 1 m"), "{reported}");
}

/// Runs `does` while the last scan is missing.
fn before_the_last_scan(scans: &Path, does: impl FnOnce()) {
    let (last, poses) = (scans.join("002.pcd"), scans.join("poses_kitti.txt"));
    let [scan, all_poses] = [&last, &poses].map(|path| std::fs::read_to_string(path).unwrap());
    std::fs::remove_file(&last).unwrap();
    let first_poses: String = all_poses.lines().take(2).flat_map(|line| [line, "\n"]).collect();
    std::fs::write(&poses, first_poses).unwrap();
    does();
    std::fs::write(&last, scan).unwrap();
    std::fs::write(&poses, all_poses).unwrap();
}

#[test]
fn a_build_resumes_on_the_merged_map_of_its_regions() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let [west, south_east, north_east, east, merged] =
        ["west", "south_east", "north_east", "east", "merged"].map(path);
    before_the_last_scan(&scans, || {
        output(&build(&scans, &west, &WEST));
        output(&build(&scans, &south_east, &SOUTH_EAST));
        output(&build(&scans, &north_east, &NORTH_EAST));
    });
    // Two of three parts that form a box: a map of that region.
    output(&["merge", &south_east, &north_east, "-o", &east]);
    let reported = output(&["merge", &east, &west, "-o", &merged]);
    assert!(reported.contains("scans     those of each map"), "{reported}");
    assert_eq!(output(&["scans", &merged]).lines().count(), output(&["scans", &west]).lines().count());
    output(&build(&scans, &merged, &["--resume"]));
    let at_once = path("at_once");
    output(&build(&scans, &at_once, &[]));
    assert_eq!(digest(&merged), digest(&at_once));
    assert!(output(&["verify", &merged]).contains("intact"));

    // Regions that form no box, or of different scan numbers, merge like unrelated maps.
    let is_other = |name: &str, parts: [&str; 2]| {
        let other = json(&["merge", parts[0], parts[1], "-o", &path(name), "--json"]);
        assert_eq!(other["is_one_build"], false, "{name}");
        assert_eq!(json(&["info", &path(name), "--json"])["scan_number"], 0);
    };
    is_other("apart", [&west, &north_east]);
    output(&build(&scans, &west, &["--resume"]));
    is_other("uneven", [&west, &east]);
}

#[test]
fn a_map_of_a_region_resumes_only_with_its_region() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("map"));
    before_the_last_scan(&scans, || drop(output(&build(&scans, text(&map), &WEST))));
    let (code, message) = failure(&build(&scans, text(&map), &[&["--resume"], &NORTH_EAST[..]].concat()));
    assert_eq!(code, 2, "{message}");
    assert!(message.contains("been built of tiles"), "{message}");
    output(&build(&scans, text(&map), &["--resume"]));
    let at_once = folder.path().join("at_once");
    output(&build(&scans, text(&at_once), &WEST));
    assert_eq!(digest(text(&map)), digest(text(&at_once)));
}

#[test]
fn a_region_without_a_tile_is_refused() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("map"));
    let regions: [[&str; 6]; 3] = [
        ["0.6", "0", "0", "1.4", "1", "1"],
        ["1", "0", "0", "0", "1", "1"],
        ["nan", "0", "0", "1", "1", "1"],
    ];
    for region in regions {
        let (code, message) = failure(&build(&scans, text(&map), &[&["--region"], &region[..]].concat()));
        assert_eq!(code, 2, "{message}");
        assert!(message.contains("--region") && !map.exists(), "{message}");
    }
    voxtile(&build(&scans, text(&map), &["--region", "0", "0"])).assert().code(2);
}

/// After removed scans or points, or a replay, parts of one build merge like unrelated maps, because their scans may have other
/// poses.
#[test]
fn changed_parts_are_no_parts_of_one_build() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let poses = std::fs::read_to_string(scans.join("poses_kitti.txt")).unwrap();
    let turned: Vec<String> = poses
        .lines()
        .map(|row| {
            let row: Vec<&str> = row.split_whitespace().collect();
            format!("0 -1 0 {} 1 0 0 {} 0 0 1 {}", row[3], row[7], row[11])
        })
        .collect();
    let turned_poses = path("turned.txt");
    std::fs::write(&turned_poses, turned.join("\n") + "\n").unwrap();
    let change = |number: usize, one: &str, other: &str| match number {
        0 => drop(output(&["remove-scans", one, "--scans", "2"])),
        1 => drop(output(&["remove-points", one, "--region", "0", "-9", "-9", "9", "9", "9"])),
        _ => {
            output(&["remap", one, "--poses", text(&scans.join("poses_kitti.txt"))]);
            output(&["remap", other, "--poses", &turned_poses]);
        }
    };
    for number in 0..3 {
        let parts = ["south_east", "north_east"].map(|name| path(&format!("{name}_{number}")));
        for (part, region) in parts.iter().zip([SOUTH_EAST, NORTH_EAST]) {
            output(&build(&scans, part, &[&region[..], &["--keep-scans"]].concat()));
        }
        let merged = |name: &str| {
            let merged = path(&format!("{name}_{number}"));
            json(&["merge", &parts[0], &parts[1], "-o", &merged, "--json"])
        };
        let before = merged("before");
        assert_eq!(before["is_one_build"], true);
        assert!(before["keeps_scans"] == true && before["warnings"] == serde_json::json!([]), "{before}");
        change(number, &parts[0], &parts[1]);
        let after = merged("after");
        assert!(after["is_one_build"] == false && after["keeps_scans"] == false, "{number}: {after}");
        // A warning is printed, so that the user does not delete the parts.
        let warnings = after["warnings"].as_array().unwrap();
        assert!(warnings.len() == 2 && warnings[0].as_str().unwrap().contains("keeps its scans"), "{after}");
    }
}

#[test]
fn merged_regions_keep_the_scans_of_the_whole_build() {
    for mode in [&[][..], &["--clearing", "guarded"], &["--storage", "compact"]] {
        let folder = TempDir::new().unwrap();
        let scans = scans(&folder);
        let path = |name: &str| text(&folder.path().join(name)).to_owned();
        let keep = [mode, &["--keep-scans"]].concat();
        let (whole, merged) = (path("whole"), path("merged"));
        output(&build(&scans, &whole, &keep));
        let parts = ["west", "south_east", "north_east"].map(path);
        for (part, region) in parts.iter().zip([WEST, SOUTH_EAST, NORTH_EAST]) {
            output(&build(&scans, part, &[&keep[..], &region].concat()));
        }
        let reported = json(&["merge", &parts[0], &parts[1], &parts[2], "-o", &merged, "--json"]);
        assert!(reported["is_one_build"] == true && reported["keeps_scans"] == true, "{reported}");
        output(&["verify", &merged]);
        // The same list of scans, with the same tiles and updates, and the same points.
        let list = |map: &str| {
            let mut list = json(&["scans", map, "--json"]);
            list["map"] = serde_json::Value::Null;
            list
        };
        assert_eq!(list(&merged), list(&whole), "{mode:?}");
        // Both follow other poses and forget scans alike.
        let poses = path("poses.txt");
        let moved = "1 0 0 0.3 0 1 0 -0.2 0 0 1 0.1\n0 -1 0 1 1 0 0 0 0 0 1 0\n1 0 0 2 0 1 0 0 0 0 1 0\n";
        std::fs::write(&poses, moved).unwrap();
        for map in [&merged, &whole] {
            output(&["remap", map, "--poses", &poses]);
        }
        assert_eq!(digest(&merged), digest(&whole), "{mode:?}");
        for map in [&merged, &whole] {
            output(&["remove-scans", map, "--scans", "2"]);
        }
        assert_eq!(digest(&merged), digest(&whole), "{mode:?}");
        assert_eq!(list(&merged), list(&whole), "{mode:?}");
    }
}
