use crate::survey::{digest, folder_for_maps, limited, voxtile};
use serde_json::Value;
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::process::Command;

const MEMORY: u64 = 64 << 20;
/// Memory of a process in addition to its budget, in bytes.
const OVERHEAD: u64 = 48 << 20;
/// More than budget and overhead together.
const LARGE_BYTES: usize = 120 << 20;
const STAMP_S: u32 = 1_700_000_000;

fn build(input: &Path, map: &Path, memory: u64, how: &[&str]) -> Command {
    let mut command = voxtile();
    let memory = memory.to_string();
    command.arg("build").arg(input).arg("-o").arg(map).args(["--memory", &memory, "--resolution", "0.5"]);
    command.args(["--threads", "1", "--json"]).args(how);
    command
}

/// Builds a map, checks that the process stays within its budget, and returns the digest.
fn keeps_to_its_memory(input: &Path, how: &[&str]) -> String {
    let (_folder, map) = folder_for_maps();
    let output = build(input, &map, MEMORY, how).output().unwrap();
    let name = input.display();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    let built: Value = serde_json::from_slice(&output.stdout).unwrap();
    let peak = built["peak_rss_bytes"].as_u64().expect("this system reports the peak");
    assert!(peak < MEMORY + OVERHEAD, "{name}: {} MiB", peak >> 20);
    assert_eq!(built["scans"], 1, "{name}: {built}");
    digest(&map).unwrap().1
}

