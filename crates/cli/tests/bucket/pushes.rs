//! Push, remote read and pull of maps, compared with the map in its folder.

use crate::city::{
    KEEP, PRUNE, REPLACE, add_scans, assert_whole, city, config, digest, digest_there, files_of, message_of,
    open, push_now, scan_at,
};
use crate::server::Server;
use std::path::Path;
use tempfile::TempDir;
use testkit::random_scans::Random;
use voxtile::integrity::verify;
use voxtile::operations::{revert, snapshot, snapshots};
use voxtile::store::Disk;
use voxtile::{Error, MapQueries, MapReader, MapView, Mapper, OutOfCoreTileMapper, SnapshotName, Storage};
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::{Bucket, BucketDisk, pull, push};

#[test]
fn a_pushed_map_is_readable_and_can_be_pulled() {
    for (storage, keeps_scans) in
        [(Storage::OctoMap, false), (Storage::Compact, false), (Storage::OctoMap, true)]
    {
        let (server, folder) = (Server::new(), TempDir::new().unwrap());
        let (map, bucket) = (folder.path().join("map"), server.bucket());
        assert!(matches!(open(&bucket), Err(Error::NoMap { .. })));
        // The mapper remains open, because a push may run concurrently with a writer.
        let mut mapper = city(&map, storage, keeps_scans);
        let pushed = push_now(&map, &bucket);
        assert_eq!((pushed.tiles, pushed.tiles_sent), (mapper.statistics().tiles, pushed.tiles));
        assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
        let (here, there) = (MapReader::open(&map, 1 << 20).unwrap(), open(&bucket).unwrap());
        assert_eq!(there.scans().unwrap().len(), here.scans().unwrap().len());
        for number in 0..12 {
            let point = [5.0 * f64::from(number) + 1.0, 0.1, 0.1];
            assert_eq!(
                voxtile::Queries::occupancy_at(&there, point).unwrap(),
                voxtile::Queries::occupancy_at(&here, point).unwrap()
            );
        }
        // The queries read one voxel of each tile, without loading whole tiles if the storage is compact.
        let io = there.statistics().io;
        assert_eq!((io.loads == 0, io.bytes_read > 0), (storage == Storage::Compact, true), "{io:?}");
        let disk = BucketDisk::open(bucket.clone()).unwrap().into_map_path();
        assert!(verify(disk, |finding| panic!("{finding}"), |_, _| {}).unwrap().is_whole());

        let pulled = folder.path().join("pulled");
        pull(&bucket, &pulled, false, |_, _| {}).unwrap();
        assert_whole(&pulled);
        assert_eq!(digest(&pulled), digest(&map));
        // A build continues on it as on the original.
        let mut other = OutOfCoreTileMapper::open(&pulled, mapper.config().clone()).unwrap();
        for mapper in [&mut mapper, &mut other] {
            mapper.insert_scan(&scan_at(99, 7.0)).unwrap();
            mapper.flush().unwrap();
        }
        drop(other);
        assert_eq!(digest(&pulled), digest(&map));
        assert_whole(&pulled);
    }
}

#[test]
fn arbitrary_ranges_of_a_file_are_readable() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::Compact, false));
    push_now(&map, &bucket);
    let (disk, mut random) = (BucketDisk::open(bucket).unwrap(), Random(3));
    let there = Path::new("s3://test/maps/city");
    for (name, content) in files_of(&map).into_iter().filter(|(name, _)| name.ends_with("tile.vxt")) {
        for _ in 0..20 {
            let [from, bytes] = [0; 2].map(|_| random.below(content.len() as u64 + 40) as usize);
            let wanted = content.get(from..).unwrap_or_default();
            let read = disk.read_at(&there.join(&name), from as u64, bytes).unwrap();
            assert_eq!(read, wanted[..bytes.min(wanted.len())]);
        }
    }
    let missing = disk.read_at(&there.join("tile_9_9_9/tile.vxt"), 0, 1);
    assert_eq!(missing.unwrap_err().kind(), std::io::ErrorKind::NotFound);
}

