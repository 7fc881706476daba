//! Kept scans in a bucket: what a push sends, what readers fetch, and lost or damaged segments.

use crate::city::{PRUNE, RESEND, assert_whole, city, digest, message_of, open, push_now};
use crate::faulty_store::{Fault, FaultyStore, Kind};
use crate::server::Server;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use testkit::random_scans::Random;
use voxtile::integrity::verify;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{
    CopyScans, NewPoses, Part, Remap, Replay, ScanSelection, convert, crop, merge, rebuild_with_poses, remap,
    remove_scans, revert, snapshot,
};
use voxtile::scan::Stop;
use voxtile::space::Aabb;
use voxtile::store::Disk;
use voxtile::{
    MapConfig, MapReader, Mapper, OutOfCoreTileMapper, Pose, Result, ScanRef, SnapshotName, Storage,
};
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::{Bucket, BucketDisk, Pushed, pull, push};
use voxtile_pipeline::scan_digest;

const MIB: u64 = 1 << 20;

/// Some points per scan are more than the engine holds in memory, so it reads them several times.
const POINTS: usize = 280_000;

fn config() -> MapConfig {
    let mut config = MapConfig::new(0.5, 8.0).unwrap().with_range(0.0, 0.6).with_storage(Storage::Compact);
    config.keeps_scans = true;
    config
}

