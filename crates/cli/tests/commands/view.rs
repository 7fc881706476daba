//! `voxtile view` serves exactly the map.

use crate::cli::map_with_a_passer_by;
use crate::viewer::{PATIENCE, Viewer, a_map, exported, run, text};
use assert_cmd::cargo::cargo_bin;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

#[test]
fn the_server_shows_the_map() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let shown = viewer.finest("0");
    let wanted = exported(folder.path(), text(&map));
    assert_eq!(shown.len(), wanted.len());
    assert_eq!(shown.iter().map(|(voxel, _)| *voxel).collect::<BTreeSet<_>>(), wanted);
    // Browsers cache only URLs with a version.
    let node = &viewer.nodes("0")[0];
    let (path, version) = node.split_once("?v=").unwrap();
    assert!(viewer.get(node).head.contains("immutable"));
    let other = format!("{:016x}", u64::from_str_radix(version, 16).unwrap() ^ 1);
    for path in [path.to_owned(), format!("{path}?v={other}"), format!("{path}?v=x")] {
        assert!(viewer.get(&path).head.contains("no-store"), "{path}");
    }
    // The coarsest nodes are available at once: few, around the whole map.
    let tops: u64 = viewer.nodes("0").iter().filter(|path| !path.contains("/node/0/")).count() as u64;
    assert!(tops > 0);
    for voxel in wanted.iter().step_by(101) {
        let [x, y, z] = voxel.map(|c| c as f64 / 1000.0);
        let answer = viewer.json(&format!("maps/0/query?x={x}&y={y}&z={z}"));
        let line = run(&["query", text(&map), &x.to_string(), &y.to_string(), &z.to_string(), "--json"]);
        let wanted: Value = serde_json::from_str(&line).unwrap();
        for (name, value) in wanted.as_object().unwrap() {
            assert_eq!(answer[name], *value, "{name}");
        }
        assert_eq!(answer["state"], "occupied");
        let low = answer["voxel_m"]["min"][0].as_f64().unwrap();
        assert!(low < x && x < answer["voxel_m"]["max"][0].as_f64().unwrap());
    }
    let way = viewer.json("maps/0/trajectory.json");
    assert_eq!(way["points"], serde_json::json!([[0.0, 0.0, 1.0], [12.0, 0.0, 1.0], [24.0, 0.0, 1.0]]));
    // From the first position to its wall, and beyond it.
    assert_eq!(viewer.json("maps/0/raycast?from=0,0,1&to=3.5,0,1.5")["visible"], true);
    assert_eq!(viewer.json("maps/0/raycast?from=0,0,1&to=4.05,0.02,1.55")["visible"], true);
    let beyond = viewer.json("maps/0/raycast?from=0,0,1.55&to=6,0,1.55");
    assert_eq!(beyond["visible"], false);
    assert!((beyond["hit"]["distance_m"].as_f64().unwrap() - 4.0).abs() < 0.2, "{beyond}");
}

#[test]
fn rooms_are_cut_halfway_to_the_ceiling() {
    let (folder, open) = a_map();
    let (scans, room) = (folder.path().join("room_scans"), folder.path().join("room"));
    fs::create_dir(&scans).unwrap();
    let grid = (0..3600).map(|k| [0.1 * f64::from(k % 60) - 2.95, 0.1 * f64::from(k / 60) - 2.95]);
    let rows = grid.flat_map(|[x, y]| {
        [format!("{x} {y} -1.25\n"), format!("{x} {y} 1.35\n"), format!("{x} 3.05 0.05\n")]
    });
    fs::write(scans.join("0.xyz"), rows.collect::<String>()).unwrap();
    fs::write(scans.join("poses_tum.txt"), "0 0 0 1.2 0 0 0 1\n").unwrap();
    run(&["build", text(&scans), "-o", text(&room), "--resolution", "0.1", "-q"]);
    run(&["snapshot", text(&room), "monday", "-q"]);
    let picture = folder.path().join("room.png");
    assert!(run(&["picture", text(&room), "-o", text(&picture)]).contains("ceiling cut at 1.20 m"));

    let viewer = Viewer::ready(&[&room, &open], &folder.path().join("cache"));
    let overview = viewer.json("maps/0/overview.json");
    // The sensor is at 1.2 m, the voxels of the ceiling begin at 2.5 m.
    assert_eq!(overview["ceiling_m"], 1.85);
    assert_eq!(viewer.json("maps/0@monday/overview.json"), overview);
    assert_eq!(viewer.get("maps/0@none/overview.json").status, 404);
    let overview = viewer.json("maps/1/overview.json");
    assert_eq!(overview["ceiling_m"], Value::Null);
    let mut heights: Vec<i64> = exported(folder.path(), text(&open)).into_iter().map(|[_, _, z]| z).collect();
    heights.sort_unstable();
    let left_out = heights.len() / 50;
    let ends = [heights[left_out] - 50, heights[heights.len() - 1 - left_out] + 50];
    for (k, end) in ends.into_iter().enumerate() {
        let height_m = overview["heights_m"][k].as_f64().unwrap();
        assert_eq!((1000.0 * height_m).round() as i64, end, "{overview}");
    }
}