#[test]
fn a_push_sends_only_changes_and_readers_keep_their_state() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    let mut mapper = city(&map, Storage::OctoMap, false);
    let first = push_now(&map, &bucket);
    let again = push_now(&map, &bucket);
    assert_eq!((again.objects_sent, again.tiles_sent), (0, 0));
    let (before, mut reader) = (digest(&map), open(&bucket).unwrap());

    mapper.insert_scan(&scan_at(50, 30.0)).unwrap();
    mapper.flush().unwrap();
    let second = push_now(&map, &bucket);
    assert!(0 < second.tiles_sent && second.tiles_sent < first.tiles_sent / 2, "{second:?}");
    // Objects are named by content, and those of an earlier push remain until pruned.
    assert_eq!(reader.digest().unwrap().to_string(), before);
    assert!(reader.refresh().unwrap());
    assert_eq!(reader.digest().unwrap().to_string(), digest(&map));
    assert!(!reader.refresh().unwrap());

    let objects = server.objects().len();
    std::thread::sleep(std::time::Duration::from_millis(5));
    mapper.insert_scan(&scan_at(51, 30.0)).unwrap();
    mapper.flush().unwrap();
    let pruned = push(map.as_path(), &bucket, PRUNE, |_, _| {}).unwrap();
    assert!(pruned.objects_pruned > 0);
    assert_eq!(server.objects().len() as u64, objects as u64 + pruned.objects_sent - pruned.objects_pruned);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
    // The state of this reader was pruned, so it returns an error instead of another state.
    let error = reader.digest().unwrap_err();
    let message = format!("{:#}", anyhow::Error::from(error));
    assert!(message.contains("objects/") && message.contains("--prune"), "{message}");
}

#[test]
fn a_pull_replaces_an_earlier_state_and_fetches_only_changes() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    let mut mapper = city(&map, Storage::OctoMap, true);
    push_now(&map, &bucket);
    let first = pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    mapper.insert_scan(&scan_at(50, 30.0)).unwrap();
    mapper.flush().unwrap();
    push_now(&map, &bucket);
    assert!(matches!(pull(&bucket, &pulled, false, |_, _| {}), Err(Error::AlreadyExists { .. })));
    let second = pull(&bucket, &pulled, true, |_, _| {}).unwrap();
    assert!(second.files_fetched < first.files_fetched / 2, "{second:?}");
    assert_eq!(digest(&pulled), digest(&map));
    assert_whole(&pulled);
    assert!(!folder.path().join("pulled.unfinished").exists());

    // Neither a later state nor another map is replaced.
    let mut ahead = OutOfCoreTileMapper::open(&pulled, mapper.config().clone()).unwrap();
    ahead.insert_scan(&scan_at(60, 0.0)).unwrap();
    ahead.flush().unwrap();
    drop(ahead);
    assert!(matches!(pull(&bucket, &pulled, true, |_, _| {}), Err(Error::Mismatch { what: "flush", .. })));
    let other = folder.path().join("other");
    drop(city(&other, Storage::OctoMap, false));
    assert!(matches!(pull(&bucket, &other, true, |_, _| {}), Err(Error::Mismatch { what: "the id", .. })));
    assert!(matches!(
        push(other.as_path(), &bucket, KEEP, |_, _| {}),
        Err(Error::Mismatch { what: "the id", .. })
    ));
    push_now(&pulled, &bucket);
    assert!(matches!(
        push(map.as_path(), &bucket, KEEP, |_, _| {}),
        Err(Error::Mismatch { what: "flush", .. })
    ));
}

/// Two robots extend copies of one map: no changes are lost, neither in the bucket nor on disk.
#[test]
fn diverged_copies_do_not_replace_each_other() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let [map, ours, theirs] = ["map", "ours", "theirs"].map(|name| folder.path().join(name));
    let bucket = server.bucket();
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    for copy in [&ours, &theirs] {
        pull(&bucket, copy, false, |_, _| {}).unwrap();
    }
    add_scans(&ours, 100, 2);
    add_scans(&theirs, 200, 5);
    // A state that was never pushed is not replaced by an earlier state or one of another copy.
    push_now(&ours, &bucket);
    let (ours_pushed, theirs_now) = (digest(&ours), digest(&theirs));
    let refused = message_of(push(theirs.as_path(), &bucket, KEEP, |_, _| {}));
    assert!(refused.contains("voxtile merge") && refused.contains("--replace"), "{refused}");
    assert_eq!(digest_there(&bucket).unwrap(), ours_pushed);
    add_scans(&ours, 110, 5);
    push_now(&ours, &bucket);
    let refused = message_of(pull(&bucket, &theirs, true, |_, _| {}));
    assert!(refused.contains("voxtile merge") && refused.contains("theirs"), "{refused}");
    assert_eq!(digest(&theirs), theirs_now);
    // The first copy has no changes of its own: it pulls the remote state and continues from it.
    pull(&bucket, &map, true, |_, _| {}).unwrap();
    assert_eq!(digest(&map), digest(&ours));
    assert_whole(&map);
    add_scans(&map, 300, 1);
    push_now(&map, &bucket);
    // --replace discards the remote state.
    add_scans(&theirs, 210, 20);
    push(theirs.as_path(), &bucket, REPLACE, |_, _| {}).unwrap();
    assert_eq!(digest_there(&bucket).unwrap(), digest(&theirs));
}