fn pose(number: u64, y_m: f64) -> Pose {
    Pose::from_quaternion([3.0 * number as f64, y_m, 0.2], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

/// Inserts scans of random points, which compress little, and flushes.
fn insert(mapper: &mut OutOfCoreTileMapper, numbers: std::ops::Range<u64>, points: usize) {
    for number in numbers {
        let mut random = Random(number);
        let points: Vec<_> = (0..points).map(|_| random.point([0.0; 3], 5.0)).collect();
        mapper.insert_points(&ScanRef::in_sensor(pose(number, 0.0), &points)).unwrap();
    }
    mapper.flush().unwrap();
}

/// Creates a map whose segment has several parts, the last of them full to a half.
fn long_drive(map: &Path) -> OutOfCoreTileMapper {
    let mut mapper = OutOfCoreTileMapper::create(map, config()).unwrap();
    insert(&mut mapper, 0..7, POINTS);
    let bytes = segment_bytes(map);
    assert!(bytes > 33 * MIB && bytes % (16 * MIB) > 2 * MIB, "{bytes}");
    mapper
}

fn segment_bytes(map: &Path) -> u64 {
    let files = std::fs::read_dir(map.join("kept_scans")).unwrap().map(|entry| entry.unwrap());
    let segments = files.filter(|file| file.file_name().to_string_lossy().starts_with("segment"));
    segments.map(|file| file.metadata().unwrap().len()).sum()
}

fn scans_there(bucket: &Bucket) -> Result<String> {
    Ok(scan_digest(&open(bucket)?)?.to_string())
}

fn scans_of(map: &Path) -> String {
    scan_digest(&MapReader::open(map, 0).unwrap()).unwrap().to_string()
}

/// Makes a new map from the scans of another one.
fn rebuilt(from: &MapReader, output: PathBuf, poses: &NewPoses) -> Result<String> {
    rebuild_with_poses(from, &*output, config(), |rays| *rays, poses, &Stop::default(), |_, _| ())?;
    Ok(digest(&output))
}

/// Numbers of requests and bytes, by object.
fn fetched(store: &FaultyStore, server: &Server, from: usize) -> BTreeMap<String, (usize, u64)> {
    let mut fetched = BTreeMap::new();
    for request in store.requests(Kind::Get).into_iter().skip(from) {
        let bytes = request.bytes.unwrap_or_else(|| server.get(&Key::from(request.key.clone())).len() as u64);
        let (count, all) = fetched.entry(request.key).or_insert((0, 0));
        (*count, *all) = (*count + 1, *all + bytes);
    }
    fetched
}

/// A new map from the scans in a bucket equals the map of a changed copy, and each part of the archive is fetched once.
#[test]
fn kept_scans_are_fetched_once() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let at = |name: &str| folder.path().join(name);
    drop(long_drive(&at("map")));
    push_now(&at("map"), &server.bucket());
    let store = FaultyStore::new(server.store.clone(), |_, _| Fault::None);
    let bucket = Bucket::on(store.clone(), "maps/city", "s3://test/maps/city").unwrap();

    let poses = NewPoses::InOrder((0..7).map(|number| pose(number, 0.4 * number as f64)).collect());
    let from = store.requests(Kind::Get).len();
    let moved = rebuilt(&open(&bucket).unwrap(), at("moved"), &poses).unwrap();
    let of_rebuild = fetched(&store, &server, from);
    let from = store.requests(Kind::Get).len();
    assert_eq!(scans_there(&bucket).unwrap(), scans_of(&at("map")));
    let of_digest = fetched(&store, &server, from);
    for fetched in [of_rebuild, of_digest] {
        for (key, (count, _)) in &fetched {
            assert_eq!(*count, 1, "{key}");
        }
        let bytes: u64 = fetched.values().map(|(_, bytes)| bytes).sum();
        assert!(bytes < segment_bytes(&at("map")) + MIB / 2, "{bytes} bytes: {fetched:?}");
    }

    pull(&bucket, at("copy"), false, |_, _| {}).unwrap();
    remap(&KeptSummary::read(at("copy").as_path()).unwrap(), &poses, &Remap::default(), |_, _| {}).unwrap();
    assert_eq!(digest(&at("copy")), moved);
    assert_ne!(digest(&at("map")), moved);
}

fn flip_byte(path: &Path, offset: u64) {
    let mut content = std::fs::read(path).unwrap();
    content[offset as usize] ^= 1;
    std::fs::write(path, content).unwrap();
}

/// A push sends new segments and the end of the segment being written, but no segment again.
#[test]
fn a_push_sends_only_new_scans() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    let mut mapper = long_drive(&map);
    let of_segments = |before: u64| segment_bytes(&map) - before;
    let first = push_now(&map, &bucket);
    assert!(first.bytes_sent > of_segments(0));

    // The same writer appends to its segment, whose last part is sent again.
    let before = segment_bytes(&map);
    insert(&mut mapper, 7..8, POINTS / 100);
    let same_writer = push_now(&map, &bucket);
    let tail = before % (16 * MIB) + of_segments(before);
    assert!((tail..tail + MIB / 2).contains(&same_writer.bytes_sent), "{same_writer:?}");
    drop(mapper);

    // The next writer begins a new segment.
    let before = segment_bytes(&map);
    insert(&mut OutOfCoreTileMapper::open(&map, config()).unwrap(), 8..9, POINTS / 100);
    // The first parts of the old segment are not even read.
    flip_byte(&map.join("kept_scans/segment.1"), 1000);
    let next_writer = push_now(&map, &bucket);
    flip_byte(&map.join("kept_scans/segment.1"), 1000);
    let new = of_segments(before);
    assert!((new..new + MIB / 2).contains(&next_writer.bytes_sent), "{next_writer:?}");
    assert_eq!(scans_there(&bucket).unwrap(), scans_of(&map));

    // New poses change the catalog, but no points.
    let summary = KeptSummary::read(map.as_path()).unwrap();
    let poses = NewPoses::Numbered(vec![(9, pose(8, 1.0))]);
    remap(&summary, &poses, &Remap::default(), |_, _| {}).unwrap();
    let remapped = push_now(&map, &bucket);
    assert!(remapped.bytes_sent < MIB / 2, "{remapped:?}");
    assert_eq!(scans_there(&bucket).unwrap(), scans_of(&map));
}

/// Returns the objects of the files in `kept_scans/`, by path.
fn objects_of_scans(server: &Server) -> BTreeMap<String, Key> {
    let manifest = server.get(&Key::from("maps/city/manifest.json"));
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let files = manifest["files"].as_object().unwrap().iter();
    let of_scans = files.filter(|(path, _)| path.starts_with("kept_scans/"));
    let first = |file: &serde_json::Value| {
        Key::from(format!("maps/city/objects/{}", file["parts"][0].as_str().unwrap()))
    };
    of_scans.map(|(path, file)| (path.clone(), first(file))).collect()
}

