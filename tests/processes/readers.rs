use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting};
use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

const SCANS: usize = 40;
const READERS: usize = 3;

#[test]
fn every_digest_that_a_reader_sees_is_that_of_some_flush() {
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
                        let answer = digest(&map).expect("a reader is never disturbed");
                        different.lock().unwrap().insert(answer.0);
                        seen.push(answer);
                    }
                    seen
                })
            })
            .collect();
        let mut round = 1;
        // On a busy machine until the readers have seen something of it.
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
    assert!(different.len() > 3, "the readers did not read beside the writer");
    assert!(is_whole(&map));
}