/// Earlier versions recorded no pushes: of two states with the same flush number, only the one in the bucket may be
/// pushed.
#[test]
fn another_state_of_the_same_flush_is_refused() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let [map, copy] = ["map", "copy"].map(|name| folder.path().join(name));
    let bucket = server.bucket();
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    pull(&bucket, &copy, false, |_, _| {}).unwrap();
    add_scans(&map, 100, 2);
    add_scans(&copy, 200, 2);
    push_now(&map, &bucket);
    for at in [&map, &copy] {
        std::fs::remove_file(at.join("bucket_states")).unwrap();
    }
    let refused = message_of(push(copy.as_path(), &bucket, KEEP, |_, _| {}));
    assert!(refused.contains("voxtile merge"), "{refused}");
    assert_eq!(push_now(&map, &bucket).objects_sent, 0);
    add_scans(&map, 110, 1);
    push_now(&map, &bucket);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
}

/// The records of push and pull in the folder are not part of the map.
#[test]
fn records_of_pushes_do_not_affect_the_map() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    for at in [&map, &pulled] {
        assert!(at.join("bucket_states").is_file());
        assert_whole(at);
        voxtile::integrity::repair(at.as_path(), |_| {}, |_, _| {}).unwrap();
        assert_whole(at);
    }
    // A push interrupted before it recorded its success recognises its own state in the bucket.
    add_scans(&map, 100, 1);
    push_now(&map, &bucket);
    let path = map.join("bucket_states");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, last) = text.trim_end().rsplit_once('\n').unwrap();
    std::fs::write(&path, format!("{before}\n{}\n", last.replace("there", "offered"))).unwrap();
    pull(&bucket, &map, true, |_, _| {}).unwrap();
    add_scans(&map, 110, 1);
    push_now(&map, &bucket);
}

/// A pull with --replace downloads a file whose local copy is damaged.
#[test]
fn a_pull_does_not_reuse_damaged_files() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    drop(city(&map, Storage::Compact, false));
    push_now(&map, &bucket);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    let (name, mut content) =
        files_of(&pulled).into_iter().find(|(name, _)| name.ends_with("tile.vxt")).unwrap();
    let middle = content.len() / 2;
    content[middle] ^= 1;
    std::fs::write(pulled.join(&name), content).unwrap();
    let again = pull(&bucket, &pulled, true, |_, _| {}).unwrap();
    // Only the damaged file and the files that belong to no tile are fetched.
    assert!(again.files_fetched < again.files / 2, "{again:?}");
    assert_whole(&pulled);
    assert_eq!(digest(&pulled), digest(&map));
}

/// Obstacles in the target folder are reported before the download.
#[test]
fn obstacles_are_reported_before_the_download() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    std::fs::create_dir(pulled.join("quarantine")).unwrap();
    let refused = message_of(pull(&bucket, &pulled, true, |_, _| panic!("something was fetched")));
    assert!(refused.contains("quarantine") && refused.contains("move it away"), "{refused}");
    assert!(!folder.path().join("pulled.unfinished").exists());
    std::fs::remove_dir(pulled.join("quarantine")).unwrap();
    pull(&bucket, &pulled, true, |_, _| {}).unwrap();
    assert_whole(&pulled);
}

#[test]
fn an_interrupted_pull_resumes() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    drop(city(&map, Storage::Compact, false));
    push_now(&map, &bucket);
    // Delete an object that a pull reads near its end, and restore it later.
    let manifest = server.get(&"maps/city/manifest.json".into());
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let log = manifest["files"]["commits.log"]["parts"][0].as_str().unwrap();
    let key = Key::from(format!("maps/city/objects/{log}"));
    let content = server.get(&key);
    server.delete(&key);
    let error = format!("{:#}", anyhow::Error::from(pull(&bucket, &pulled, false, |_, _| {}).unwrap_err()));
    assert!(error.contains(log), "{error}");
    assert!(!pulled.exists());
    server.put(&key, content);
    let again = pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    assert!(again.files_fetched < again.files / 2, "{again:?}");
    // One more file than in the bucket: the record of the pull.
    assert_eq!(files_of(&pulled).len(), again.files as usize + 1);
    assert_eq!(digest(&pulled), digest(&map));
}

