//! `voxtile view` follows flushes, and serves snapshots and changes.

use crate::cli_compare::wall_at;
use crate::viewer::{PATIENCE, TOKEN, Viewer, a_map, build, exported, run, text};
use assert_cmd::cargo::cargo_bin;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use tempfile::TempDir;

#[test]
fn a_flush_is_announced_and_changes_only_its_nodes() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let mut events = viewer.connect();
    events
        .write_all(format!("GET /{TOKEN}/events HTTP/1.1\r\nhost: {}\r\n\r\n", viewer.address).as_bytes())
        .unwrap();
    let mut events = BufReader::new(events).lines();
    let mut next = move || {
        events.find_map(|line| line.unwrap().strip_prefix("data: {\"generation\"").map(str::to_owned))
    };
    let first = next().unwrap();
    let before: BTreeSet<String> = viewer.nodes("0").into_iter().collect();
    build(folder.path(), &map, 3..5);
    assert_ne!(next().unwrap(), first);
    let wanted = exported(folder.path(), text(&map));
    viewer.wait(|maps| maps[0]["scans"] == 5 && maps[0]["pending_tiles"] == 0);
    let since = Instant::now();
    while viewer.finest("0").iter().map(|(voxel, _)| *voxel).collect::<BTreeSet<_>>() != wanted {
        assert!(since.elapsed() < PATIENCE);
    }
    let after: BTreeSet<String> = viewer.nodes("0").into_iter().collect();
    let finest = |nodes: &BTreeSet<String>| {
        nodes.iter().filter(|path| path.contains("/node/0/")).cloned().collect::<BTreeSet<_>>()
    };
    let (before, after) = (finest(&before), finest(&after));
    assert!(after.difference(&before).count() > 0);
    assert!(after.intersection(&before).count() > 0, "unchanged tiles have new versions");
}

#[test]
fn snapshots_and_changes_since_them_are_shown() {
    let (folder, map) = a_map();
    let before = exported(folder.path(), text(&map));
    run(&["snapshot", text(&map), "monday"]);
    build(folder.path(), &map, 3..4);
    // One wall was removed, one added.
    run(&["clear", text(&map), "--region", "3", "-5", "-1", "5", "5", "3", "-q"]);
    let after = exported(folder.path(), text(&map));
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    assert_eq!(viewer.json("maps.json")["maps"][0]["snapshots"][0]["name"], "monday");
    let shown = |id: &str| viewer.finest(id).into_iter().map(|(voxel, _)| voxel).collect::<BTreeSet<_>>();
    assert_eq!(shown("0@monday"), before);
    let mut change = viewer.finest("0~monday");
    change.sort_unstable();
    let wanted: Vec<([i64; 3], u8)> = before
        .union(&after)
        .map(|voxel| {
            (
                *voxel,
                if !before.contains(voxel) {
                    1
                } else if !after.contains(voxel) {
                    2
                } else {
                    3
                },
            )
        })
        .collect();
    assert!([1, 2, 3].iter().all(|value| wanted.iter().any(|(_, found)| found == value)));
    assert_eq!(change, wanted);
    assert_eq!(viewer.get("maps/0@tuesday/tileset.json").status, 404);
    // Show a snapshot without its map.
    let path = PathBuf::from(format!("{}@monday", map.display()));
    let viewer = Viewer::ready(&[&path], &folder.path().join("cache"));
    assert_eq!(viewer.finest("0").into_iter().map(|(voxel, _)| voxel).collect::<BTreeSet<_>>(), before);
}