/// Returns the findings of a check of the map in a bucket.
fn findings(bucket: &Bucket) -> Result<Vec<String>> {
    let (mut findings, disk) = (Vec::new(), BucketDisk::open(bucket.clone())?);
    verify(disk.into_map_path(), |finding| findings.push(finding.to_string()), |_, _| {})?;
    Ok(findings)
}

/// A lost, truncated or changed segment or catalog is an error that names its object, until it is sent again.
#[test]
fn damaged_kept_scans_are_named_and_sent_again() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, true));
    push_now(&map, &bucket);
    let objects = objects_of_scans(&server);
    assert_eq!(objects.len(), 2, "{objects:?}");
    for (path, key) in objects {
        let content = server.get(&key);
        let mut changed = content.clone();
        changed[content.len() / 2] ^= 1;
        for broken in [None, Some(content[..content.len() / 2].to_vec()), Some(changed)] {
            match broken {
                Some(broken) => server.put(&key, broken),
                None => server.delete(&key),
            }
            let name = key.filename().unwrap();
            let of_digest = message_of(scans_there(&bucket));
            let of_rebuild = message_of(rebuilt(
                &open(&bucket).unwrap(),
                folder.path().join("new"),
                &NewPoses::Numbered(Vec::new()),
            ));
            let of_verify = findings(&bucket).unwrap().join("\n");
            for message in [of_digest, of_rebuild, of_verify] {
                let is_named = message.contains(name) && message.contains(&path);
                assert!(is_named && message.contains("push --resend"), "{path}: {message}");
            }
            assert!(!folder.path().join("new").exists());
            push(map.as_path(), &bucket, RESEND, |_, _| {}).unwrap();
            assert_eq!(scans_there(&bucket).unwrap(), scans_of(&map));
            assert_eq!(findings(&bucket).unwrap(), Vec::<String>::new());
        }
    }
}

/// A check of a map lists lost and changed objects of all files, and fetches each of them a few times at most.
#[test]
fn damaged_objects_are_findings() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let map = folder.path().join("map");
    drop(city(&map, Storage::OctoMap, true));
    push_now(&map, &server.bucket());
    let manifest = server.get(&Key::from("maps/city/manifest.json"));
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let object =
        |name: &serde_json::Value| Key::from(format!("maps/city/objects/{}", name.as_str().unwrap()));
    let mut files = BTreeMap::new();
    for page in manifest["pages"].as_object().unwrap().values() {
        let page: serde_json::Value = serde_json::from_slice(&server.get(&object(page))).unwrap();
        let of_page = page.as_object().unwrap().iter();
        files.extend(of_page.map(|(path, file)| (path.clone(), object(&file["parts"][0]))));
    }
    // The table of a tile, the octree of another one, and a segment.
    let nth = |name: &str, number: usize| {
        files.iter().filter(|(path, _)| path.ends_with(name)).nth(number).unwrap().1.clone()
    };
    let segment = objects_of_scans(&server).remove("kept_scans/segment.1").unwrap();
    let keys = [nth("iwlo_meta.bin", 0), nth("octree.bt", 5), segment];
    let (last, others) = keys.split_last().unwrap();
    others.iter().for_each(|key| server.delete(key));
    server.put(last, b"other".to_vec());

    let store = FaultyStore::new(server.store.clone(), |_, _| Fault::None);
    let bucket = Bucket::on(store.clone(), "maps/city", "s3://test/maps/city").unwrap();
    let found = findings(&bucket).unwrap();
    for key in &keys {
        let of_key = found.iter().filter(|finding| finding.contains(key.filename().unwrap())).count();
        assert!(of_key > 0, "{key}: {found:?}");
        let requests = store.requests(Kind::Get).iter().filter(|request| request.key == key.as_ref()).count();
        assert!(requests < 16, "{key}: {requests} requests");
    }
    let of_segment = found.iter().filter(|finding| finding.contains(last.filename().unwrap())).count();
    assert_eq!(of_segment, 12, "one for each scan");
}