#[test]
fn snapshots_are_pushed_and_pulled() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, pulled, bucket) = (folder.path().join("map"), folder.path().join("pulled"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    let name = SnapshotName::new("before").unwrap();
    snapshot(map.as_path(), &name).unwrap();
    let before = digest(&map);
    let mut mapper = OutOfCoreTileMapper::open(&map, config(Storage::OctoMap)).unwrap();
    for number in 70..73 {
        mapper.insert_scan(&scan_at(number, 10.0)).unwrap();
    }
    mapper.flush().unwrap();
    assert_ne!(digest(&map), before);
    push_now(&map, &bucket);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    assert_whole(&pulled);
    let there = BucketDisk::open(bucket.clone()).unwrap().into_map_path();
    assert_eq!(snapshots(there.clone()).unwrap().len(), 1);
    for place in [there, pulled.as_path().into()] {
        let reader = MapReader::open_snapshot(place, &name, 1 << 20).unwrap();
        assert_eq!(reader.digest().unwrap().to_string(), before);
    }
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
}

#[test]
fn one_of_two_concurrent_pushes_fails() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, copy, bucket) = (folder.path().join("map"), folder.path().join("copy"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    pull(&bucket, &copy, false, |_, _| {}).unwrap();
    for (at, seed) in [(&map, 80), (&copy, 81)] {
        let mut mapper = OutOfCoreTileMapper::open(at.as_path(), config(Storage::OctoMap)).unwrap();
        mapper.insert_scan(&scan_at(seed, 20.0)).unwrap();
        mapper.flush().unwrap();
    }
    // The second push runs completely during the first, and prunes unknown objects.
    let mut other = None;
    let lost = push(map.as_path(), &bucket, KEEP, |_, _| {
        other.get_or_insert_with(|| push(copy.as_path(), &bucket, PRUNE, |_, _| {}).unwrap());
    });
    let message = format!("{:#}", anyhow::Error::from(lost.unwrap_err()));
    assert!(message.contains("another push came first"), "{message}");
    assert_eq!(digest_there(&bucket).unwrap(), digest(&copy));
}

#[test]
fn missing_truncated_and_changed_objects_are_named() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, true));
    push_now(&map, &bucket);
    let whole = digest(&map);
    let pulled = folder.path().join("pulled");
    let mut refused = 0;
    // Every fifth object is enough: pages, tables, octrees and scans are among them.
    let manifest = Key::from("maps/city/manifest.json");
    for key in server.objects().into_iter().step_by(5).chain([manifest]) {
        let content = server.get(&key);
        let mut changed = content.clone();
        let middle = changed.len() / 2;
        changed[middle] ^= 1;
        let longer = [&content[..], b" "].concat();
        let broken = [None, Some(content[..content.len() / 2].to_vec()), Some(changed), Some(longer)];
        for (how, broken) in broken.into_iter().enumerate() {
            match broken {
                Some(broken) => server.put(&key, broken),
                None => server.delete(&key),
            }
            let name = key.filename().unwrap();
            match digest_there(&bucket) {
                // Damage without effect: queries read neither octrees nor scans, and a manifest may end with a blank.
                Ok(found) => assert_eq!(found, whole, "{key} {how}"),
                Err(error) => {
                    refused += 1;
                    let message = format!("{:#}", anyhow::Error::from(error));
                    let is_no_map = message.contains("no map here");
                    assert!(message.contains(name) || is_no_map, "{key} {how}: {message}");
                }
            }
            // A pull reads all objects.
            if !(name == "manifest.json" && how >= 2) {
                let error = pull(&bucket, &pulled, false, |_, _| {}).unwrap_err();
                let message = format!("{:#}", anyhow::Error::from(error));
                assert!(message.contains(name) || message.contains("no map here"), "{key} {how}: {message}");
                assert!(!pulled.exists());
                // Remove the partial download, or the next pull would not request these files again.
                let _ = std::fs::remove_dir_all(folder.path().join("pulled.unfinished"));
            }
            server.put(&key, content.clone());
        }
    }
    assert!(refused > 20, "{refused}");
    assert_eq!(digest_there(&bucket).unwrap(), whole);
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    assert_eq!(digest(&pulled), whole);
}

/// Appends the checksum of a manifest.
fn with_checksum(text: &str) -> Vec<u8> {
    let (rest, _) = text.rsplit_once(",\n  \"checksum\"").unwrap();
    let compact: String = rest.split('\n').map(|line| line.trim_start().replace("\": ", "\":")).collect();
    let checksum = blake3::hash(format!("{compact}}}").as_bytes()).to_hex();
    format!("{rest},\n  \"checksum\": \"{checksum}\"\n}}").into_bytes()
}

