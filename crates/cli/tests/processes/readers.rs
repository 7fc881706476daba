use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting, voxtile};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::{MapConfig, Mapper, OutOfCoreTileMapper, Scan};

const SCANS: usize = 40;
const READERS: usize = 3;

#[test]
fn readers_see_only_digests_of_flushes() {
    let seconds = setting("VOXTILE_READER_SECONDS", 4);
    let rounds = 2 + 2 * seconds as usize;
    let scans = Scans::new(SCANS, rounds);
    let (_folder, map) = folder_for_maps();
    assert!(scans.build(&map, &["--flush-every", "1"]).status().unwrap().success());

    let done = AtomicBool::new(false);
    let until = Instant::now() + Duration::from_secs(seconds);
    let different = Mutex::new(BTreeSet::new());
    let (flushed, seen) = thread::scope(|scope| {
        let readers: Vec<_> = (0..READERS)
            .map(|_| {
                scope.spawn(|| {
                    let mut seen = Vec::new();
                    while !done.load(Ordering::Relaxed) {
                        let answer = digest(&map).expect("a reader succeeds while a writer flushes");
                        different.lock().unwrap().insert(answer.0);
                        seen.push(answer);
                    }
                    seen
                })
            })
            .collect();
        let mut round = 1;
        // On a busy machine, continue until the readers have seen several flushes.
        let is_enough = || Instant::now() >= until && different.lock().unwrap().len() > 3;
        while !is_enough() && round < rounds {
            let how = ["--append", "--again", "--flush-every", "1"];
            let output = scans.build(&map, &how).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            round += 1;
        }
        done.store(true, Ordering::Relaxed);
        let seen: Vec<_> = readers.into_iter().flat_map(|reader| reader.join().unwrap()).collect();
        (round * SCANS, seen)
    });
    for (number, digest) in &seen {
        assert_eq!(digest, &scans.digests[*number], "after {number} scans");
    }
    let different = different.into_inner().unwrap();
    println!("{} answers of {} flushes while {flushed} were made", seen.len(), different.len());
    assert!(different.len() > 3, "the readers saw too few flushes of the writer");
    assert!(is_whole(&map));
}

/// While a command reads the list of scans, a writer flushes and removes files. The command reads the list again, but
/// prints it once.
#[test]
fn a_retried_list_of_scans_is_printed_once() {
    const COUNT: u64 = 3000;
    let (_folder, map) = folder_for_maps();
    let config = MapConfig::new(0.5, 5.0).unwrap().with_kept_scans(true);
    let mut mapper = OutOfCoreTileMapper::create(&map, config).unwrap();
    let scan = Scan { origin: [0.0; 3], points: vec![[1.0, 0.5, 0.25]], intensities: None };
    for _ in 0..COUNT {
        mapper.insert_scan(&scan).unwrap();
    }
    mapper.flush().unwrap();
    let mut command = voxtile();
    command.args(["scans", map.to_str().unwrap(), "--each", "--json"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    // The output is larger than the pipe's buffer.
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let first = lines.next();
    mapper.insert_scan(&scan).unwrap();
    mapper.flush().unwrap();
    let kept = std::fs::read_dir(map.join("kept_scans")).unwrap().map(|entry| entry.unwrap().path());
    let catalog = kept.filter(|path| path.to_str().unwrap().contains("catalog")).min().unwrap();
    let half = std::fs::metadata(&catalog).unwrap().len() / 2;
    assert!(half > 1 << 16, "the list must be longer than a read buffer");
    std::fs::OpenOptions::new().write(true).open(&catalog).unwrap().set_len(half).unwrap();
    let rows =
        first.into_iter().chain(lines).map(|line| serde_json::from_str::<Value>(&line.unwrap()).unwrap());
    let numbers: Vec<u64> = rows.filter_map(|row| row["number"].as_u64()).collect();
    assert!(
        numbers.iter().copied().eq(1..=COUNT),
        "{} rows, the last ones {:?}",
        numbers.len(),
        numbers.last()
    );
    assert!(child.wait().unwrap().success());
}