/// The nodes contain exactly the voxels that `compare -o --all` writes, with their classes.
#[test]
fn changes_between_two_maps_are_shown_by_class() {
    let folder = TempDir::new().unwrap();
    let [before, after] =
        [("before", 2.05), ("after", 4.05)].map(|(name, x)| wall_at(folder.path(), name, x, 0.1, None));
    let file = folder.path().join("all.csv");
    let compared = run(&["compare", text(&before), text(&after), "-o", text(&file), "--all", "--json"]);
    let compared: Value = serde_json::from_str(&compared).unwrap();
    let table = fs::read_to_string(&file).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let class = header.iter().position(|name| name.starts_with("class")).unwrap();
    let written = table.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let center = [0, 1, 2].map(|k| (1000.0 * cells[k].parse::<f64>().unwrap()).round() as i64);
        (center, 1 << (cells[class].parse::<u8>().unwrap() - 64))
    });
    let viewer = Viewer::ready(&[&before, Path::new("--compare"), &after], folder.path());
    let shown: BTreeSet<([i64; 3], u8)> = viewer.finest("1~~0").into_iter().collect();
    assert_eq!(shown, written.collect());
    assert_eq!(shown.len(), 50);
    let listed = viewer.json("maps/1~~0/changes.json");
    assert_eq!((&listed["changes"], &listed["all"]), (&compared["changes"], &1.into()));
    let described = &viewer.json("maps.json")["comparison"];
    let counts = described["classes"].as_array().unwrap().iter();
    let counts: Vec<(&str, u64)> =
        counts.map(|class| (class["name"].as_str().unwrap(), class["voxels"].as_u64().unwrap())).collect();
    assert_eq!(counts[..4], [("unchanged", 0), ("appeared", 0), ("vanished", 9), ("not_seen_before", 25)]);
    assert_eq!(counts[4..], [("not_seen_after", 0), ("uncertain_appeared", 0), ("uncertain_vanished", 16)]);
    // Each map is shown as well; other pairs are not compared.
    assert_eq!((viewer.finest("0").len(), viewer.finest("1").len()), (25, 25));
    for path in
        ["maps/0~~1/tileset.json", "maps/1~~1/tileset.json", "maps/0/changes.json", "maps/1~~7/changes.json"]
    {
        assert_eq!(viewer.get(path).status, 404, "{path}");
    }
    for (arguments, part) in [
        (&[text(&before), text(&after), "--compare", text(&after)][..], "--compare: needs exactly two maps"),
        (&[text(&before), "--tolerance", "0.1"], "--compare"),
        (
            &[text(&before), "--compare", text(&after), "--tolerance", "9"],
            "--tolerance: must be from 0 to 1.6 m",
        ),
    ] {
        let failed = Command::new(cargo_bin("voxtile")).arg("view").args(arguments).output().unwrap();
        let message = String::from_utf8_lossy(&failed.stderr).into_owned();
        assert!(failed.status.code() == Some(2) && message.contains(part), "{message}");
    }
}

#[test]
fn a_recreated_snapshot_replaces_the_old_one() {
    let (folder, map) = a_map();
    let before = exported(folder.path(), text(&map));
    run(&["snapshot", text(&map), "monday"]);
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let shown = || viewer.finest("0@monday").into_iter().map(|(voxel, _)| voxel).collect::<BTreeSet<_>>();
    assert_eq!(shown(), before);
    run(&["snapshot", text(&map), "monday", "--delete"]);
    assert_eq!(viewer.get("maps/0@monday/tileset.json").status, 404);
    run(&["snapshot", text(&map), "monday"]);
    assert_eq!(shown(), before);
    run(&["snapshot", text(&map), "monday", "--delete"]);
    build(folder.path(), &map, 3..4);
    run(&["snapshot", text(&map), "monday"]);
    let after = exported(folder.path(), text(&map));
    assert_ne!(after, before);
    assert_eq!(shown(), after);
}

/// A request for one snapshot does not read the list of all.
#[test]
fn snapshots_are_not_read_for_every_request() {
    let (folder, map) = a_map();
    for number in 0..20 {
        run(&["snapshot", text(&map), &format!("day{number}")]);
    }
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let ask = || assert_eq!(viewer.get("maps/0@day7/tileset.json").status, 200);
    ask();
    let before = viewer.bytes_read();
    (0..50).for_each(|_| ask());
    let per_request = (viewer.bytes_read() - before) / 50;
    let snapshot = fs::metadata(map.join("snapshots/day7")).unwrap().len();
    assert!(per_request < 10 * snapshot, "{per_request} bytes, and a snapshot has {snapshot}");
}

#[test]
fn the_cache_is_reused_and_its_damage_has_no_effect() {
    let (folder, map) = a_map();
    let cache = folder.path().join("cache");
    let wanted: BTreeSet<(String, Vec<u8>)> = {
        let viewer = Viewer::ready(&[&map], &cache);
        viewer.nodes("0").into_iter().map(|path| (path.clone(), viewer.get(&path).body)).collect()
    };
    let kept = fs::read_dir(cache.join("voxtile")).unwrap().next().unwrap().unwrap().path();
    let bytes = fs::read(&kept).unwrap();
    let shown = |viewer: &Viewer| -> BTreeSet<(String, Vec<u8>)> {
        viewer.nodes("0").into_iter().map(|path| (path.clone(), viewer.get(&path).body)).collect()
    };
    {
        // Two at once: the second does not write to the cache.
        let (one, other) = (Viewer::ready(&[&map], &cache), Viewer::ready(&[&map], &cache));
        assert_eq!((shown(&one), shown(&other)), (wanted.clone(), wanted.clone()));
    }
    assert_eq!(fs::read(&kept).unwrap(), bytes, "the cache file must not change");
    for damaged in
        [bytes[..bytes.len() / 2].to_vec(), bytes.iter().map(|byte| byte ^ 0x20).collect(), Vec::new()]
    {
        fs::write(&kept, damaged).unwrap();
        assert_eq!(shown(&Viewer::ready(&[&map], &cache)), wanted);
    }
    let mut flipped = bytes.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 0x10;
    fs::write(&kept, flipped).unwrap();
    assert_eq!(shown(&Viewer::ready(&[&map], &cache)), wanted);
}
