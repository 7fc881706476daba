//! Files of every kind, written by the first version that supported them. Every later version must read them.
//!
//! Folders of `tests/data` are never rewritten. If a later version writes a different format, it gets a new folder:
//! `VOXTILE_NEW_FIXTURES=tests/data/files_3 cargo test --test all -- --ignored fixtures_of_this_version`.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use voxtile::integrity::verify;
use voxtile::operations::{Decay, Part, clear, decay};
use voxtile::sensor::{Evidence, Iwlo, SensorModel};
use voxtile::space::{Aabb, VoxelBox, VoxelKey};
use voxtile::store::SnapshotName;
use voxtile::tile::format::{CompactFileIndex, read_compact_file, read_compact_voxels_from};
use voxtile::{MapConfig, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, Scan, Storage};
use voxtile_formats::{ReadOptions, ScanStreamWriter, open_scans};
use voxtile_share::codec::Packet;
use voxtile_share::{Sender, SenderConfig, VoxelSet, read_layer, write_layer};

const MAPS: [&str; 4] = ["plain", "killed", "compact", "seed"];

fn fixtures() -> Vec<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let folders = fs::read_dir(data).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<_> = folders.filter(|path| path.join("expected.json").is_file()).collect();
    folders.sort();
    assert!(!folders.is_empty());
    folders
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() { copy(&path, &target) } else { fs::copy(&path, &target).map(drop).unwrap() }
    }
}

fn config() -> MapConfig {
    crate::harness::config().with_range(0.0, 5.0)
}

fn scans() -> Vec<Scan> {
    let mut random = Random(15);
    (0..6).map(|k| random_scan(&mut random, [2.0 * f64::from(k), 0.0, 0.0], 40)).collect()
}

fn digest(map: &impl MapQueries) -> Value {
    json!(map.digest().unwrap().to_string())
}

fn name(name: &str) -> SnapshotName {
    SnapshotName::new(name).unwrap()
}

/// Describes a map without changing it.
fn described(map: &Path) -> Value {
    let reader = MapReader::open(map, 1 << 20).unwrap();
    let mut described = json!({ "digest": digest(&reader), "scans": reader.scan_number() });
    if map.join("snapshots/first").is_file() {
        described["first"] = digest(&MapReader::open_snapshot(map, &name("first"), 1 << 20).unwrap());
    }
    described
}

fn check_whole(map: &Path, what: &str) {
    let mut findings = Vec::new();
    let verification = verify(map, |finding| findings.push(finding.clone()), |_, _| ()).unwrap();
    assert!(verification.is_whole(), "{what}: {findings:?}");
}

#[test]
fn maps_of_all_versions_are_read_verified_and_continued() {
    for folder in fixtures() {
        let expected: Value =
            serde_json::from_slice(&fs::read(folder.join("expected.json")).unwrap()).unwrap();
        for of in MAPS {
            let what = format!("{} of {}", of, folder.display());
            let place = TempDir::new().unwrap();
            let map = place.path().join(of);
            copy(&folder.join(of), &map);
            assert_eq!(described(&map), expected[of], "{what}");
            check_whole(&map, &what);
            // A writer continues the map, and its snapshot is unchanged.
            let config = MapReader::config_of(&map).unwrap().with_cache_tiles(2);
            let mut mapper = OutOfCoreTileMapper::open(&map, config).unwrap();
            assert_eq!(digest(&mapper), expected[of]["digest"], "{what}");
            mapper.insert_scan(&scans()[3]).unwrap();
            mapper.flush().unwrap();
            let changed = digest(&mapper);
            drop(mapper);
            let after = described(&map);
            assert_eq!(after["digest"], changed, "{what}");
            assert_eq!(after["first"], expected[of]["first"], "{what}");
            check_whole(&map, &what);
        }
    }
}

