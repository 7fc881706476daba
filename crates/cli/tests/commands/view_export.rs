//! `voxtile view --export-page` writes what the server shows.

use crate::viewer::{Viewer, a_map, run, text};
use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns all files below a folder, as paths relative to it.
fn files(folder: &Path) -> BTreeSet<String> {
    let (mut found, mut open) = (BTreeSet::new(), vec![folder.to_owned()]);
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(text(path.strip_prefix(folder).unwrap()).to_owned());
            }
        }
    }
    found
}

fn json_in(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Returns the files of nodes and subtrees that the tileset of map 0 names, and the level of the finest node.
fn named(folder: &Path) -> (BTreeSet<String>, u32) {
    let (mut named, mut finest) = (BTreeSet::new(), u32::MAX);
    let map = folder.join("maps/0");
    let mut open = vec![json_in(&map.join("tileset.json"))["root"].clone()];
    while let Some(node) = open.pop() {
        open.extend(node["children"].as_array().into_iter().flatten().cloned());
        let Some(uri) = node["content"]["uri"].as_str() else { continue };
        let path = uri.trim_start_matches("../").split_once("?v=").unwrap().0;
        named.insert(format!("maps/0/{path}"));
        if path.starts_with("subtree/") {
            open.push(json_in(&map.join(path))["root"].clone());
        } else {
            finest = finest.min(path.split('/').nth(1).unwrap().parse().unwrap());
            assert_eq!(node["geometricError"] == 0.0, node.get("children").is_none(), "{node}");
        }
    }
    (named, finest)
}

/// Asserts that a folder has the named files, and no others but those of the page and of the map.
fn assert_complete(folder: &Path) -> u32 {
    let (named, finest) = named(folder);
    let fixed = ["index.html", "page.js", "page.css", "licences.txt", "maps.json"].map(str::to_owned);
    let of_map = ["tileset.json", "layers.json", "trajectory.json", "overview.json", "moving.bin"];
    let of_map = of_map.map(|name| format!("maps/0/{name}"));
    let is_plain = |file: &String| !file.contains(".colour.") && !file.contains(".class.");
    let found: BTreeSet<String> = files(folder).into_iter().filter(is_plain).collect();
    assert_eq!(found, named.into_iter().chain(fixed).chain(of_map).collect());
    finest
}

fn refusal(arguments: &[&str]) -> String {
    let output = Command::new(cargo_bin("voxtile")).args(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn an_exported_page_has_the_files_of_the_server() {
    let (folder, map) = a_map();
    let cache = folder.path().join("cache");
    let page = folder.path().join("page");
    let summary: Value = serde_json::from_str(&run(&[
        "view",
        text(&map),
        "--export-page",
        text(&page),
        "--no-cache",
        "--json",
    ]))
    .unwrap();
    assert_eq!(assert_complete(&page), 0);
    assert_eq!(summary["files"], files(&page).len());
    let viewer = Viewer::ready(&[&map], &cache);
    let nodes = viewer.nodes("0");
    for node in &nodes {
        let path = page.join(node.split_once('?').unwrap().0);
        // Tiles without occupied voxels are left out.
        if path.exists() {
            assert_eq!(fs::read(&path).unwrap(), viewer.compressed(node).body, "{node}");
        }
    }
    assert!(summary["nodes"].as_u64().unwrap() <= nodes.len() as u64);
    for name in ["trajectory", "overview"] {
        let path = format!("maps/0/{name}.json");
        assert_eq!(json_in(&page.join(&path)), viewer.json(&path), "{name}");
    }
    let (mut live, exported) = (viewer.json("maps.json"), json_in(&page.join("maps.json")));
    assert_eq!(exported["exported"], json!({ "finest_level": 0 }));
    live["maps"][0]["generation"] = 1.into();
    assert_eq!(live["maps"], exported["maps"]);
    // The same bytes again, also from the cache and with other threads.
    let again = folder.path().join("again");
    run(&["view", text(&map), "--export-page", text(&again), "-q"]);
    assert_eq!(files(&again), files(&page));
    for file in files(&page) {
        assert_eq!(fs::read(page.join(&file)).unwrap(), fs::read(again.join(&file)).unwrap(), "{file}");
    }
}

#[test]
fn a_page_of_a_region_or_without_fine_levels_is_smaller() {
    let (folder, map) = a_map();
    let export = |name: &str, options: &[&str]| -> (PathBuf, u64) {
        let page = folder.path().join(name);
        let arguments = [&["view", text(&map), "--export-page", text(&page), "--json"], options].concat();
        let summary: Value = serde_json::from_str(&run(&arguments)).unwrap();
        (page, summary["nodes"].as_u64().unwrap())
    };
    let (all, nodes) = export("all", &[]);
    for level in [1, 50] {
        let (page, fewer) = export(&format!("level{level}"), &["--finest", &level.to_string()]);
        assert!(fewer < nodes, "{fewer} of {nodes} nodes");
        let finest = assert_complete(&page);
        assert_eq!(json_in(&page.join("maps.json"))["exported"]["finest_level"], finest);
        assert!(finest == 1 || (level == 50 && finest > 1), "level {finest}");
        // Coarse nodes are the same.
        for file in named(&page).0.iter().filter(|file| file.ends_with(".vox")) {
            assert_eq!(fs::read(page.join(file)).unwrap(), fs::read(all.join(file)).unwrap(), "{file}");
        }
    }
    let (page, fewer) = export("region", &["--region", "-10", "-10", "-10", "10", "30", "10"]);
    assert!(fewer < nodes);
    assert_complete(&page);
    let maps = json_in(&page.join("maps.json"));
    assert!(maps["maps"][0]["bounds"]["max"][1].as_f64().unwrap() <= 30.0);
    let sensor = json_in(&page.join("maps/0/trajectory.json"));
    assert!(
        !sensor["points"].as_array().unwrap().is_empty()
            && sensor["points"].as_array().unwrap().len() < 3 + 1
    );
    let error = refusal(&[
        "view",
        text(&map),
        "--export-page",
        text(&folder.path().join("none")),
        "--region",
        "900",
        "900",
        "0",
        "901",
        "901",
        "1",
    ]);
    assert!(error.contains("--region") && error.contains("no tile"), "{error}");
    assert!(!folder.path().join("none").exists());
}

#[test]
fn a_page_of_a_region_has_the_trajectory_inside() {
    let folder = tempfile::tempdir().unwrap();
    let (scans, map, page) =
        (folder.path().join("scans"), folder.path().join("map"), folder.path().join("page"));
    fs::create_dir(&scans).unwrap();
    // Along x, out of the region and back again.
    let poses = [0.0, 2.0, 4.0, 30.0, 34.0, 6.0, 8.0, 40.0].into_iter().enumerate().map(|(k, x)| {
        fs::write(scans.join(format!("{k}.xyz")), "4 0 0.5\n4 0.5 0.5\n").unwrap();
        format!("{k} {x} 0 0 0 0 0 1\n")
    });
    fs::write(scans.join("poses_tum.txt"), poses.collect::<String>()).unwrap();
    run(&["build", text(&scans), "-o", text(&map), "--resolution", "0.1", "-q"]);
    let region = ["--region", "-20", "-20", "-20", "20", "20", "20"];
    run(&[&["view", text(&map), "--export-page", text(&page), "-q"], &region[..]].concat());
    let trajectory = json_in(&page.join("maps/0/trajectory.json"));
    assert_eq!((&trajectory["scans"], &trajectory["parts"]), (&json!(5), &json!([0, 3])));
    assert_eq!(json_in(&page.join("maps.json"))["maps"][0]["scans"], 5);
    let whole = folder.path().join("whole");
    run(&["view", text(&map), "--export-page", text(&whole), "-q"]);
    assert!(json_in(&whole.join("maps/0/trajectory.json")).get("parts").is_none());
    let error = refusal(&["view", text(&map), "--export-page", text(&whole), "--compare", text(&map)]);
    assert!(error.contains("--export-page") && error.contains("--compare"), "{error}");
}

#[test]
fn values_of_layers_are_files() {
    let folder = tempfile::tempdir().unwrap();
    let rows = (0..900).map(|k| {
        format!("{},{},0.05,250,20,10,6\n", 0.05 + 0.1 * f64::from(k % 30), 0.05 + 0.1 * f64::from(k / 30))
    });
    let (cloud, map) = (folder.path().join("floor.csv"), folder.path().join("coloured"));
    fs::write(&cloud, "x,y,z,r,g,b,class\n".to_owned() + &rows.collect::<String>()).unwrap();
    run(&[
        "build",
        text(&cloud),
        "-o",
        text(&map),
        "--layers",
        "colour,class",
        "--no-rays",
        "--resolution",
        "0.1",
        "-q",
    ]);
    let page = folder.path().join("page");
    run(&["view", text(&map), "--export-page", text(&page), "-q"]);
    assert_complete(&page);
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    for node in viewer.nodes("0") {
        let path = node.split_once('?').unwrap().0.strip_suffix(".vox").unwrap();
        for layer in ["colour", "class"] {
            let served = viewer.compressed(&format!("{node}&layer={layer}")).body;
            assert_eq!(fs::read(page.join(format!("{path}.{layer}.vox"))).unwrap(), served, "{node}");
        }
    }
    assert_eq!(json_in(&page.join("maps/0/layers.json")), viewer.json("maps/0/layers.json"));
}

#[test]
fn a_page_replaces_no_files() {
    let (folder, map) = a_map();
    let page = folder.path().join("page");
    fs::create_dir(&page).unwrap();
    run(&["view", text(&map), "--export-page", text(&page), "-q"]);
    let before = files(&page);
    let error = refusal(&["view", text(&map), "--export-page", text(&page)]);
    assert!(error.contains("not empty"), "{error}");
    assert_eq!(files(&page), before);
    let (file, inner) = (folder.path().join("a file"), map.join("inner"));
    fs::write(&file, "mine").unwrap();
    fs::create_dir(&inner).unwrap();
    for output in [&file, &inner] {
        assert!(!refusal(&["view", text(&map), "--export-page", text(output)]).is_empty(), "{output:?}");
    }
    assert_eq!((fs::read(&file).unwrap(), fs::read_dir(&inner).unwrap().count()), (b"mine".to_vec(), 0));
    fs::remove_dir(&inner).unwrap();
    #[cfg(unix)]
    {
        let (empty, link) = (folder.path().join("empty"), folder.path().join("link"));
        fs::create_dir(&empty).unwrap();
        std::os::unix::fs::symlink(&empty, &link).unwrap();
        assert!(refusal(&["view", text(&map), "--export-page", text(&link)]).contains("link"));
        assert_eq!(fs::read_dir(&empty).unwrap().count(), 0);
    }
    let missing = folder.path().join("missing");
    let error = refusal(&["view", text(&missing), "--export-page", text(&folder.path().join("other"))]);
    assert!(error.contains("missing"), "{error}");
    let rest =
        fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert!(rest.filter(|name| name.starts_with(".voxtile")).count() == 0);
    for option in [["--region", "0"], ["--finest", "1"], ["--finest", "x"]] {
        assert!(!refusal(&["view", text(&map), option[0], option[1]]).is_empty());
    }
}