/// Same, and checks that the map equals one built with much memory.
fn keeps_to_its_memory_and_maps_the_same(input: &Path, how: &[&str]) {
    let found = keeps_to_its_memory(input, how);
    let (_folder, map) = folder_for_maps();
    assert!(build(input, &map, 4 << 30, how).output().unwrap().status.success());
    assert_eq!(found, digest(&map).unwrap().1, "{}", input.display());
}

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn numbers(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Returns a `std_msgs/Header` of ROS 1.
fn header(frame: &str) -> Vec<u8> {
    [numbers(&[0, STAMP_S, 0]), sized(frame.as_bytes())].concat()
}

/// Returns a `sensor_msgs/PointCloud2` of ROS 1 with all points at (1, 2, 3).
fn cloud(points: usize, point_bytes: usize) -> Vec<u8> {
    let fields = ["x", "y", "z"]
        .iter()
        .zip(0..)
        .flat_map(|(name, k)| [sized(name.as_bytes()), numbers(&[4 * k]), vec![7], numbers(&[1])].concat());
    let mut point = vec![0; point_bytes];
    for (place, value) in point.chunks_exact_mut(4).zip([1.0_f32, 2.0, 3.0]) {
        place.copy_from_slice(&value.to_le_bytes());
    }
    let mut message = [header("lidar"), numbers(&[1, points as u32, 3])].concat();
    message.extend(fields);
    message.push(0);
    message.extend(numbers(&[
        point_bytes as u32,
        (point_bytes * points) as u32,
        (point_bytes * points) as u32,
    ]));
    message.extend(point.repeat(points));
    message.push(1);
    message
}

/// Returns a `tf2_msgs/TFMessage` of ROS 1, from one second before to one second after the cloud.
fn transforms(count: u32) -> Vec<u8> {
    let mut message = numbers(&[count]);
    for k in 0..count {
        let after_ns = u64::from(k) * 2_000_000_000 / u64::from(count);
        let (seconds, ns) = ((after_ns / 1_000_000_000) as u32, (after_ns % 1_000_000_000) as u32);
        message.extend(numbers(&[0, STAMP_S - 1 + seconds, ns]));
        message.extend(sized(b"map"));
        message.extend(sized(b"lidar"));
        let pose = [f64::from(k) / f64::from(count), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        message.extend(pose.iter().flat_map(|number| number.to_le_bytes()));
    }
    message
}

/// Topics and types in the recordings.
const TOPICS: [(&str, &str); 3] =
    [("/points", "sensor_msgs/PointCloud2"), ("/tf", "tf2_msgs/TFMessage"), ("/other", "std_msgs/String")];

fn field(name: &str, value: &[u8]) -> Vec<u8> {
    sized(&[name.as_bytes(), b"=", value].concat())
}

fn bag_record(fields: &[Vec<u8>], data: &[u8]) -> Vec<u8> {
    [sized(&fields.concat()), sized(data)].concat()
}

/// Returns a ROS 1 bag without an index: messages with their topic numbers in one compressed chunk.
fn bag(messages: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut chunk = Vec::new();
    for ((topic, type_name), id) in TOPICS.iter().zip(0_u32..) {
        let fields = [field("op", &[7]), field("conn", &id.to_le_bytes()), field("topic", topic.as_bytes())];
        chunk.extend(bag_record(&fields, &field("type", type_name.as_bytes())));
    }
    for (topic, data) in messages {
        let time = field("time", &numbers(&[STAMP_S, 0]));
        let fields = [field("op", &[2]), field("conn", &topic.to_le_bytes()), time];
        chunk.extend(bag_record(&fields, data));
    }
    let size = field("size", &(chunk.len() as u32).to_le_bytes());
    let packed = zstd::encode_all(chunk.as_slice(), 1).unwrap();
    let head = [field("op", &[3]), field("index_pos", &[0; 8])];
    let start = [b"#ROSBAG V2.0\n".to_vec(), bag_record(&head, b" ")].concat();
    [start, bag_record(&[field("op", &[5]), field("compression", b"zstd"), size], &packed)].concat()
}

fn mcap_record(kind: u8, contents: &[u8]) -> Vec<u8> {
    [&[kind][..], &(contents.len() as u64).to_le_bytes(), contents].concat()
}

/// Returns an MCAP file without a summary: the same messages in one compressed chunk.
fn mcap(messages: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut chunk = Vec::new();
    for ((topic, type_name), id) in TOPICS.iter().zip(1_u16..) {
        let schema = [sized(type_name.as_bytes()), sized(b"ros1msg"), sized(b"")].concat();
        chunk.extend(mcap_record(3, &[&id.to_le_bytes()[..], &schema].concat()));
        let names = [sized(topic.as_bytes()), sized(b"ros1"), sized(b"")].concat();
        chunk.extend(mcap_record(4, &[&id.to_le_bytes()[..], &id.to_le_bytes(), &names].concat()));
    }
    for (topic, data) in messages {
        let stamp = (u64::from(STAMP_S) * 1_000_000_000).to_le_bytes();
        let channel = (*topic as u16 + 1).to_le_bytes();
        let head = [&channel[..], &[0; 4], &stamp, &stamp].concat();
        chunk.extend(mcap_record(5, &[&head[..], data].concat()));
    }
    let packed = zstd::encode_all(chunk.as_slice(), 1).unwrap();
    let mut contents = vec![0; 16];
    contents.extend((chunk.len() as u64).to_le_bytes());
    contents.extend(crc32fast::hash(&chunk).to_le_bytes());
    contents.extend([sized(b"zstd"), (packed.len() as u64).to_le_bytes().to_vec(), packed].concat());
    let header = mcap_record(1, &[sized(b"ros1"), sized(b"")].concat());
    [b"\x89MCAP0\r\n".to_vec(), header, mcap_record(6, &contents)].concat()
}

/// The chunk has a large message that is tiny when compressed.
#[test]
fn a_packed_chunk_keeps_to_the_memory() {
    let (folder, _) = folder_for_maps();
    let messages = [(1, transforms(3)), (2, vec![0; LARGE_BYTES]), (0, cloud(1000, 16))];
    for (name, bytes) in [("a.bag", bag(&messages)), ("a.mcap", mcap(&messages))] {
        assert!(bytes.len() < 1 << 17, "{name}: {} bytes", bytes.len());
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        keeps_to_its_memory(&path, &[]);
    }
}

#[test]
fn a_large_cloud_is_mapped_from_a_file() {
    let (folder, _) = folder_for_maps();
    let path = folder.path().join("a.mcap");
    fs::write(&path, mcap(&[(1, transforms(3)), (0, cloud(LARGE_BYTES / 4096, 4096))])).unwrap();
    keeps_to_its_memory_and_maps_the_same(&path, &[]);
}

#[test]
fn many_transforms_are_sorted_in_a_file() {
    let (folder, _) = folder_for_maps();
    let path = folder.path().join("a.bag");
    let message = transforms(100_000);
    let mut messages: Vec<(u32, Vec<u8>)> = (0..8).map(|_| (1, message.clone())).collect();
    // Each message has its own stamp, 100 s after that of the previous one.
    for (number, (_, message)) in messages.iter_mut().enumerate().skip(1) {
        for transform in message[4..].chunks_exact_mut(84) {
            transform[4..8].copy_from_slice(&(STAMP_S + 100 * number as u32).to_le_bytes());
        }
    }
    messages.push((0, cloud(1000, 16)));
    fs::write(&path, bag(&messages)).unwrap();
    keeps_to_its_memory_and_maps_the_same(&path, &[]);
}

#[test]
fn many_poses_are_in_a_file() {
    const POSES: usize = 1_500_000;
    let (folder, _) = folder_for_maps();
    let cloud = folder.path().join(format!("{STAMP_S}.000000.xyz"));
    fs::write(&cloud, "1 2 3\n4 5 6\n").unwrap();
    let poses = folder.path().join("poses.npy");
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({POSES}, 8), }}");
    let mut bytes = [b"\x93NUMPY\x01\0".to_vec(), (header.len() as u16).to_le_bytes().to_vec()].concat();
    bytes.extend(header.as_bytes());
    for k in 0..POSES {
        let stamp_s = f64::from(STAMP_S) + (k as f64 - 1000.0) * 0.01;
        let row = [stamp_s, k as f64 * 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        bytes.extend(row.iter().flat_map(|number| number.to_le_bytes()));
    }
    fs::write(&poses, bytes).unwrap();
    keeps_to_its_memory_and_maps_the_same(&cloud, &["--poses", poses.to_str().unwrap()]);
}

#[test]
fn records_of_las_are_skipped() {
    const RECORDS: u64 = 1000;
    const RECORD_BYTES: u64 = 54 + 0xffff;
    let (folder, _) = folder_for_maps();
    let path = folder.path().join("a.las");
    let points_at = 227 + RECORDS * RECORD_BYTES;
    let mut header = vec![0; 227];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227_u16.to_le_bytes());
    put(96, &(points_at as u32).to_le_bytes());
    put(100, &(RECORDS as u32).to_le_bytes());
    put(105, &20_u16.to_le_bytes());
    put(107, &2_u32.to_le_bytes());
    (0..3).for_each(|axis| put(131 + 8 * axis, &0.01_f64.to_le_bytes()));
    let mut file = File::create(&path).unwrap();
    file.write_all(&header).unwrap();
    for record in 0..RECORDS {
        file.seek(SeekFrom::Start(227 + record * RECORD_BYTES + 20)).unwrap();
        file.write_all(&0xffff_u16.to_le_bytes()).unwrap();
    }
    file.seek(SeekFrom::Start(points_at)).unwrap();
    for point in [[100_i32, 200, 300], [400, 500, 600]] {
        file.write_all(&point.map(i32::to_le_bytes).concat()).unwrap();
        file.write_all(&[0; 8]).unwrap();
    }
    keeps_to_its_memory(&path, &[]);
}

/// A process with the whole file or its first line in memory would exceed its limit.
#[test]
fn a_gigabyte_of_zeros_is_no_poses() {
    let (folder, map) = folder_for_maps();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    let pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n";
    ["1.pcd", "2.pcd"].iter().for_each(|name| fs::write(scans.join(name), pcd).unwrap());
    let poses = folder.path().join("poses.txt");
    File::create(&poses).unwrap().set_len(1 << 30).unwrap();
    let command = build(&scans, &map, MEMORY, &["--poses", poses.to_str().unwrap()]);
    let output = limited(&command, 'v', 1 << 20).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(printed.contains("is binary, not a text file of poses"), "{printed}");
}
