//! A subscriber under hostile packets, damaged layers and a failing disk keeps its memory limit and serves the other
//! robots.

mod support;

use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use support::{
    Process, SHARE, endpoint, layers_and_success, publisher, run, scans, set_of, start, stop,
    summaries_and_success,
};
use tempfile::TempDir;
use voxtile_share::codec::{Header, Packet, Request, Status, Update};
use voxtile_simulation::Random;
use zenoh::{Config, Session, Wait};

fn open(listen: &str) -> Session {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"peer\"".to_string()),
        ("scouting/multicast/enabled", "false".to_string()),
        ("listen/endpoints", format!("[\"{listen}\"]")),
        ("connect/endpoints", "[]".to_string()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    zenoh::open(config).wait().unwrap()
}

/// Answers status requests, so that the subscriber accepts the robot. The claimed set is larger than any limit.
fn answer_asks(session: &Session, robot: &'static str, resolution_m: f64) -> zenoh::pubsub::Subscriber<()> {
    let answers = session.clone();
    let take = move |sample: zenoh::sample::Sample| {
        let Ok(Request::Status { nonce }) = Request::decode(&sample.payload().to_bytes()) else { return };
        let status = Status {
            header: Header { epoch: 1, sequence: 0 },
            nonce,
            oldest: 1,
            resolution_m,
            tile_size_m: 100.0 * resolution_m,
            voxels: 1 << 40,
            digest: [1; 32],
        };
        let key = sample.key_expr().as_str().replace("/asks/", "/answers/");
        answers.put(key, Packet::Status(status).encode().unwrap()).wait().unwrap();
    };
    session.declare_subscriber(format!("voxtile/{robot}/asks/*")).callback(take).wait().unwrap()
}

fn changes(sequence: u64, voxels: impl Iterator<Item = [i32; 3]>) -> Vec<u8> {
    let updates = voxels.map(|voxel| Update { voxel, is_in: true }).collect();
    let header = Header { epoch: 1, sequence };
    Packet::Changes { header, repaired: Vec::new(), updates }.encode().unwrap()
}

/// Returns the peak resident memory of a process.
#[cfg(target_os = "linux")]
fn peak_rss_bytes(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() << 10
}

/// Returns the lines that a process prints on standard error.
fn error_lines(process: &mut Process) -> Receiver<String> {
    let (out, lines_read) = channel();
    let lines = BufReader::new(process.0.stderr.take().unwrap()).lines();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| out.send(line)));
    lines_read
}

