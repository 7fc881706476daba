use crate::survey::{StreamedBuild, digest, flushed_scans, folder_for_maps, inputs, is_whole, wait_until};
use std::path::Path;

/// Options of a command that a script repeats until it succeeds.
const HOW: [&str; 2] = ["--append", "--resume"];

fn build_whole(map: &Path, scans: &[voxtile::Scan]) {
    let mut build = StreamedBuild::spawn(map, &HOW);
    build.write(scans);
    assert!(build.end().success());
}

#[test]
fn a_repeated_command_adds_every_scan_of_every_input_once() {
    let (first, second) = (StreamedBuild::scans(1, 12), StreamedBuild::scans(2, 9));
    let all: Vec<_> = first.iter().chain(&second).cloned().collect();
    let expected = (21, StreamedBuild::digest_of(&all));
    let (_folder, map) = folder_for_maps();
    build_whole(&map, &first);
    assert_eq!(flushed_scans(&map), Some(12));

    // Killed after its start and before its first flush.
    let mut build = StreamedBuild::spawn(&map, &[&HOW[..], &["--flush-every", "end"]].concat());
    build.write(&second[..4]);
    wait_until("the second input is begun", || inputs(&map) == 2);
    build.kill();
    assert_eq!(flushed_scans(&map), Some(12));

    // Then killed twice after a flush: the flushed scans are skipped.
    for flushed in [3, 6] {
        let mut build = StreamedBuild::spawn(&map, &[&HOW[..], &["--flush-every", "3"]].concat());
        build.write(&second[..flushed + 1]);
        wait_until("scans are flushed", || flushed_scans(&map) == Some(12 + flushed as u64));
        build.kill();
    }
    build_whole(&map, &second);
    assert_eq!(digest(&map).unwrap(), expected);
    // Once more, with nothing left to do.
    for scans in [&second, &first, &second] {
        build_whole(&map, scans);
    }
    assert_eq!(digest(&map).unwrap(), expected);
    assert!(is_whole(&map));
}