/// Readers of an earlier push see its scans after the map was remapped and pushed, until a push prunes them. A snapshot
/// retains its scans.
#[test]
fn a_push_after_a_remap_is_complete_and_prunes_unreferenced_scans() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    let mut mapper = OutOfCoreTileMapper::create(&map, config()).unwrap();
    insert(&mut mapper, 0..6, 200);
    drop(mapper);
    push_now(&map, &bucket);
    let (before, mut reader) = (scans_of(&map), open(&bucket).unwrap());
    let (first_objects, unread) = (objects_of_scans(&server), open(&bucket).unwrap());

    let replay = |changed: &NewPoses| {
        remap(&KeptSummary::read(map.as_path()).unwrap(), changed, &Remap::default(), |_, _| {}).unwrap();
    };
    replay(&NewPoses::InOrder((0..6).map(|number| pose(number, 1.0)).collect()));
    push_now(&map, &bucket);
    assert_eq!(scan_digest(&reader).unwrap().to_string(), before);
    assert!(reader.refresh().unwrap());
    assert_eq!(scan_digest(&reader).unwrap().to_string(), scans_of(&map));

    // The points of a removed scan leave the bucket with a prune.
    let selection = ScanSelection::Numbers(2, 3);
    remove_scans(map.as_path(), &selection, false, &Replay::default(), |_, _| {}).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(5));
    let pruned: Pushed = push(map.as_path(), &bucket, PRUNE, |_, _| {}).unwrap();
    assert!(pruned.objects_pruned > 0);
    let left: BTreeSet<_> = server.objects().into_iter().collect();
    let now = objects_of_scans(&server);
    assert!(now.values().all(|key| left.contains(key)), "{now:?}");
    assert!(first_objects.values().all(|key| !left.contains(key)), "{first_objects:?}");
    assert_eq!(scans_there(&bucket).unwrap(), scans_of(&map));
    let message = message_of(scan_digest(&unread));
    assert!(message.contains("objects/") && message.contains("--prune"), "{message}");

    let name = SnapshotName::new("before").unwrap();
    snapshot(map.as_path(), &name).unwrap();
    let of_snapshot = scans_of(&map);
    replay(&NewPoses::InOrder((0..4).map(|number| pose(number, -1.0)).collect()));
    push(map.as_path(), &bucket, PRUNE, |_, _| {}).unwrap();
    let there = BucketDisk::open(bucket.clone()).unwrap().into_map_path();
    let snapshot = MapReader::open_snapshot(there, &name, 0).unwrap();
    assert_eq!(scan_digest(&snapshot).unwrap().to_string(), of_snapshot);
    pull(&bucket, folder.path().join("pulled"), false, |_, _| {}).unwrap();
    assert_whole(&folder.path().join("pulled"));
    assert_eq!(scans_of(&folder.path().join("pulled")), scans_of(&map));
}

