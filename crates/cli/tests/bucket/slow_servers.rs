//! Tests with servers that are silent, disconnect, send slowly or drop responses.

use crate::city::{KEEP, city, digest, message_of};
use crate::s3_server::{S3Server, SeenRequest, Trouble};
use crate::server::Server;
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use testkit::random_scans::{Random, random_scan};
use voxtile::{Error, MapConfig, Mapper, OutOfCoreTileMapper, Storage};
use voxtile_bucket::object_store::throttle::{ThrottleConfig, ThrottledStore};
use voxtile_bucket::{Bucket, FetchedFiles, push};

const URL: &str = "s3://robots/maps/city";

fn run(server: &S3Server, arguments: &[&str]) -> (Output, Duration) {
    let began = Instant::now();
    (server.voxtile(arguments).output().unwrap(), began.elapsed())
}

fn texts(output: &Output) -> [String; 2] {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned())
}

fn a_map(folder: &TempDir) -> String {
    let map = folder.path().join("map");
    drop(city(&map, Storage::OctoMap, false));
    map.to_str().unwrap().to_owned()
}

fn push_all(server: &S3Server, map: &str) {
    let (pushed, _) = run(server, &["push", map, URL]);
    assert!(pushed.status.success(), "{:?}", texts(&pushed));
}

fn is_object(request: &SeenRequest, method: &str) -> bool {
    request.method == method && request.key.contains("/objects/")
}

#[test]
fn a_put_without_a_response_is_reported_and_fails() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    server.trouble(|request, _| if is_object(request, "PUT") { Trouble::Silent } else { Trouble::None });
    let (failed, took) = run(&server, &["push", &map, URL, "--bucket-timeout", "2", "--json"]);
    let [out, text_out] = texts(&failed);
    assert_eq!(failed.status.code(), Some(1), "{text_out}");
    assert!(Duration::from_secs(2) <= took && took < Duration::from_secs(20), "{took:?}");
    let waiting =
        text_out.lines().find(|line| line.contains("waiting for")).unwrap_or_else(|| panic!("{text_out}"));
    for part in [URL, "PUT maps/city/objects/", &server.address.to_string(), "attempt 1", "started"] {
        assert!(waiting.contains(part), "{part}: {waiting}");
    }
    let error: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(error["error"]["kind"], "no_answer", "{out}");
    let message = error["error"]["message"].as_str().unwrap();
    for part in [URL, "PUT maps/city/objects/", "2 attempts", "check the network", "--bucket-timeout"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!server.has_manifest());
    // With -q only the error is printed.
    let (quiet, _) = run(&server, &["push", &map, URL, "--bucket-timeout", "1", "-q"]);
    assert_eq!(texts(&quiet)[1].lines().count(), 1, "{:?}", texts(&quiet));

    server.trouble(|_, _| Trouble::None);
    push_all(&server, &map);
    assert_eq!(texts(&run(&server, &["digest", URL]).0)[0].trim(), digest(map.as_ref()));
}

/// The client counts bytes as sent when they are still in the buffer of a slow link.
#[test]
fn an_upload_may_use_the_whole_timeout() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    server.trouble(|request, _| if is_object(request, "PUT") { Trouble::Late(1_400) } else { Trouble::None });
    let (pushed, _) = run(&server, &["push", &map, URL, "--bucket-timeout", "2"]);
    assert!(pushed.status.success(), "{}", texts(&pushed)[1]);
    let mut sent: Vec<_> =
        server.requests().into_iter().filter(|request| is_object(request, "PUT")).collect();
    let all = sent.len();
    sent.sort_by(|a, b| a.key.cmp(&b.key));
    sent.dedup_by(|a, b| a.key == b.key);
    assert_eq!(sent.len(), all, "no object was sent twice");
}

/// Repeated uploads do not count as progress.
#[test]
fn a_long_object_without_a_response_fails() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = folder.path().join("map");
    let config = MapConfig::new(0.05, 3.2).unwrap().with_range(0.0, 3.0);
    let mut mapper = OutOfCoreTileMapper::create(&map, config).unwrap();
    mapper.insert_scan(&random_scan(&mut Random(1), [0.0; 3], 3_000)).unwrap();
    mapper.flush().unwrap();
    drop(mapper);
    let is_long = |request: &SeenRequest| request.method == "PUT" && request.bytes > 100_000;
    server.trouble(move |request, _| if is_long(request) { Trouble::Silent } else { Trouble::None });
    let (failed, took) = run(&server, &["push", map.to_str().unwrap(), URL, "--bucket-timeout", "2"]);
    let text_out = texts(&failed)[1].clone();
    assert!(server.requests().iter().any(is_long), "{:?}", server.requests());
    assert!(text_out.contains("no answer to PUT") && text_out.contains("s and 2 attempts"), "{text_out}");
    assert!(took < Duration::from_secs(20), "{took:?}");
}

