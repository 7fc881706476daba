//! A running `voxtile view`, and maps for it.

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

pub(crate) const TOKEN: &str = "open_sesame";
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// A running `voxtile view`; stopped on drop.
pub(crate) struct Viewer {
    pub(crate) process: Child,
    pub(crate) address: SocketAddr,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

pub(crate) fn read_reply(stream: TcpStream) -> Reply {
    let mut bytes = Vec::new();
    BufReader::new(stream).read_to_end(&mut bytes).unwrap();
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
    let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    Reply { status, head, body: bytes[end..].to_vec() }
}

impl Viewer {
    pub(crate) fn of(maps: &[&Path], cache: &Path) -> Self {
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

    pub(crate) fn wait(&self, is_there: impl Fn(&[Value]) -> bool) {
        let since = Instant::now();
        while !is_there(self.json("maps.json")["maps"].as_array().unwrap()) {
            assert!(since.elapsed() < PATIENCE, "{}", self.json("maps.json"));
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    pub(crate) fn connect(&self) -> TcpStream {
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
    pub(crate) fn get(&self, path: &str) -> Reply {
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
    pub(crate) fn voxels(&self, node: &str) -> Vec<([i64; 3], u8)> {
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
    pub(crate) fn finest(&self, map: &str) -> Vec<([i64; 3], u8)> {
        let is_finest = |path: &&String| path.contains("/node/0/");
        self.nodes(map).iter().filter(is_finest).flat_map(|path| self.voxels(path)).collect()
    }

    /// Returns the number of all marked points, the version of the marks, whether the map keeps scans, and points in
    /// millimetres.
    pub(crate) fn moving(&self, path: &str) -> (u64, u64, bool, Vec<[i64; 3]>) {
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

    pub(crate) fn bytes_read(&self) -> u64 {
        let io = fs::read_to_string(format!("/proc/{}/io", self.process.id())).unwrap();
        io.lines().find_map(|line| line.strip_prefix("rchar: ")).unwrap().parse().unwrap()
    }

    pub(crate) fn resident_bytes(&self) -> u64 {
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
pub(crate) fn build(folder: &Path, map: &Path, walls: std::ops::Range<usize>) {
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

pub(crate) fn exported(folder: &Path, map: &str) -> BTreeSet<[i64; 3]> {
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
