//! `voxtile view` serves exactly the map to authorised clients, whatever other clients do.

use crate::cli::map_with_a_passer_by;
use crate::cli_compare::wall_at;
use assert_cmd::cargo::cargo_bin;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const TOKEN: &str = "open_sesame";
const PATIENCE: Duration = Duration::from_secs(60);

/// A running `voxtile view`; stopped on drop.
pub(crate) struct Viewer {
    process: Child,
    address: SocketAddr,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

pub(crate) struct Reply {
    pub(crate) status: u16,
    head: String,
    pub(crate) body: Vec<u8>,
}

fn read_reply(stream: TcpStream) -> Reply {
    let mut bytes = Vec::new();
    BufReader::new(stream).read_to_end(&mut bytes).unwrap();
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
    let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    Reply { status, head, body: bytes[end..].to_vec() }
}

impl Viewer {
    fn of(maps: &[&Path], cache: &Path) -> Self {
        let mut command = Command::new(cargo_bin("voxtile"));
        command.arg("view").args(maps).args(["--json", "--token", TOKEN]).env("XDG_CACHE_HOME", cache);
        let mut process = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let printed: Value = serde_json::from_str(&line).unwrap();
        let address: SocketAddr = printed["listen"].as_str().unwrap().parse().unwrap();
        assert_eq!(printed["url"], format!("http://{address}/{TOKEN}/"));
        assert!(address.ip().is_loopback());
        Self { process, address }
    }

    /// Same as [`Viewer::of`], but waits for the levels of all maps.
    pub(crate) fn ready(maps: &[&Path], cache: &Path) -> Self {
        let viewer = Self::of(maps, cache);
        viewer.wait(|maps| maps.iter().all(|map| map["generation"] != 0 && map["pending_tiles"] == 0));
        viewer
    }