#[test]
fn a_third_of_the_connections_may_be_reset() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    server.trouble(|_, number| if number % 3 == 1 { Trouble::Reset } else { Trouble::None });
    let began = Instant::now();
    push_all(&server, &map);
    let (found, _) = run(&server, &["digest", URL]);
    let [out, text_out] = texts(&found);
    assert_eq!(out.trim(), digest(map.as_ref()), "{text_out}");
    assert!(began.elapsed() < Duration::from_secs(30), "{:?}", began.elapsed());
    // Interrupted content resumes.
    server.trouble(|request, _| if request.from.is_none() { Trouble::CutOff } else { Trouble::None });
    let (found, _) = run(&server, &["digest", URL, "--bucket-timeout", "1"]);
    assert_ne!(found.status.code(), Some(0), "the manifest is never whole");
    server.trouble(|request, _| match is_object(request, "GET") && request.from.is_none() {
        true => Trouble::CutOff,
        false => Trouble::None,
    });
    let (found, _) = run(&server, &["digest", URL]);
    assert_eq!(texts(&found)[0].trim(), digest(map.as_ref()));
    assert!(server.requests().iter().any(|request| request.from.is_some_and(|from| from > 0)));
}

#[test]
fn a_truncated_response_is_no_refusal() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    // Truncate the first response, which reports that there is no manifest yet.
    server.trouble(|_, number| if number == 0 { Trouble::CutOff } else { Trouble::None });
    push_all(&server, &map);
    let [first, second] = [0, 1].map(|number| server.requests()[number].clone());
    assert_eq!((&first.method, &first.key), (&second.method, &second.key), "the request was repeated");
}

#[test]
fn a_trickling_object_fails_and_a_slow_one_does_not() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    push_all(&server, &map);
    server.trouble(|request, _| if is_object(request, "GET") { Trouble::Drips(1) } else { Trouble::None });
    let (failed, took) = run(&server, &["digest", URL, "--bucket-timeout", "1"]);
    let text_out = texts(&failed)[1].clone();
    assert_eq!(failed.status.code(), Some(1), "{text_out}");
    assert!(
        text_out.contains("no answer to GET maps/city/objects/") && text_out.contains("waiting for"),
        "{text_out}"
    );
    assert!(took < Duration::from_secs(20), "{took:?}");

    // The first response stalls after half of the content. The second sends the other 150 kB at 4 kB every 20 ms, which
    // takes longer than the timeout.
    let place = TempDir::new().unwrap();
    let content: Vec<u8> = (0..300_000_u32).map(|at| ((at * 31) >> 7) as u8).collect();
    server.put("long.bin", content.clone());
    server.trouble(|request, _| match (&*request.method, request.from) {
        ("GET", None) => Trouble::Stalls,
        _ => Trouble::Drips(4_000),
    });
    let bucket = Bucket::open(&format!("http://{}/long.bin", server.address)).unwrap();
    let bucket = bucket.with_timeout(Duration::from_millis(500));
    let began = Instant::now();
    let fetched = FetchedFiles::fetch(&bucket, place.path(), &|| false, |_, _| ()).unwrap();
    assert!(began.elapsed() > Duration::from_millis(700), "{:?}", began.elapsed());
    assert!(std::fs::read(fetched.path()).unwrap() == content);
    let from: Vec<_> = server.requests().iter().filter_map(|request| request.from).collect();
    assert_eq!(from, [content.len() / 2]);
}

/// The state in the bucket decides whether a push succeeded, and nothing overwrites another push.
#[test]
fn a_manifest_with_a_lost_response_is_written_once() {
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    for lost in [Trouble::AnswerLost, Trouble::Reset, Trouble::Silent] {
        let is_first = AtomicBool::new(true);
        server.trouble(move |request, _| {
            let is_manifest = request.method == "PUT" && request.key.ends_with("manifest.json");
            if is_manifest && is_first.swap(false, Ordering::Relaxed) { lost } else { Trouble::None }
        });
        crate::city::add_scans(map.as_ref(), 100, 1);
        let (pushed, _) = run(&server, &["push", &map, URL, "--bucket-timeout", "2"]);
        assert!(pushed.status.success(), "{:?}", texts(&pushed));
        server.trouble(|_, _| Trouble::None);
        assert_eq!(texts(&run(&server, &["digest", URL]).0)[0].trim(), digest(map.as_ref()));
        assert!(std::fs::read_to_string(folder.path().join("map/bucket_states")).unwrap().contains("there"));
    }
}