/// A part of a map in a bucket, the map in another storage, and its union with others become maps in folders, with their
/// scans. They equal those of the map's folder.
#[test]
fn parts_and_unions_of_maps_in_buckets_are_written_to_folders() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let at = |name: &str| folder.path().join(name);
    let second = Bucket::on(server.store.clone(), "maps/second", "s3://test/maps/second").unwrap();
    let made =
        [("first", 0..4, server.bucket()), ("second", 20..23, second)].map(|(name, numbers, bucket)| {
            insert(&mut OutOfCoreTileMapper::create(at(name), config()).unwrap(), numbers, 300);
            push_now(&at(name), &bucket);
            (at(name), bucket)
        });
    let [(first, first_bucket), (second, second_bucket)] = &made;
    let here = |map: &Path| MapReader::open(map, 1 << 20).unwrap();
    let there = |bucket: &Bucket| open(bucket).unwrap();
    let result = |name: &str| {
        assert_whole(&at(name));
        (digest(&at(name)), scans_of(&at(name)))
    };

    let part = Part::Inside(Aabb { min: [0.0; 3], max: [5.0, 4.0, 4.0] });
    let cropped = [("here", here(first)), ("there", there(first_bucket))].map(|(name, map)| {
        crop(&map, &part, CopyScans::Yes, at(name), |_, _| {}).unwrap();
        result(name)
    });
    assert_eq!(cropped[0], cropped[1]);
    let converted = at("converted");
    convert(&there(first_bucket), &converted, Storage::OctoMap, CopyScans::Yes, |_, _| {}).unwrap();
    assert_eq!(result("converted"), (digest(first), scans_of(first)));

    let pairs = [
        [here(first), here(second)],
        [there(first_bucket), here(second)],
        [here(first), there(second_bucket)],
        [there(first_bucket), there(second_bucket)],
    ];
    let merged = pairs.iter().enumerate().map(|(number, maps)| {
        let name = format!("merged {number}");
        assert!(merge(maps, at(&name), None, |_, _| {}).unwrap().keeps_scans);
        result(&name)
    });
    let merged: Vec<_> = merged.collect();
    assert!(merged.iter().all(|one| one == &merged[0]), "{merged:?}");

    // The map in the bucket remains read-only.
    let inside = Path::new("s3://test/maps/city/new");
    let refused = message_of(crop(&there(first_bucket), &part, CopyScans::No, inside, |_, _| {}));
    assert!(refused.contains("is a URL"), "{refused}");
    let (disk, outside) = (BucketDisk::open(first_bucket.clone()).unwrap(), at("new"));
    for refused in [disk.create_folder(inside), disk.rename(&outside, inside), disk.remove_file(inside)] {
        assert_eq!(refused.unwrap_err().kind(), std::io::ErrorKind::ReadOnlyFilesystem);
    }
    disk.create_folder(&outside).unwrap();
    assert!(outside.is_dir());
}

/// A pull that replaces an earlier state fetches new segments, and the end of one that has grown. It does not reuse damaged
/// parts.
#[test]
fn a_pull_fetches_only_new_scans() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    let mut mapper = long_drive(&map);
    push_now(&map, &bucket);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    let before = segment_bytes(&map);
    insert(&mut mapper, 7..8, POINTS / 100);
    push_now(&map, &bucket);
    let fetched = pull(&bucket, &pulled, true, |_, _| {}).unwrap().bytes_fetched;
    let end = before % (16 * MIB) + segment_bytes(&map) - before;
    assert!((end..end + MIB / 2).contains(&fetched), "{fetched} bytes, of {end}");
    assert_whole(&pulled);
    drop(mapper);

    insert(&mut OutOfCoreTileMapper::open(&map, config()).unwrap(), 8..9, 100);
    push_now(&map, &bucket);
    let fetched = pull(&bucket, &pulled, true, |_, _| {}).unwrap().bytes_fetched;
    assert!(fetched < MIB / 2, "{fetched} bytes");
    insert(&mut OutOfCoreTileMapper::open(&map, config()).unwrap(), 9..10, 100);
    push_now(&map, &bucket);
    flip_byte(&pulled.join("kept_scans/segment.1"), 17 * MIB);
    let fetched = pull(&bucket, &pulled, true, |_, _| {}).unwrap().bytes_fetched;
    let damaged = segment_bytes(&map) - 16 * MIB;
    assert!((damaged - MIB / 2..damaged + MIB / 2).contains(&fetched), "{fetched} bytes, of {damaged}");
    assert_whole(&pulled);
    assert_eq!(scans_of(&pulled), scans_of(&map));
}

/// After a revert, a new segment may have the name of one that the bucket has.
#[test]
fn another_segment_of_the_same_name_is_sent() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    insert(&mut OutOfCoreTileMapper::create(&map, config()).unwrap(), 0..1, 100);
    let name = SnapshotName::new("before").unwrap();
    snapshot(map.as_path(), &name).unwrap();
    let segment = map.join("kept_scans/segment.2");
    let contents = [1..5, 11..15].map(|numbers| {
        insert(&mut OutOfCoreTileMapper::open(&map, config()).unwrap(), numbers, POINTS);
        push_now(&map, &bucket);
        assert_eq!(scans_there(&bucket).unwrap(), scans_of(&map));
        let content = std::fs::read(&segment).unwrap();
        revert(map.as_path(), &name, None, |_, _| {}).unwrap();
        assert!(!segment.exists());
        content
    });
    assert!(contents[0].len() as u64 > 17 * MIB && contents[0] != contents[1]);
}