    fn wait(&self, is_there: impl Fn(&[Value]) -> bool) {
        let since = Instant::now();
        while !is_there(self.json("maps.json")["maps"].as_array().unwrap()) {
            assert!(since.elapsed() < PATIENCE, "{}", self.json("maps.json"));
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Sends these bytes as a request.
    pub(crate) fn send(&self, request: &str) -> Reply {
        let mut stream = self.connect();
        stream.write_all(request.as_bytes()).unwrap();
        read_reply(stream)
    }

    /// Requests a path after the token, compressed.
    pub(crate) fn compressed(&self, path: &str) -> Reply {
        self.send(&format!(
            "GET /{TOKEN}/{path} HTTP/1.1\r\nhost: {}\r\naccept-encoding: gzip\r\nconnection: close\r\n\r\n",
            self.address
        ))
    }

    /// Requests a raw path after the token.
    fn get(&self, path: &str) -> Reply {
        self.send(&format!(
            "GET /{TOKEN}/{path} HTTP/1.1\r\nhost: {}\r\nconnection: close\r\n\r\n",
            self.address
        ))
    }

    pub(crate) fn json(&self, path: &str) -> Value {
        let reply = self.get(path);
        let text = String::from_utf8_lossy(&reply.body).into_owned();
        assert_eq!(reply.status, 200, "{path}: {text}");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}: {text}"))
    }

    /// Returns the paths of all nodes with their versions, from the tileset and its subtrees.
    pub(crate) fn nodes(&self, map: &str) -> Vec<String> {
        let mut nodes = Vec::new();
        let mut open = vec![self.json(&format!("maps/{map}/tileset.json"))["root"].clone()];
        while let Some(node) = open.pop() {
            open.extend(node["children"].as_array().into_iter().flatten().cloned());
            let Some(uri) = node["content"]["uri"].as_str() else { continue };
            let path = format!("maps/{map}/{}", uri.trim_start_matches("../"));
            if path.contains("/subtree/") {
                open.push(self.json(&path)["root"].clone());
            } else {
                nodes.push(path);
            }
        }
        nodes
    }

    /// Returns the voxels of a node: centers in millimetres, and values.
    fn voxels(&self, node: &str) -> Vec<([i64; 3], u8)> {
        let reply = self.get(node);
        assert_eq!(reply.status, 200, "{node}");
        let bytes = reply.body;
        assert_eq!(&bytes[..4], b"VXN1");
        let count = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        assert_eq!(bytes.len(), 64 + 5 * count);
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let (corner, edge) = ([number(8), number(16), number(24)], number(32));
        let mut at = [0_u8; 3];
        let voxel = |number: usize| {
            for k in 0..3 {
                at[k] = at[k].wrapping_add(bytes[64 + k * count + number]);
            }
            let center = [0, 1, 2].map(|k| corner[k] + (f64::from(at[k]) + 0.5) * edge);
            (center.map(|c| (1000.0 * c).round() as i64), bytes[64 + 3 * count + number])
        };
        (0..count).map(voxel).collect()
    }

    /// Returns the voxels of the finest nodes.
    fn finest(&self, map: &str) -> Vec<([i64; 3], u8)> {
        let is_finest = |path: &&String| path.contains("/node/0/");
        self.nodes(map).iter().filter(is_finest).flat_map(|path| self.voxels(path)).collect()
    }

    /// Returns the number of all marked points, the version of the marks, whether the map keeps scans, and points in
    /// millimetres.
    fn moving(&self, path: &str) -> (u64, u64, bool, Vec<[i64; 3]>) {
        let reply = self.get(path);
        assert_eq!((reply.status, &reply.body[..4]), (200, &b"VXM1"[..]), "{path}");
        let bytes = reply.body;
        let count = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        assert_eq!(bytes.len(), 56 + 12 * count);
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let coordinate = |point: usize, axis: usize| {
            let at = 56 + 12 * point + 4 * axis;
            let offset = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            (1000.0 * (f64::from_bits(number(24 + 8 * axis)) + f64::from(offset))).round() as i64
        };
        let points = (0..count).map(|point| [0, 1, 2].map(|axis| coordinate(point, axis))).collect();
        (number(8), number(16), bytes[48] == 1, points)
    }

    fn bytes_read(&self) -> u64 {
        let io = fs::read_to_string(format!("/proc/{}/io", self.process.id())).unwrap();
        io.lines().find_map(|line| line.strip_prefix("rchar: ")).unwrap().parse().unwrap()
    }

    fn resident_bytes(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.process.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        1024 * line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
    }
}

pub(crate) fn run(arguments: &[&str]) -> String {
    let output = Command::new(cargo_bin("voxtile")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Adds scans of different walls to a map.
fn build(folder: &Path, map: &Path, walls: std::ops::Range<usize>) {
    for wall in walls {
        let scans = folder.join(format!("wall{wall}"));
        fs::create_dir(&scans).unwrap();
        let row = |k: usize| {
            format!("{} {} {}", 4.03 + wall as f64, 0.05 * (k % 160) as f64 - 4.0, 0.1 * (k / 160) as f64)
        };
        fs::write(scans.join("0.xyz"), (0..1600).map(row).collect::<Vec<_>>().join("\n")).unwrap();
        fs::write(scans.join("poses_tum.txt"), format!("{wall} {} 0 1 0 0 0 1\n", 12 * wall)).unwrap();
        let mut arguments = vec!["build", text(&scans), "-o", text(map), "--resolution", "0.1", "-q"];
        arguments.extend(map.exists().then_some("--append"));
        run(&arguments);
    }
}

fn exported(folder: &Path, map: &str) -> BTreeSet<[i64; 3]> {
    let file = folder.join("voxels.csv");
    run(&["export", map, "-o", text(&file), "-q"]);
    let rows = fs::read_to_string(&file).unwrap();
    let millimetres = |row: &str| {
        let mut numbers =
            row.split(',').map(|number| (1000.0 * number.parse::<f64>().unwrap()).round() as i64);
        std::array::from_fn(|_| numbers.next().unwrap())
    };
    rows.lines()
        .filter(|row| row.starts_with(|first: char| first == '-' || first.is_ascii_digit()))
        .map(millimetres)
        .collect()
}

pub(crate) fn a_map() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("walls");
    build(folder.path(), &map, 0..3);
    (folder, map)
}

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
fn ceilings_are_those_of_pictures() {
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
    assert_eq!(overview["ceiling_m"], 1.2);
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
fn unauthorised_requests_get_nothing() {
    let (folder, map) = a_map();
    let secret = folder.path().join("secret.txt");
    fs::write(&secret, "secret").unwrap();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let host = viewer.address;
    let reply_to =
        |line: &str, host: &str| viewer.send(&format!("{line}\r\nhost: {host}\r\nconnection: close\r\n\r\n"));
    let host = host.to_string();
    assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), &host).status, 200);
    // Unauthorised clients get no persistent connection; others do.
    let is_closed = |token: &str| {
        let mut stream = viewer.connect();
        write!(stream, "GET /{token}/maps.json HTTP/1.1\r\nhost: {host}\r\n\r\n").unwrap();
        read_reply(stream).head.to_lowercase().contains("connection: close")
    };
    assert_eq!([is_closed("wrong_token"), is_closed(TOKEN)], [true, false]);
    for path in [
        "/".to_owned(),
        "/maps.json".to_owned(),
        "/wrong_token/maps.json".to_owned(),
        format!("/{}/maps.json", &TOKEN[..TOKEN.len() - 1]),
        format!("/{TOKEN}/../secret.txt"),
        format!("/{TOKEN}/../../../../../../etc/passwd"),
        format!("/{TOKEN}//etc/passwd"),
        format!("/{TOKEN}/maps/0/../../secret.txt"),
        format!("/{TOKEN}/maps/0/%2e%2e/%2e%2e/secret.txt"),
        format!("/{TOKEN}/maps/0/metadata.json"),
        format!("/{TOKEN}{}", secret.display()),
        format!("http://elsewhere/{TOKEN}x/maps.json"),
    ] {
        let reply = reply_to(&format!("GET {path} HTTP/1.1"), &host);
        assert!(reply.status == 404 || reply.status == 400, "{path}: {}", reply.status);
        let body = String::from_utf8_lossy(&reply.body).into_owned();
        assert!(
            !body.contains("secret") && !body.contains("root:") && !body.contains("walls"),
            "{path}: {body}"
        );
    }
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"] {
        assert_eq!(reply_to(&format!("{method} /{TOKEN}/maps.json HTTP/1.1"), &host).status, 405, "{method}");
    }
    // DNS rebinding: a page of another site reaches this server by a name of its own.
    for name in ["elsewhere.example", "elsewhere.example:80", "", "127.0.0.1.elsewhere.example"] {
        assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), name).status, 403, "{name}");
    }
    assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), "localhost:1").status, 200);
    let head = reply_to(&format!("HEAD /{TOKEN}/maps.json HTTP/1.1"), &host);
    assert_eq!((head.status, head.body.len()), (200, 0));
    let page = viewer.get("");
    assert_eq!(page.status, 200);
    assert!(
        page.head.contains("frame-ancestors 'none'") && page.head.contains("no-referrer"),
        "{}",
        page.head
    );
    // Without the trailing slash the page's relative links would be wrong.
    let slash = viewer.send(&format!("GET /{TOKEN} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n"));
    assert!(slash.status == 308 && slash.head.contains(&format!("location: /{TOKEN}/")), "{}", slash.head);
}