/// The layer of a node follows its voxels; the page asks for it by name.
#[test]
fn layers_are_served_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = String::from("x,y,z,r,g,b,class\n");
    for (x, y) in (0..300).flat_map(|x| (0..30).map(move |y| (x, y))) {
        let attributes = if x < 100 { "250,20,10,6" } else { "20,80,220,2" };
        rows += &format!("{},{},0.05,{attributes}\n", 0.05 + 0.1 * f64::from(x), 0.05 + 0.1 * f64::from(y));
    }
    let (cloud, map) = (folder.path().join("floor.csv"), folder.path().join("coloured"));
    fs::write(&cloud, rows).unwrap();
    let options = ["--no-rays", "--resolution", "0.1", "-q"];
    run(&[&["build", text(&cloud), "-o", text(&map), "--layers", "colour,class"][..], &options].concat());
    let plain = folder.path().join("plain");
    run(&[&["build", text(&cloud), "-o", text(&plain)][..], &options].concat());
    let cache = folder.path().join("cache");
    for _ in 0..2 {
        let viewer = Viewer::ready(&[&map, &plain], &cache);
        let maps = viewer.json("maps.json")["maps"].clone();
        assert_eq!(
            (&maps[0]["layers"], &maps[1]["layers"]),
            (&serde_json::json!(["colour", "class"]), &Value::Null)
        );
        let legends = viewer.json("maps/0/layers.json");
        let class = |class: u8, name: &str, voxels: u64| {
            let color = voxtile_render::classes::class_color(class);
            serde_json::json!({"class": class, "name": name, "color": color, "voxels": voxels})
        };
        let classes = [class(2, "ground", 6000), class(6, "building", 3000)];
        assert_eq!(legends["class"]["classes"], serde_json::json!(classes));
        assert!(legends["time"].is_null() && legends["colour"].is_object());
        let mut levels = BTreeSet::new();
        for path in viewer.nodes("0") {
            let [bytes, plain] = ["&layer=colour", ""].map(|layer| {
                let reply = viewer.get(&format!("{path}{layer}"));
                assert!(reply.status == 200 && reply.head.contains("immutable"), "{path}{layer}");
                reply.body
            });
            let count = u32::from_le_bytes(plain[4..8].try_into().unwrap()) as usize;
            assert_eq!((plain[47], bytes[47]), (0, 1));
            assert_eq!((&bytes[..47], &bytes[48..plain.len()]), (&plain[..47], &plain[48..]));
            let planes = &bytes[plain.len()..];
            assert_eq!(planes.len(), 4 * count);
            // The border of the colours is that of two tiles, and of two voxels of the next two levels.
            let colours: BTreeSet<_> =
                (0..count).map(|k| [0, 1, 2, 3].map(|plane| planes[plane * count + k])).collect();
            assert!(
                colours.iter().all(|colour| [[250, 20, 10, 255], [20, 80, 220, 255]].contains(colour)),
                "{colours:?}"
            );
            levels.insert(path.split('/').nth(3).unwrap().to_owned());
        }
        assert!(levels.len() > 1, "{levels:?}");
        let path = viewer.nodes("1")[0].clone();
        assert_eq!(viewer.get(&format!("{path}&layer=class")).status, 400);
        assert_eq!(viewer.get(&format!("{path}&layer=nothing")).status, 404);
    }
}

