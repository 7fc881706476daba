use crate::cli::{failure, json, text};
use crate::message::{F32, MessageWriter};
use std::fs;
use tempfile::TempDir;

/// Returns a record of an MCAP file.
fn record(kind: u8, contents: &[u8]) -> Vec<u8> {
    [&[kind][..], &(contents.len() as u64).to_le_bytes(), contents].concat()
}

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat()
}

/// Returns an unfinished MCAP file. Each chunk is given by a checksum and a number of clouds. The checksum 0 means no
/// checksum, any other is wrong.
fn recording(chunks: &[(u32, u32)]) -> Vec<u8> {
    let schema =
        [&1_u16.to_le_bytes()[..], &sized(b"sensor_msgs/msg/PointCloud2"), &sized(b"ros2msg"), &sized(b"")];
    let ids = [1_u16, 1].map(u16::to_le_bytes).concat();
    let channel = [&ids[..], &sized(b"/points"), &sized(b"cdr"), &sized(b"")];
    let mut file = b"\x89MCAP0\r\n".to_vec();
    file.extend([record(3, &schema.concat()), record(4, &channel.concat())].concat());
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
    let mut at_ns = 0_i64;
    for &(clouds, checksum) in chunks {
        let mut messages = Vec::new();
        let start_ns = at_ns + 1;
        for _ in 0..clouds {
            at_ns += 1;
            let point = [[1.0, 2.0, at_ns as f32 * 0.01].map(f32::to_le_bytes).concat()];
            let cloud = MessageWriter::cdr().point_cloud2(at_ns, "lidar", &fields, &point);
            let head = [&[1, 0, 0, 0, 0, 0][..], &at_ns.to_le_bytes(), &at_ns.to_le_bytes()].concat();
            messages.extend(record(5, &[head, cloud].concat()));
        }
        let times = [start_ns, at_ns, messages.len() as i64].map(i64::to_le_bytes).concat();
        let size = (messages.len() as u64).to_le_bytes();
        let chunk = [&times[..], &checksum.to_le_bytes(), &sized(b""), &size, &messages].concat();
        file.extend(record(6, &chunk));
    }
    file
}

#[test]
fn a_damaged_chunk_counts_as_one_skipped_scan() {
    let folder = TempDir::new().unwrap();
    let [few, many, map, other] =
        ["few.mcap", "many.mcap", "map", "other"].map(|name| folder.path().join(name));
    fs::write(&few, recording(&[(1, 0), (600, 1), (1, 0), (500, 1), (1, 0)])).unwrap();
    let build = ["build", text(&few), "-o", text(&map), "--no-rays", "--skip-bad", "--json"];
    let built = json(&[&build[..], &["--count", "900"]].concat());
    assert_eq!((&built["scans"], built["unread_scans"].as_array().unwrap().len()), (&2.into(), 898));
    let resumed = json(&[&build[..], &["--resume"]].concat());
    assert_eq!((&resumed["scans"], &resumed["resumed_after"]), (&1.into(), &2.into()));
    assert_eq!(resumed["unread_scans"].as_array().unwrap().len(), 202);
    // More damaged chunks than the limit fail with a remedy.
    fs::write(&many, recording(&[&[(1, 0)][..], &[(1, 1); 1001]].concat())).unwrap();
    let (code, stderr) =
        failure(&["build", text(&many), "-o", text(&other), "--no-rays", "--skip-bad", "--quiet"]);
    let wanted =
        "more than 1000 scans or damaged chunks of one input cannot be read: copy or repair the input";
    assert!(code == 1 && stderr.contains(wanted) && stderr.contains("--first"), "{stderr:.2000}");
}