/// Six robots send malformed packets, and voxels that take much memory, until it is full. One robot is honest.
#[cfg(target_os = "linux")]
#[test]
fn a_subscriber_keeps_to_its_memory_and_serves_others_under_hostile_packets() {
    const MEMORY: u64 = 128 << 20;
    /// Memory reserved for a packet.
    const PACKET: u64 = 21 << 20;
    /// Upper bound on the memory of a voxel that is alone in its tile.
    const VOXEL: u64 = 1300;
    const FULL: &str = "exceeds its limits";
    let folder = TempDir::new().unwrap();
    let (honest, hostile, map) = (endpoint(), endpoint(), folder.path().join("map"));
    let session = open(&hostile);
    let robots = ["evil-a", "evil-b", "evil-c", "evil-d", "evil-e", "evil-f"];
    let _answers = robots.map(|robot| answer_asks(&session, robot, 0.2));
    let mut publisher = publisher("honest", &scans(folder.path(), 1, 30), &honest);
    let (voxels, digest) = set_of(&mut publisher);
    let (memory, map) = (MEMORY.to_string(), map.to_str().unwrap());
    let args = ["--subscribe", "-o", map, "--json", "--connect", &honest, "--connect", &hostile];
    let more = ["--keep-apart", "--for", "600", "--memory", &memory];
    let mut command = Command::new(SHARE);
    command.args(args).args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut subscriber = Process(command.spawn().unwrap());
    let errors = error_lines(&mut subscriber);
    let begin = Instant::now();
    let mut random = Random::of(1, &[]);
    let (mut full, mut full_since) = (BTreeSet::new(), None);
    for sequence in 1.. {
        for robot in robots {
            let corner: [i32; 3] = std::array::from_fn(|_| random.below(1 << 30) as i32 - (1 << 29));
            // Each voxel is alone in its tile.
            let alone = (0..800).map(|k| {
                std::array::from_fn(|axis| corner[axis] + [k % 10, k / 10 % 10, k / 100][axis] * 101)
            });
            let mut packets = vec![changes(sequence, alone)];
            if robot == "evil-f" {
                packets.push(changes(sequence + 3000, [[i32::MAX - 1; 3]].into_iter()));
            }
            packets.push((0..random.below(2000)).map(|_| random.below(256) as u8).collect());
            for bytes in packets {
                session.put(format!("voxtile/{robot}/packets"), bytes).wait().unwrap();
            }
        }
        // Also send messages under a new name each time.
        session.put(format!("voxtile/unknown-{sequence}/packets"), vec![0; 60_000]).wait().unwrap();
        let reports = errors.try_iter().filter(|line| line.contains(FULL));
        full.extend(reports.filter_map(|line| robots.into_iter().find(|robot| line.contains(robot))));
        if full.len() >= 4 {
            // Continue for a while: memory must not grow further.
            let since = *full_since.get_or_insert_with(Instant::now);
            if since.elapsed() > Duration::from_secs(8) {
                break;
            }
        }
        assert!(begin.elapsed() < Duration::from_secs(400), "the memory is never full: {full:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
    // In this time, the subscriber requests the packets of the honest robot that the flood displaced.
    std::thread::sleep(Duration::from_secs(6));
    let peak = peak_rss_bytes(subscriber.id());
    stop(&subscriber);
    let (summaries, is_success) = summaries_and_success(&mut subscriber);
    assert!(is_success);
    let number = |summary: &Value, key: &str| summary.pointer(key).and_then(Value::as_u64).unwrap();
    let (of_honest, of_others): (Vec<_>, Vec<_>) =
        summaries.iter().partition(|summary| summary["robot"] == "honest");
    let sum = |key: &str| of_others.iter().map(|summary| number(summary, key)).sum::<u64>();
    let (kept, refused, cut) = (sum("/voxels"), sum("/counts/refused_voxels"), sum("/counts/cut_voxels"));
    println!("{peak} bytes at most of {MEMORY} and 48 MiB");
    println!("{kept} voxels kept, {refused} refused, {cut} forgotten, {} ms", begin.elapsed().as_millis());
    assert!(peak < MEMORY + (48 << 20), "{peak} bytes");
    assert!(refused > 0, "the memory was never full");
    // Layers use most of the memory; the rest holds the state of packets.
    assert!(kept * VOXEL > (MEMORY - PACKET) / 10 * 6, "{kept} voxels");
    let of_honest = of_honest[0];
    assert_eq!((number(of_honest, "/voxels"), &of_honest["digest"]), (voxels, &Value::from(digest)));
    assert_eq!((&of_honest["is_equal"], &of_honest["is_saved"]), (&Value::from(true), &Value::from(true)));
    assert!(folder.path().join("map.layers/honest.layer").exists());
}

/// A damaged layer, a layer that cannot be saved, another voxel size and a voxel at the end of the index range each
/// affect one robot. They are reported once, and the other layers are saved and folded.
#[test]
fn a_fault_of_one_robot_does_not_affect_others() {
    let folder = TempDir::new().unwrap();
    let (honest, other, map) = (endpoint(), endpoint(), folder.path().join("map"));
    let layers = folder.path().join("map.layers");
    fs::create_dir_all(layers.join("unsaved.layer")).unwrap();
    fs::create_dir_all(layers.join("unsaved.layer.next/x")).unwrap();
    fs::write(layers.join("damaged.layer"), b"voxtile-layer-1\nand then nothing").unwrap();
    let session = open(&other);
    let _answers = [
        answer_asks(&session, "damaged", 0.2),
        answer_asks(&session, "unsaved", 0.2),
        answer_asks(&session, "other-size", 0.3),
        answer_asks(&session, "far-away", 0.2),
    ];
    let mut honest_publisher = publisher("honest", &scans(folder.path(), 2, 20), &honest);
    let (voxels, digest) = set_of(&mut honest_publisher);
    let args =
        ["--subscribe", "-o", map.to_str().unwrap(), "--json", "--connect", &honest, "--connect", &other];
    let mut command = Command::new(SHARE);
    let child = command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut subscriber = Process(child);
    let begin = Instant::now();
    let mut random = Random::of(2, &[]);
    for sequence in 1.. {
        for robot in ["damaged", "unsaved", "other-size", "far-away"] {
            let voxel = match robot {
                "far-away" => [i32::MAX - 1, i32::MIN, 0],
                _ => std::array::from_fn(|_| random.below(100) as i32),
            };
            let bytes = changes(sequence, [voxel].into_iter());
            session.put(format!("voxtile/{robot}/packets"), bytes).wait().unwrap();
        }
        std::thread::sleep(Duration::from_millis(20));
        if begin.elapsed() > Duration::from_secs(15) {
            break;
        }
    }
    stop(&subscriber);
    let (received, is_success) = layers_and_success(&mut subscriber);
    let mut errors = String::new();
    subscriber.0.stderr.as_mut().unwrap().read_to_string(&mut errors).unwrap();
    println!("{errors}");
    assert!(!is_success);
    for (robot, word) in [
        ("damaged", "file kept as"),
        ("unsaved", "cannot"),
        ("other-size", "voxels of 0.3 m"),
        ("honest", ""),
    ] {
        let lines = errors.lines().filter(|line| line.contains(&format!("{robot}: "))).count();
        assert!(lines <= 2, "{robot} is reported {lines} times: {errors}");
        assert!(errors.contains(word), "{word}: {errors}");
    }
    assert_eq!(fs::read(aside(&layers, "damaged")).unwrap(), b"voxtile-layer-1\nand then nothing");
    let of_honest = received.iter().find(|layer| layer.0 == "honest").unwrap();
    assert_eq!((of_honest.1, &of_honest.2, of_honest.3), (voxels, &digest, true));
    for robot in ["honest", "damaged", "far-away", "other-size"] {
        assert!(layers.join(format!("{robot}.layer")).is_file(), "{robot}");
    }
    // The map contains all layers except the layer with another voxel size.
    let map_voxels = voxtile::MapReader::open(&map, 16 << 20).unwrap();
    let folded = voxtile::MapQueries::all_occupied_voxels(&map_voxels, None).unwrap();
    assert!(folded.len() as u64 > voxels);
    assert!(folded.iter().any(|voxel| voxel.index == [i32::MAX - 1, i32::MIN, 0]));
    // Folding the saved layer again succeeds.
    let layer = layers.join("honest.layer");
    let again = run(&["--fold", layer.to_str().unwrap(), "-o", map.to_str().unwrap(), "--json"]);
    assert!(again.status.success());
}

/// The number of reports is bounded, but a failure after the last report still fails the command.
#[test]
fn an_unfolded_layer_is_a_failure_after_the_last_report() {
    const FULL: &str = "no further ones are reported";
    let folder = TempDir::new().unwrap();
    let (honest, other, map) = (endpoint(), endpoint(), folder.path().join("map"));
    // A file with the name of the map prevents its creation.
    fs::write(&map, b"").unwrap();
    let layers = folder.path().join("map.layers");
    fs::create_dir_all(&layers).unwrap();
    let damaged: Vec<String> = (0..1002).map(|number| format!("n{number}")).collect();
    for robot in &damaged {
        fs::write(layers.join(format!("{robot}.layer")), b"no layer").unwrap();
    }
    let session = open(&other);
    let mut honest_publisher = publisher("honest", &scans(folder.path(), 3, 5), &honest);
    set_of(&mut honest_publisher);
    let args = ["--subscribe", "-o", map.to_str().unwrap(), "--json", "--connect", &honest, "--connect"];
    let mut command = Command::new(SHARE);
    let command = command.args(args).arg(&other).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut subscriber = Process(command.spawn().unwrap());
    let errors = error_lines(&mut subscriber);
    let begin = Instant::now();
    while !errors.try_iter().any(|line| line.contains(FULL)) {
        assert!(begin.elapsed() < Duration::from_secs(200), "there are never enough faults");
        for robot in &damaged {
            session.put(format!("voxtile/{robot}/packets"), vec![0; 8]).wait().unwrap();
        }
        std::thread::sleep(Duration::from_millis(300));
    }
    // The layer of the honest robot arrives meanwhile, also on a busy machine.
    std::thread::sleep(Duration::from_secs(15));
    stop(&subscriber);
    let (received, is_success) = layers_and_success(&mut subscriber);
    assert_eq!(received.iter().map(|layer| layer.0.as_str()).collect::<Vec<_>>(), ["honest"]);
    assert!(!is_success);
}

fn aside(layers: &Path, robot: &str) -> std::path::PathBuf {
    layers.join(format!("{robot}.layer.aside-1"))
}

/// A memory limit below the minimum is refused.
#[test]
fn too_little_memory_is_refused() {
    let folder = TempDir::new().unwrap();
    let map = folder.path().join("map");
    let mut process = start(SHARE, &["--subscribe", "-o", map.to_str().unwrap(), "--memory", "1MiB"]);
    assert_eq!(process.0.wait().unwrap().code(), Some(2));
}