/// Covers commands with and without a signal handler.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_command_waiting_for_a_bucket() {
    use std::os::unix::process::ExitStatusExt;
    let (server, folder) = (S3Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    server.trouble(|request, _| if request.method == "PUT" { Trouble::Silent } else { Trouble::None });
    let out = folder.path().join("city.ply");
    let out = out.to_str().unwrap();
    let built = folder.path().join("built");
    let built = built.to_str().unwrap();
    let check = |arguments: &[&str], signal: &str, is_caught: bool, method: &str| {
        let child = server.voxtile(arguments).spawn().unwrap();
        let since = Instant::now();
        while !server.requests().iter().any(|request| is_object(request, method)) {
            assert!(since.elapsed() < Duration::from_secs(60), "{arguments:?}");
            std::thread::sleep(Duration::from_millis(20));
        }
        std::thread::sleep(Duration::from_millis(100));
        let sent = Instant::now();
        Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let ended = child.wait_with_output().unwrap();
        assert!(sent.elapsed() < Duration::from_secs(2), "{arguments:?}: {:?}", sent.elapsed());
        let text_out = texts(&ended);
        match is_caught {
            true => assert_eq!(ended.status.code(), Some(130), "{arguments:?}: {text_out:?}"),
            false => assert!(ended.status.signal().is_some(), "{arguments:?}: {text_out:?}"),
        }
    };
    check(&["push", &map, URL], "-INT", false, "PUT");
    assert!(!server.has_manifest());
    server.trouble(|_, _| Trouble::None);
    push_all(&server, &map);
    for signal in ["-INT", "-TERM"] {
        server.trouble(|request, _| if is_object(request, "GET") { Trouble::Silent } else { Trouble::None });
        check(&["digest", URL], signal, false, "GET");
        server.trouble(|request, _| if is_object(request, "GET") { Trouble::Silent } else { Trouble::None });
        check(&["export", URL, "-o", out], signal, true, "GET");
        server.trouble(|request, _| if is_object(request, "GET") { Trouble::Silent } else { Trouble::None });
        check(&["build", URL, "-o", built, "--resolution", "0.4"], signal, true, "GET");
    }
    assert!(!folder.path().join("city.ply").exists() && !folder.path().join("built").exists());
}

/// A command fails fast if it never reached the server.
#[test]
fn a_wrong_address_fails_soon() {
    let closed = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let bucket = Bucket::open(&format!("http://{closed}/city")).unwrap();
    let began = Instant::now();
    let text_out = message_of(bucket.has_map(&|| false));
    assert!(
        text_out.contains("no answer to HEAD city/manifest.json") && text_out.contains("4 attempts"),
        "{text_out}"
    );
    assert!(text_out.contains(&closed.to_string()), "{text_out}");
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
}

/// Custom stores have timeouts and can be stopped, too.
#[test]
fn a_hanging_store_times_out_or_is_stopped() {
    let (server, folder) = (Server::new(), TempDir::new().unwrap());
    let map = a_map(&folder);
    let wait_put_per_call = Duration::from_secs(60);
    let slow = ThrottleConfig { wait_put_per_call, ..ThrottleConfig::default() };
    let store = Arc::new(ThrottledStore::new(server.store.fork(), slow));
    let bucket = Bucket::on(store, "maps/city", "s3://test/maps/city").unwrap();
    let began = Instant::now();
    let hasty = bucket.clone().with_timeout(Duration::from_millis(400));
    let failed = push(map.as_str(), &hasty, KEEP, |_, _| {});
    assert!(
        matches!(&failed, Err(Error::NoAnswer { unanswered, .. }) if unanswered.attempts == 2),
        "{failed:?}"
    );
    let stop = Arc::new(AtomicBool::new(false));
    let stopper = stop.clone();
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        stopper.store(true, Ordering::Relaxed);
    });
    let stopped = push(map.as_str(), &bucket.with_stop(stop), KEEP, |_, _| {});
    assert!(matches!(stopped, Err(Error::Stopped)), "{stopped:?}");
    assert!(began.elapsed() < Duration::from_secs(20), "{:?}", began.elapsed());
}