#[test]
fn streams_packets_and_layers_of_all_versions_are_read() {
    for folder in fixtures() {
        let expected: Value =
            serde_json::from_slice(&fs::read(folder.join("expected.json")).unwrap()).unwrap();
        let mut source = open_scans(&folder.join("six.scans"), &ReadOptions::default()).unwrap();
        let mut points = Vec::new();
        while let Some(scan) = source.next_scan().unwrap() {
            points.push(scan.points_in_sensor.len());
        }
        assert_eq!(json!(points), expected["points"]);
        let mut layer = BufReader::new(File::open(folder.join("robot.layer")).unwrap());
        let mut layer = read_layer(&mut layer, 1 << 20).unwrap();
        assert_eq!(json!(layer.digest().to_string()), expected["layer"]);
        let mut set = VoxelSet::new(*layer.grid());
        let packets = fs::read(folder.join("packets")).unwrap();
        let mut rest = &*packets;
        while let Some((length, tail)) = rest.split_first_chunk() {
            let (packet, tail) = tail.split_at(u16::from_le_bytes(*length).into());
            if let Packet::Changes { updates, .. } = Packet::decode(packet).unwrap() {
                for update in updates {
                    set.put(update.voxel, update.is_in);
                }
            }
            rest = tail;
        }
        assert_eq!(json!(set.digest().to_string()), expected["layer"]);
    }
}

/// The tiles of the maps above have one group. This tile has three, with symbols of one and two bytes and rare states.
#[test]
fn a_tile_of_version_1_with_several_groups_is_read() {
    let file = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/compact_1/tile.vxt")).unwrap();
    let mut expected = BTreeMap::new();
    for number in 0..13 * 13 * 13 {
        let [x, y, z] = [number / 169, number / 13 % 13, number % 13].map(|k| 8 * k);
        for k in 0..=number % 3 {
            let (log_odds, observation_count) = match number % 11 {
                0 => (f64::from(number) * 0.001 + f64::from(k), number % 7),
                _ => (f64::from(number % 300) * -0.4, number % 300),
            };
            let voxel = [x + (number + k) % 8, y + number / 8 % 8, z + k];
            expected.insert(VoxelKey::from_index(voxel).morton(), Evidence { log_odds, observation_count });
        }
    }
    let voxels = VoxelBox { min: [0; 3], end: [104; 3] };
    let bytes = file.len() as u64;
    let read = read_compact_file(&mut &file[..], bytes, &voxels).unwrap();
    assert!(read.table.iter().eq(expected.iter().map(|(&code, &evidence)| (code, evidence))));
    assert_eq!(read.trailer.unwrap().scan_number, 5);
    let sifted = read_compact_voxels_from(&mut &file[..], bytes, &voxels, 0.5).unwrap().table;
    expected.retain(|_, evidence| evidence.log_odds >= 0.5);
    assert!(sifted.into_iter().eq(expected));
    // Version 1 has no index.
    assert!(CompactFileIndex::read(&mut &file[..], bytes, &voxels).unwrap().is_none());
}

#[test]
#[ignore = "writes the fixtures of a new version"]
fn fixtures_of_this_version() {
    let folder = PathBuf::from(
        std::env::var_os("VOXTILE_NEW_FIXTURES").expect("VOXTILE_NEW_FIXTURES must name a new folder"),
    );
    fs::create_dir(&folder).unwrap();
    let scans = scans();
    write_plain(&folder.join("plain"), &scans);
    write_killed(&folder, &scans);
    write_compact(&folder.join("compact"), &scans);
    write_seed(&folder.join("plain"), &folder.join("seed"));
    let mut expected = json!({});
    for of in MAPS {
        // Reads a copy, because opening the map of a killed writer would change it.
        expected[of] = described(&folder.join(of));
    }
    let file = BufWriter::new(File::create(folder.join("six.scans")).unwrap());
    let mut stream = ScanStreamWriter::new(file, "six scans", true).unwrap();
    scans.iter().for_each(|scan| stream.write_world(scan).unwrap());
    stream.flush().unwrap();
    expected["points"] = json!(scans.iter().map(|scan| scan.points.len()).collect::<Vec<_>>());
    expected["layer"] = json!(write_shared(&folder));
    fs::write(folder.join("expected.json"), format!("{expected:#}\n")).unwrap();
}

fn insert(mapper: &mut OutOfCoreTileMapper, scans: &[Scan]) {
    for scan in scans {
        mapper.insert_scan(scan).unwrap();
    }
}