#[test]
fn metrics_need_the_token_and_follow_the_map() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let metrics = || {
        let reply = viewer.get("metrics");
        assert!(reply.status == 200 && reply.head.contains("text/plain; version=0.0.4"), "{}", reply.head);
        String::from_utf8(reply.body).unwrap()
    };
    let value = |text: &str, sample: &str| -> f64 {
        let line = text.lines().find(|line| line.starts_with(&format!("{sample} ")));
        line.unwrap_or_else(|| panic!("no {sample}: {text}")).rsplit(' ').next().unwrap().parse().unwrap()
    };
    let text = metrics();
    let described = &viewer.json("maps.json")["maps"][0];
    let folder_name = map.file_name().unwrap().to_str().unwrap();
    let of_map = format!("{{map=\"0\",name=\"{folder_name}\"}}");
    for (name, key) in [("voxtile_map_scans", "scans"), ("voxtile_map_tiles", "tiles")] {
        assert_eq!(Some(value(&text, &format!("{name}{of_map}"))), described[key].as_f64());
    }
    let disk_bytes = value(&text, &format!("voxtile_map_disk_bytes{of_map}"));
    let folders = fs::read_dir(&map).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    let files = folders.flat_map(|folder| fs::read_dir(folder).unwrap());
    let on_disk: u64 = files.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(disk_bytes > 0.0 && disk_bytes <= on_disk as f64, "{disk_bytes} {on_disk}");
    let flushed_s = value(&text, &format!("voxtile_map_last_flush_timestamp_seconds{of_map}"));
    let now_s = std::time::UNIX_EPOCH.elapsed().unwrap().as_secs_f64();
    assert!((now_s - 600.0..=now_s).contains(&flushed_s), "{flushed_s}");
    assert!(value(&text, "voxtile_http_connections") >= 1.0);
    // Each sample follows the help and the type of its metric.
    let mut name = "";
    for line in text.lines() {
        match line.strip_prefix("# ").and_then(|line| line.split_once(' ')) {
            Some(("HELP", rest)) => name = rest.split(' ').next().unwrap(),
            Some(("TYPE", rest)) => {
                assert!(rest.starts_with(name) && (rest.ends_with(" counter") == name.ends_with("_total")))
            }
            _ => assert!(line.starts_with(name), "{line}"),
        }
    }
    let before = value(&text, "voxtile_http_responses_total{code=\"200\"}");
    assert_eq!(viewer.get("no_such_file").status, 404);
    let text = metrics();
    assert!(value(&text, "voxtile_http_responses_total{code=\"200\"}") > before);
    assert_eq!(value(&text, "voxtile_http_responses_total{code=\"404\"}"), 1.0);
    let without_token =
        format!("GET /metrics HTTP/1.1\r\nhost: {}\r\nconnection: close\r\n\r\n", viewer.address);
    assert_eq!(viewer.send(&without_token).status, 404);
}

#[test]
fn points_marked_as_moving_are_served() {
    let (folder, other) = a_map();
    let (moved, _) = map_with_a_passer_by(folder.path());
    let viewer = Viewer::ready(&[&moved, &other], &folder.path().join("cache"));
    let (none, before, keeps_scans, points) = viewer.moving("maps/0/moving.bin");
    assert_eq!((none, keeps_scans, points.len()), (0, true, 0));
    assert!(!viewer.moving("maps/1/moving.bin").2, "the other map keeps no scans");

    run(&["clean", text(&moved), "--keep-as", "before", "-q"]);
    let started = Instant::now();
    while viewer.moving("maps/0/moving.bin").0 == 0 {
        assert!(started.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(50));
    }
    let (marked, version, _, points) = viewer.moving("maps/0/moving.bin");
    assert!(marked as usize == points.len() && version != before);
    // The points of the third scan that are nearer than the wall.
    let scan = fs::read_to_string(folder.path().join("scans/2.xyz")).unwrap();
    let parsed = scan.lines().map(|line| {
        let mut numbers = line.split(' ').map(|k| (1000.0 * k.parse::<f64>().unwrap()).round() as i64);
        [0; 3].map(|_| numbers.next().unwrap())
    });
    let passing: BTreeSet<[i64; 3]> = parsed.filter(|[x, ..]| *x < 3000).collect();
    assert!(points.iter().all(|point| passing.contains(point)));
    assert_eq!(points.iter().collect::<BTreeSet<_>>().len(), points.len());
    // A client with these marks gets no points, also of a later state; a snapshot has its own marks.
    let known = format!("maps/0/moving.bin?v={version:016x}");
    assert_eq!(viewer.moving(&known), (marked, version, true, Vec::new()));
    assert_eq!(viewer.moving(&format!("maps/0/moving.bin?v={before:x}")).3.len() as u64, marked);
    viewer.wait(|maps| maps[0]["snapshots"][0]["name"] == "before");
    assert_eq!(viewer.moving("maps/0@before/moving.bin").0, 0);
    assert_eq!(viewer.get("maps/0@none/moving.bin").status, 404);
}