#[test]
fn many_or_stalled_clients_do_no_harm() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let nodes = viewer.nodes("0");
    let alone = viewer.get(&nodes[0]).body;
    // Some send half a request, some never read, some shut down their socket. All sockets remain open, more than the
    // server accepts at once.
    let silent: Vec<TcpStream> = (0..560)
        .map(|number| {
            let mut stream = viewer.connect();
            let request = format!("GET /{TOKEN}/{} HTTP/1.1\r\nhost: {}\r\n\r\n", nodes[0], viewer.address);
            let sent = if number % 2 == 0 { &request[..20] } else { &request[..] };
            stream.write_all(sent.as_bytes()).unwrap();
            if number % 5 == 0 {
                stream.shutdown(std::net::Shutdown::Both).unwrap();
            }
            stream
        })
        .collect();
    // Wait until the server treats them as idle; before, it might close a newer connection instead.
    std::thread::sleep(Duration::from_millis(1500));
    let before = viewer.resident_bytes();
    std::thread::scope(|scope| {
        let ask = |number: usize| {
            let (viewer, nodes) = (&viewer, &nodes);
            scope.spawn(move || viewer.get(&nodes[number % nodes.len()]))
        };
        let replies: Vec<_> = (0..200).map(ask).collect();
        for (number, reply) in replies.into_iter().enumerate() {
            let reply = reply.join().unwrap();
            assert_eq!(reply.status, 200);
            if number % nodes.len() == 0 {
                assert_eq!(reply.body, alone);
            }
        }
    });
    let grown = viewer.resident_bytes().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    drop(silent);
    assert_eq!(viewer.get("maps.json").status, 200);
}

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

