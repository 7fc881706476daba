//! Processes under test and their output.
#![allow(dead_code)]

pub mod bad_link;

use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use voxtile::Scan;
use voxtile_formats::ScanStreamWriter;
use voxtile_simulation::Survey;

pub const SHARE: &str = env!("CARGO_BIN_EXE_voxtile-share");

/// Process that is killed when dropped.
pub struct Process(pub Child);

impl Process {
    pub fn id(&self) -> u32 {
        self.0.id()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Ignore an error: the process may have exited already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub fn start(program: &str, args: &[&str]) -> Process {
    let mut command = Command::new(program);
    command.args(args).stdin(Stdio::null()).stdout(Stdio::piped());
    Process(command.spawn().unwrap())
}

/// Sends SIGTERM to a process.
pub fn stop(process: &Process) {
    let status = Command::new("kill").args(["-TERM", &process.id().to_string()]).status();
    assert!(status.unwrap().success());
}

/// Returns an endpoint with a free port.
pub fn endpoint() -> String {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("tcp/127.0.0.1:{port}")
}

/// Writes scans of a synthetic street.
pub fn scans(folder: &Path, seed: u64, count: usize) -> PathBuf {
    let path = folder.join(format!("{seed}.scans"));
    let mut writer = ScanStreamWriter::new(std::fs::File::create(&path).unwrap(), "street", false).unwrap();
    for scan in Survey::demo(seed).take(count) {
        let scan: Scan = Scan { intensities: None, ..scan };
        writer.write_world(&scan).unwrap();
    }
    path
}

pub fn publisher(robot: &str, scans: &Path, endpoint: &str) -> Process {
    let scans = scans.to_str().unwrap();
    let args =
        ["--publish", scans, "--robot", robot, "--listen", endpoint, "--latency", "0.2", "--rate", "20"];
    start(SHARE, &[&args[..], &["--resolution", "0.2", "--json"]].concat())
}

/// Returns the size and digest of the set after all scans are mapped.
pub fn set_of(publisher: &mut Process) -> (u64, String) {
    let mut line = String::new();
    BufReader::new(publisher.0.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let line: Value = serde_json::from_str(&line).unwrap();
    (line["voxels"].as_u64().unwrap(), line["digest"].as_str().unwrap().to_string())
}

pub fn subscriber(map: &Path, endpoints: &[&str], more: &[&str]) -> Process {
    let mut args = vec!["--subscribe", "-o", map.to_str().unwrap(), "--json"];
    endpoints.iter().for_each(|endpoint| args.extend(["--connect", endpoint]));
    args.extend(more);
    start(SHARE, &args)
}

/// Robot, number of voxels, digest and whether the layer equals the robot's set.
pub type Layer = (String, u64, String, bool);

/// Returns the layers of a subscriber that must succeed.
pub fn layers_of(subscriber: &mut Process) -> Vec<Layer> {
    let (layers, is_success) = layers_and_success(subscriber);
    assert!(is_success);
    layers
}

/// Returns the layers of a subscriber and whether it succeeds.
pub fn layers_and_success(subscriber: &mut Process) -> (Vec<Layer>, bool) {
    let (summaries, is_success) = summaries_and_success(subscriber);
    let layer = |summary: &Value| {
        let text = |key: &str| summary[key].as_str().unwrap().to_string();
        let (voxels, is_equal) = (&summary["voxels"], &summary["is_equal"]);
        (text("robot"), voxels.as_u64().unwrap(), text("digest"), is_equal.as_bool().unwrap())
    };
    (summaries.iter().map(layer).collect(), is_success)
}

/// Returns the summaries of a subscriber and whether it succeeds. On failure the last line is the error.
pub fn summaries_and_success(subscriber: &mut Process) -> (Vec<Value>, bool) {
    let mut out = String::new();
    subscriber.0.stdout.as_mut().unwrap().read_to_string(&mut out).unwrap();
    let status = subscriber.0.wait().unwrap();
    let mut lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines.iter().all(|line| line["version"] == 1));
    if !status.success() {
        let error = lines.pop().unwrap_or_else(|| panic!("{status} without an error"));
        assert_eq!(error["error"]["kind"], "other", "{error}");
    }
    (lines, status.success())
}

pub fn run(args: &[&str]) -> Output {
    Command::new(SHARE).args(args).output().unwrap()
}
