//! Files in a bucket that are no map, fetched for commands that read files.

use crate::city::message_of;
use crate::faulty_store::{Fault, FaultyStore, Kind};
use crate::server::Server;
use crate::web_server::serve_whole;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use voxtile::Error;
use voxtile_bucket::object_store::ObjectStore;
use voxtile_bucket::object_store::path::Path as Key;
use voxtile_bucket::object_store::throttle::{ThrottleConfig, ThrottledStore};
use voxtile_bucket::{Bucket, FetchedFiles};

/// Files of a bucket are fetched to a temporary folder, removed after the last use; the URL of a file means only that
/// file.
#[test]
fn files_are_fetched_and_removed_after_use() {
    let (server, place) = (Server::new(), TempDir::new().unwrap());
    let files: [(&str, Vec<u8>); 3] = [
        ("poses.txt", b"1 2 3".to_vec()),
        ("scans/1.pcd", vec![7; 100_000]),
        ("scans/deep/2.pcd", Vec::new()),
    ];
    for (name, content) in &files {
        server.put(&Key::from(format!("drive/{name}")), content.clone());
    }
    // These must not be fetched: a file of another drive, and a placeholder object of a folder.
    server.put(&Key::from("drive2/other.pcd"), vec![1]);
    server.put(&Key::from("drive/scans"), Vec::new());
    let at = |prefix: &str| Bucket::on(server.store.clone(), prefix, "s3://test/drive").unwrap();
    let mut reported = Vec::new();
    let fetched =
        FetchedFiles::fetch(&at("drive"), place.path(), &|| false, |done, all| reported.push((done, all)))
            .unwrap();
    assert_eq!((fetched.files(), fetched.bytes()), (3, 100_005));
    assert_eq!(reported.last(), Some(&(100_005, 100_005)));
    for (name, content) in &files {
        assert_eq!(&std::fs::read(fetched.path().join(name)).unwrap(), content, "{name}");
    }
    assert!(fetched.path().starts_with(place.path()));
    drop(fetched);
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);

    let one = FetchedFiles::fetch(&at("drive/scans/1.pcd"), place.path(), &|| false, |_, _| ()).unwrap();
    assert!(one.path().ends_with("1.pcd") && one.path().is_file());
    let nothing =
        FetchedFiles::fetch(&at("driv"), place.path(), &|| false, |_, _| ()).unwrap_err().to_string();
    assert!(nothing.contains("s3://test/drive: there is nothing"), "{nothing}");
}

/// A stopped fetch ends soon and leaves no files.
#[test]
fn a_stopped_fetch_ends_soon_and_leaves_no_files() {
    let (server, place) = (Server::new(), TempDir::new().unwrap());
    for number in 0..20 {
        server.put(&Key::from(format!("drive/{number}.pcd")), vec![1; 100]);
    }
    let slow = ThrottleConfig { wait_get_per_byte: Duration::from_secs(1), ..ThrottleConfig::default() };
    let store = Arc::new(ThrottledStore::new(server.store.fork(), slow));
    let bucket = Bucket::on(store, "drive", "s3://test/drive").unwrap();
    let began = Instant::now();
    let is_stopped = || began.elapsed() > Duration::from_secs(1);
    let stopped = FetchedFiles::fetch(&bucket, place.path(), &is_stopped, |_, _| ());
    assert!(matches!(stopped, Err(Error::Stopped)), "{stopped:?}");
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
}

/// Stores a drive of one long file.
fn recording(server: &Server, bytes: usize) -> Vec<u8> {
    let content: Vec<u8> = (0..bytes).map(|at| ((at * 31) >> 7) as u8).collect();
    server.put(&Key::from("drive/long.mcap"), content.clone());
    content
}

/// No request is as long as the whole file, and data received before an error is kept.
#[test]
fn a_long_file_is_fetched_in_ranges() {
    let (server, place) = (Server::new(), TempDir::new().unwrap());
    let content = recording(&server, (33 << 20) + 5);
    let store = FaultyStore::new(server.store.clone(), |request, before| match request.kind {
        Kind::Get if before % 3 == 0 => Fault::CutOff,
        Kind::Get if before % 3 == 1 => Fault::Fails,
        _ => Fault::None,
    });
    let bucket = Bucket::on(store.clone(), "drive", "s3://test/drive").unwrap();
    let fetched = FetchedFiles::fetch(&bucket, place.path(), &|| false, |_, _| ()).unwrap();
    assert!(std::fs::read(fetched.path().join("long.mcap")).unwrap() == content);
    for request in store.requests(Kind::Get) {
        assert!(request.bytes.is_some_and(|bytes| bytes <= 16 << 20), "{request:?}");
    }
}

#[test]
fn a_file_changed_between_two_ranges_is_not_mixed() {
    let (server, place) = (Server::new(), TempDir::new().unwrap());
    let mut content = recording(&server, 20 << 20);
    content.reverse();
    let (inner, other) = (server.store.clone(), std::sync::Mutex::new(Some(content)));
    let store = FaultyStore::new(server.store.clone(), move |request, _| {
        // After the first range.
        if request.kind == Kind::Get
            && request.bytes.is_some_and(|bytes| bytes < 16 << 20)
            && let Some(content) = other.lock().unwrap().take()
        {
            let key = Key::from("drive/long.mcap");
            let put = inner.put_opts(&key, content.into(), Default::default());
            assert!(futures_util::FutureExt::now_or_never(put).unwrap().is_ok());
        }
        Fault::None
    });
    let bucket = Bucket::on(store, "drive", "s3://test/drive").unwrap();
    let changed = message_of(FetchedFiles::fetch(&bucket, place.path(), &|| false, |_, _| ()));
    assert!(changed.contains("drive/long.mcap") && changed.contains("was changed"), "{changed}");
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn a_long_file_is_fetched_from_a_server_without_ranges() {
    let place = TempDir::new().unwrap();
    let content: Vec<u8> = (0..17_usize << 20).map(|at| ((at * 31) >> 7) as u8).collect();
    let address = serve_whole(content.clone());
    let bucket = Bucket::open(&format!("http://{address}/long.mcap")).unwrap();
    assert!(!bucket.has_map(&|| false).unwrap());
    let fetched = FetchedFiles::fetch(&bucket, place.path(), &|| false, |_, _| ()).unwrap();
    assert!(std::fs::read(fetched.path()).unwrap() == content);
}