/// The page's script is the largest response without a map, and is in memory only once.
#[cfg(target_os = "linux")]
#[test]
fn clients_that_read_nothing_hold_little_memory() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    assert!(viewer.get("page.js").body.len() > 500_000);
    let before = viewer.resident_bytes();
    // More than the system's socket buffers hold.
    let request = format!("GET /{TOKEN}/page.js HTTP/1.1\r\nhost: {}\r\n\r\n", viewer.address).repeat(12);
    // A client may have at most 256 connections.
    let silent: Vec<TcpStream> = (0..250)
        .map(|_| {
            let mut stream = viewer.connect();
            stream.write_all(request.as_bytes()).unwrap();
            stream
        })
        .collect();
    // The server is responding to all of them.
    for stream in &silent {
        assert_eq!(stream.peek(&mut [0; 12]).unwrap(), 12);
    }
    std::thread::sleep(Duration::from_millis(500));
    let grown = viewer.resident_bytes().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    assert_eq!(viewer.get("maps.json").status, 200);
}

#[test]
fn event_streams_and_silent_connections_block_no_client() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let ask = |path: &str| {
        let mut stream = viewer.connect();
        let request = format!("GET /{TOKEN}/{path} HTTP/1.1\r\nhost: {}\r\n\r\n", viewer.address);
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    let begun = Instant::now();
    let mut open: Vec<TcpStream> = (0..520).map(|_| ask("events")).collect();
    assert_eq!(viewer.get("maps.json").status, 200);
    // The newest event streams remain open.
    assert_eq!(open[519].peek(&mut [0; 12]).unwrap(), 12);
    open.extend((0..520).map(|_| ask("page.js")));
    open.extend((0..520).map(|_| viewer.connect()));
    assert_eq!(viewer.get("maps.json").status, 200);
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    let files = fs::read_dir(format!("/proc/{}/fd", viewer.process.id())).unwrap().count();
    assert!(files < 320, "{files} open files");
}

#[test]
fn an_invalid_request_is_a_client_error() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    for path in [
        "maps/0/raycast?from=0,0,0&to=1e6,0,0",
        "maps/0/raycast?from=0,0,0&to=1e300,0,0",
        "maps/0/query?x=1e300&y=0&z=0",
        "maps/0/node/0/2147483647/2147483647/-2147483648.vox",
        "maps/0/subtree/31/2147483647/0/0.json",
        "maps/0@nothing/tileset.json",
        "maps/9/tileset.json",
    ] {
        let reply = viewer.get(path);
        assert!(reply.status < 500, "{path}: {} {}", reply.status, String::from_utf8_lossy(&reply.body));
    }
    let far = viewer.get("maps/0/raycast?from=0,0,0&to=1e6,0,0");
    let printed = String::from_utf8_lossy(&far.body).into_owned();
    assert!(far.status == 400 && printed.contains("more than the limit of"), "{}: {printed}", far.status);
}