/// Two flushes with a snapshot between them, removed tiles, and decayed evidence.
fn write_plain(map: &Path, scans: &[Scan]) {
    let mut mapper = OutOfCoreTileMapper::create(map, config()).unwrap();
    mapper.begin_input("six scans").unwrap();
    insert(&mut mapper, &scans[..2]);
    mapper.snapshot(&name("first")).unwrap();
    insert(&mut mapper, &scans[2..]);
    mapper.flush().unwrap();
    drop(mapper);
    let part = Part::Inside(Aabb { min: [-3.2; 3], max: [0.0; 3] });
    assert!(clear(map, &part, |_, _| ()).unwrap().tiles_removed > 0);
    decay(map, &Decay::new(20.0), |_, _| ()).unwrap();
}

/// Files of a writer that was killed between two flushes: next versions of tiles, and spilled updates.
fn write_killed(folder: &Path, scans: &[Scan]) {
    let place = TempDir::new().unwrap();
    let map = place.path().join("map");
    let mut mapper = OutOfCoreTileMapper::create(&map, config()).unwrap();
    insert(&mut mapper, &scans[..3]);
    mapper.flush().unwrap();
    insert(&mut mapper, &scans[3..]);
    copy(&map, &folder.join("killed"));
}

fn write_compact(map: &Path, scans: &[Scan]) {
    let config = config()
        .with_storage(Storage::Compact)
        .with_sensor_model(SensorModel::Iwlo(Iwlo::default().validated().unwrap()));
    let mut mapper = OutOfCoreTileMapper::create(map, config).unwrap();
    insert(&mut mapper, &scans[..3]);
    mapper.snapshot(&name("first")).unwrap();
    insert(&mut mapper, &scans[3..]);
    mapper.flush().unwrap();
}

/// A map of the original format: no log, no trailers, no extensions in the metadata.
fn write_seed(plain: &Path, map: &Path) {
    copy(plain, map);
    fs::remove_file(map.join("commits.log")).unwrap();
    fs::remove_file(map.join("writer.lock")).unwrap();
    fs::remove_dir_all(map.join("snapshots")).unwrap();
    let mut metadata: Value = serde_json::from_slice(&fs::read(map.join("metadata.json")).unwrap()).unwrap();
    metadata.as_object_mut().unwrap().remove("ext");
    fs::write(map.join("metadata.json"), format!("{metadata:#}\n")).unwrap();
    for entry in fs::read_dir(map).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()) {
        for file in fs::read_dir(&entry).unwrap().map(|entry| entry.unwrap().path()) {
            if file.extension().is_some_and(|extension| extension.to_string_lossy().starts_with("flush")) {
                fs::remove_file(file).unwrap();
            }
        }
        let table = entry.join("iwlo_meta.bin");
        // A tile that only a snapshot uses has no files left.
        let Ok(bytes) = fs::read(&table) else {
            fs::remove_dir(&entry).unwrap();
            continue;
        };
        let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
        fs::write(&table, &bytes[..16 + 18 * count as usize]).unwrap();
    }
}

/// Writes packets and a layer of the same voxels. Returns their digest.
fn write_shared(folder: &Path) -> String {
    let mut sender = Sender::new(config().grid, 7, SenderConfig::default()).unwrap();
    let mut random = Random(8);
    for _ in 0..300 {
        let voxel = std::array::from_fn(|_| random.below(60) as i32 - 30);
        sender.put(voxel, true);
    }
    let mut out = BufWriter::new(File::create(folder.join("packets")).unwrap());
    for step in 1..100 {
        for packet in sender.poll(Duration::from_secs(step)) {
            out.write_all(&(packet.bytes.len() as u16).to_le_bytes()).unwrap();
            out.write_all(&packet.bytes).unwrap();
        }
    }
    out.flush().unwrap();
    let mut layer = BufWriter::new(File::create(folder.join("robot.layer")).unwrap());
    write_layer(sender.sent(), &mut layer).unwrap();
    layer.flush().unwrap();
    sender.sent().digest().to_string()
}