#[test]
fn a_hostile_manifest_writes_nothing_outside() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    let key = Key::from("maps/city/manifest.json");
    let text = String::from_utf8(server.get(&key)).unwrap();
    assert_eq!(with_checksum(&text), text.as_bytes());
    for path in ["../escaped", "/tmp/escaped", "a/../../escaped", "tile_0_0_0/../../escaped", "writer.lock"] {
        // Replace an entry so that the files of the manifest remain sorted.
        let replaced = if path < "metadata.json" { "\"commits.log\"" } else { "\"scans.bin\"" };
        let hostile = text.replace(replaced, &format!("{path:?}"));
        assert_ne!(hostile, text);
        server.put(&key, with_checksum(&hostile));
        let error = pull(&bucket, folder.path().join("pulled"), false, |_, _| {}).unwrap_err();
        let message = format!("{:#}", anyhow::Error::from(error));
        assert!(message.contains("not a file of a map"), "{message}");
        assert!(!folder.path().join("escaped").exists());
    }
}

#[test]
fn maps_in_buckets_are_read_only_and_web_servers_accept_no_push() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    let there = BucketDisk::open(bucket).unwrap().into_map_path();
    let error = OutOfCoreTileMapper::open(there, config(Storage::OctoMap)).unwrap_err();
    assert!(format!("{:#}", anyhow::Error::from(error)).contains("is read-only"));
    let web = Bucket::open("https://localhost:1/maps/city").unwrap();
    assert!(matches!(push(map.as_path(), &web, KEEP, |_, _| {}), Err(Error::InvalidArgument { .. })));
    for url in ["maps/city", "ftp://a/b", "s3://", "s3:///x", "https://host/map?key=1"] {
        assert!(matches!(Bucket::open(url), Err(Error::InvalidArgument { .. })), "{url}");
    }
}

/// Kept scans that only a snapshot uses are part of the map.
#[test]
fn scans_used_only_by_a_snapshot_are_pushed() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::Compact, false));
    let [before, keeping] = ["before", "keeping"].map(|name| SnapshotName::new(name).unwrap());
    snapshot(&map, &before).unwrap();
    let mut mapper = OutOfCoreTileMapper::open(&map, config(Storage::Compact).with_kept_scans(true)).unwrap();
    mapper.insert_scan(&scan_at(50, 2.0)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    snapshot(&map, &keeping).unwrap();
    revert(&map, &before, None, |_, _| ()).unwrap();
    push_now(&map, &bucket);
    let pulled = folder.path().join("pulled");
    pull(&bucket, &pulled, false, |_, _| {}).unwrap();
    assert_whole(&pulled);
    revert(&pulled, &keeping, None, |_, _| ()).unwrap();
    let reader = MapReader::open(&pulled, 0).unwrap();
    assert_eq!(reader.kept_scans().unwrap().filter(Result::is_ok).count(), 1);
}

/// The copy in the bucket may be the only intact one.
#[test]
fn a_map_with_damaged_catalogs_or_lost_segments_is_not_pushed() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    let mut mapper = city(&map, Storage::OctoMap, true);
    push_now(&map, &bucket);
    let before = digest_there(&bucket).unwrap();
    mapper.insert_scan(&scan_at(99, 7.0)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    let mut damaged = 0;
    for (name, bytes) in files_of(&map).into_iter().filter(|(name, _)| name.starts_with("kept_scans")) {
        let path = map.join(&name);
        let is_catalog = name.to_string_lossy().contains("catalog");
        let mut flipped = bytes.clone();
        flipped[bytes.len() / 2] ^= 1;
        let cut = &bytes[..bytes.len() - 1];
        for content in [None, Some(cut), is_catalog.then_some(&*flipped)] {
            match content {
                Some(content) => std::fs::write(&path, content).unwrap(),
                None => std::fs::remove_file(&path).unwrap(),
            }
            let message = message_of(push(&map, &bucket, PRUNE, |_, _| {}));
            assert!(message.contains("nothing was pushed"), "{}: {message}", name.display());
            assert!(message.contains(&*name.to_string_lossy()), "{message}");
            assert_eq!(digest_there(&bucket).unwrap(), before);
            std::fs::write(&path, &bytes).unwrap();
            damaged += 1;
        }
    }
    assert!(damaged >= 5, "{damaged}");
    push(&map, &bucket, PRUNE, |_, _| {}).unwrap();
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
}
