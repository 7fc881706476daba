//! Tests with stores that fail, refuse requests, drop responses or lack objects.

use crate::city::{
    KEEP, RESEND, add_scans, city, config, digest, digest_there, message_of, push_now, scan_at,
};
use crate::faulty_store::{Fault, FaultyStore, Kind};
use crate::server::Server;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use voxtile::integrity::verify;
use voxtile::{Error, Mapper, OutOfCoreTileMapper, Storage};
use voxtile_bucket::object_store::ObjectStore;
use voxtile_bucket::object_store::memory::InMemory;
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::object_store::throttle::{ThrottleConfig, ThrottledStore};
use voxtile_bucket::{Bucket, BucketDisk, pull, push};

/// A store without a response is an error, not a missing map.
#[test]
fn an_unreachable_store_is_not_a_missing_map() {
    let server = Server::new();
    server.put(&Key::from("maps/city/manifest.json"), b"{}".to_vec());
    server.put(&Key::from("drive/one.pcd"), b"points".to_vec());
    let on = |store: Arc<dyn ObjectStore>, prefix: &str| {
        Bucket::on(store, prefix, "s3://test").unwrap().with_timeout(Duration::from_secs(1))
    };
    assert!(server.bucket().has_map(&|| false).unwrap());
    assert!(!on(server.store.clone(), "drive").has_map(&|| false).unwrap());
    let fails = FaultyStore::new(server.store.clone(), |_, _| Fault::Fails);
    for prefix in ["maps/city", "drive"] {
        let error = message_of(on(fails.clone(), prefix).has_map(&|| false));
        assert!(error.contains("manifest.json") && error.contains("connection broke"), "{error}");
    }
    // Without permission to list, S3 refuses to read a missing object instead of reporting it as missing. For the path
    // of a file, such a refusal means that there is no map; for a folder it is an error.
    let refuses =
        FaultyStore::new(server.store.clone(), |request, _| match request.key.ends_with("manifest.json") {
            true => Fault::Refused,
            false => Fault::None,
        });
    assert!(!on(refuses.clone(), "drive/one.pcd").has_map(&|| false).unwrap());
    assert!(message_of(on(refuses, "maps/city").has_map(&|| false)).contains("not for you"));

    let wait_get_per_call = Duration::from_secs(60);
    let slow = ThrottleConfig { wait_get_per_call, ..ThrottleConfig::default() };
    let slow = on(Arc::new(ThrottledStore::new(server.store.fork(), slow)), "maps/city");
    let began = Instant::now();
    let stopped = slow.has_map(&|| began.elapsed() > Duration::from_millis(300));
    assert!(matches!(stopped, Err(Error::Stopped)), "{stopped:?}");
    assert!(began.elapsed() < Duration::from_secs(10));
}

/// The manifest is stored, but its response is lost.
#[test]
fn a_push_with_a_lost_last_response_succeeds() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let map = folder.path().join("map");
    drop(city(&map, Storage::OctoMap, false));
    let store = FaultyStore::new(server.store.clone(), |request, _| {
        let is_last = request.kind == Kind::Put && request.key.ends_with("manifest.json");
        if is_last { Fault::DoneBefore } else { Fault::None }
    });
    let bucket = Bucket::on(store, "maps/city", "s3://test/maps/city").unwrap();
    push_now(&map, &bucket);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
    add_scans(&map, 100, 1);
    push_now(&map, &bucket);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
    assert!(std::fs::read_to_string(map.join("bucket_states")).unwrap().contains("there"));
}