#[test]
fn octomap_files_and_several_maps_are_shown() {
    let (folder, map) = a_map();
    let file = folder.path().join("walls.bt");
    run(&["export", text(&map), "-o", text(&file), "-q"]);
    let viewer = Viewer::ready(&[&map, &file], &folder.path().join("cache"));
    let voxels = |id: &str| viewer.finest(id).into_iter().map(|(voxel, _)| voxel).collect::<BTreeSet<_>>();
    assert_eq!(voxels("1"), voxels("0"));
    assert_eq!(viewer.json("maps.json")["maps"][1]["name"], "walls.bt");
    assert_eq!(viewer.get("maps/2/tileset.json").status, 404);
}

/// Browsers cache nodes forever, so another file at the same address must have other URLs.
#[test]
fn another_octomap_file_has_other_nodes() {
    let (folder, map) = a_map();
    let file = folder.path().join("walls.bt");
    run(&["export", text(&map), "-o", text(&file), "-q"]);
    let nodes = || {
        let viewer = Viewer::ready(&[&file], &folder.path().join("cache"));
        let nodes: BTreeSet<String> = viewer.nodes("0").into_iter().collect();
        assert!(nodes.iter().all(|node| viewer.get(node).head.contains("immutable")));
        nodes
    };
    let before = nodes();
    run(&["clear", text(&map), "--region", "3", "-5", "-1", "4.5", "5", "3", "-q"]);
    run(&["export", text(&map), "-o", text(&file), "-q"]);
    let after = nodes();
    let tiles = |nodes: &BTreeSet<String>| {
        nodes.iter().map(|node| node.split('?').next().unwrap().to_owned()).collect::<BTreeSet<_>>()
    };
    assert!(tiles(&before).intersection(&tiles(&after)).count() > 0);
    assert_eq!(before.intersection(&after).count(), 0);
}

#[test]
fn a_damaged_tile_is_omitted_and_reported() {
    let (folder, map) = a_map();
    let tables = fs::read_dir(&map).unwrap().map(|entry| entry.unwrap().path().join("iwlo_meta.bin"));
    let mut tables: Vec<PathBuf> = tables.filter(|path| path.exists()).collect();
    tables.sort();
    let all = exported(folder.path(), text(&map));
    let mut bytes = fs::read(&tables[0]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&tables[0], bytes).unwrap();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let printed = viewer.json("maps.json")["maps"][0]["unreadable"].to_string();
    let folder_name = tables[0].parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
    assert!(printed.contains(&folder_name), "{printed}");
    let shown = viewer.finest("0").into_iter().map(|(voxel, _)| voxel).collect::<BTreeSet<_>>();
    assert!(shown.len() < all.len() && shown.is_subset(&all));
}

#[test]
fn invalid_inputs_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str]| {
        let output = Command::new(cargo_bin("voxtile")).arg("view").args(arguments).output().unwrap();
        assert!(!output.status.success(), "{arguments:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let nothing = folder.path().join("nothing");
    assert!(refused(&[text(&nothing)]).contains(text(&nothing)));
    let (_folder, map) = a_map();
    assert!(refused(&[text(&map), "--token", "short"]).contains("--token"));
    assert!(refused(&[text(&map), "--listen", "127.0.0.1"]).contains("--listen"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    assert!(
        refused(&[text(&map), "--listen", &taken.local_addr().unwrap().to_string()]).contains("--listen")
    );
}