/// Missing or damaged objects are uploaded again, as the error message suggests.
#[test]
fn a_map_damaged_in_the_bucket_is_resent() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, true));
    let first = push_now(&map, &bucket);
    let resend = || push(map.as_path(), &bucket, RESEND, |_, _| {});
    let check = |what: &str| {
        let there = BucketDisk::open(bucket.clone()).unwrap().into_map_path();
        assert!(verify(there, |finding| panic!("{what}: {finding}"), |_, _| {}).unwrap().is_whole());
        assert_eq!(digest_there(&bucket).unwrap(), digest(&map), "{what}");
    };
    let manifest = Key::from("maps/city/manifest.json");
    let listed: serde_json::Value = serde_json::from_slice(&server.get(&manifest)).unwrap();
    let page = listed["pages"].as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned();
    let pulled = folder.path().join("pulled");
    for (number, key) in server.objects().into_iter().enumerate() {
        let is_page = key.as_ref().ends_with(&page);
        // A sample is enough.
        if number % 29 != 0 && !is_page {
            continue;
        }
        for content in [None, Some(b"other".to_vec())] {
            match content {
                Some(content) => server.put(&key, content),
                None => server.delete(&key),
            }
            let printed = message_of(pull(&bucket, &pulled, false, |_, _| {}));
            assert!(printed.contains("push --resend"), "{printed}");
            let _ = std::fs::remove_dir_all(folder.path().join("pulled.unfinished"));
            if is_page {
                let printed = message_of(push(map.as_path(), &bucket, KEEP, |_, _| {}));
                assert!(printed.contains("push --resend"), "{printed}");
            }
            let sent = resend().unwrap();
            assert_eq!((sent.objects_sent, sent.bytes_sent), (first.objects_sent, first.bytes_sent));
            check(key.as_ref());
        }
    }
    for content in [b"{".to_vec(), Vec::new(), server.get(&manifest)[1..].to_vec()] {
        server.put(&manifest, content);
        push(map.as_path(), &bucket, KEEP, |_, _| {}).unwrap_err();
        resend().unwrap();
        check("the manifest");
    }
    // --resend replaces neither a manifest of a later version nor the manifest of another map.
    let text = String::from_utf8(server.get(&manifest)).unwrap();
    server.put(&manifest, text.replace("\"version\": 1", "\"version\": 2").into_bytes());
    assert!(message_of(resend()).contains("version is 2"));
    server.put(&manifest, text.into_bytes());
    let other = folder.path().join("other");
    drop(city(&other, Storage::OctoMap, false));
    let refused = push(other.as_path(), &bucket, RESEND, |_, _| {});
    assert!(matches!(refused, Err(Error::Mismatch { what: "the id", .. })));
}

/// A resumed push does not upload objects again and makes few requests.
#[test]
fn an_interrupted_push_resumes() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let map = folder.path().join("map");
    drop(city(&map, Storage::OctoMap, true));
    let whole = {
        let bucket = Bucket::on(Arc::new(InMemory::new()), "maps/city", "s3://test/maps/city").unwrap();
        push_now(&map, &bucket).objects_sent
    };
    assert!(whole > 100, "{whole}");
    let most = whole as usize / 2;
    let puts = std::sync::atomic::AtomicUsize::new(0);
    let breaks = FaultyStore::new(server.store.clone(), move |request, _| match request.kind {
        Kind::Put if puts.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= most => Fault::Refused,
        _ => Fault::None,
    });
    let at =
        |store: &Arc<FaultyStore>| Bucket::on(store.clone(), "maps/city", "s3://test/maps/city").unwrap();
    push(map.as_path(), &at(&breaks), KEEP, |_, _| {}).unwrap_err();
    // A first push checks only its first objects for existence.
    assert!(breaks.requests(Kind::Head).len() < 48, "{}", breaks.requests(Kind::Head).len());
    // Wait for the requests in flight.
    std::thread::sleep(Duration::from_millis(200));
    let there = server.objects().len();
    assert_eq!(there, most);

    let store = FaultyStore::new(server.store.clone(), |_, _| Fault::None);
    let bucket = at(&store);
    let again = push_now(&map, &bucket);
    assert_eq!(again.objects_sent + there as u64, whole);
    assert!(0 < again.tiles_sent && again.tiles_sent < again.tiles, "{again:?}");
    assert_eq!(store.requests(Kind::Put).len() as u64, again.objects_sent + 1);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
    let request = store.requests(Kind::Head).len();
    let before = store.requests(Kind::Put).len();
    let mut keeping = config(Storage::OctoMap);
    keeping.keeps_scans = true;
    let mut mapper = OutOfCoreTileMapper::open(&map, keeping).unwrap();
    mapper.insert_scan(&scan_at(50, 30.0)).unwrap();
    mapper.flush().unwrap();
    push_now(&map, &bucket);
    let [heads, puts] =
        [store.requests(Kind::Head).len() - request, store.requests(Kind::Put).len() - before];
    assert!(0 < puts && heads <= puts, "{heads} of {puts}");
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
}

/// An object with the expected name but another length is uploaded again.
#[test]
fn an_object_of_another_length_is_replaced() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let (map, bucket) = (folder.path().join("map"), server.bucket());
    drop(city(&map, Storage::OctoMap, false));
    push_now(&map, &bucket);
    server.delete(&Key::from("maps/city/manifest.json"));
    let key = server.objects().remove(0);
    server.put(&key, b"cut".to_vec());
    assert_eq!(push_now(&map, &bucket).objects_sent, 1);
    assert_eq!(digest_there(&bucket).unwrap(), digest(&map));
}
