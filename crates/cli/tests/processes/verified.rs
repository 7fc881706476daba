use crate::survey::{Scans, digest, setting, voxtile};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use testkit::memory_folder::memory_folder;
use voxtile::MapReader;
use voxtile::integrity::{Finding, Severity, verify};

/// Returns the poses of a map's scans, moved, as lines of a file.
fn poses(map: &Path, by_m: f64) -> String {
    let scans = MapReader::open(map, 0).unwrap().scans().unwrap();
    let line = |[x, y, z]: [f64; 3]| format!("1 0 0 {} 0 1 0 {y} 0 0 1 {z}\n", x + by_m);
    scans.iter().map(|scan| line(scan.origin_m)).collect()
}

fn run(arguments: &[&str]) {
    let output = voxtile().args(arguments).stdin(Stdio::null()).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Returns the damage that a verification finds, and the number of places that it could not decide.
fn damage_in(map: &Path) -> (Vec<String>, u64) {
    let mut damage = Vec::new();
    let note = |finding: &Finding| {
        if finding.severity == Severity::Damage {
            damage.push(finding.to_string());
        }
    };
    let verification = verify(map, note, |_, _| ()).unwrap_or_else(|error| panic!("{error:#}"));
    (damage, verification.unsettled)
}

/// For `VOXTILE_READER_SECONDS`, processes change a map, and each removes the files that the previous one kept for
/// readers.
#[test]
fn verify_finds_no_damage_during_concurrent_remaps_and_reverts() {
    let scans = Scans::new(8, 1);
    // No syncs, to make more changes in the same time.
    let folder = memory_folder();
    let map = folder.path().join("map");
    assert!(scans.build(&map, &["--keep-scans", "--tile-size", "4"]).status().unwrap().success());
    let text = map.to_str().unwrap();
    let file = folder.path().join("moved.txt");
    fs::write(&file, poses(&map, 0.7)).unwrap();
    run(&["snapshot", text, "s"]);
    let before = digest(&map).unwrap();
    let until = Instant::now() + Duration::from_secs(setting("VOXTILE_READER_SECONDS", 4));
    let (has_ended, changes) = (AtomicBool::new(false), AtomicU64::new(0));
    let mut looks = [0; 2];
    thread::scope(|scope| {
        scope.spawn(|| {
            while Instant::now() < until {
                run(&["remap", text, "--poses", file.to_str().unwrap()]);
                run(&["revert", text, "s"]);
                run(&["remove-scans", text, "--scans", "2..3"]);
                run(&["snapshot", text, "t"]);
                run(&["revert", text, "s"]);
                run(&["snapshot", text, "t", "--delete"]);
                changes.fetch_add(6, Ordering::Relaxed);
            }
            has_ended.store(true, Ordering::Relaxed);
        });
        while !has_ended.load(Ordering::Relaxed) {
            let (damage, unsettled) = damage_in(&map);
            assert!(damage.is_empty(), "after {looks:?} looks, {changes:?} changes: {damage:#?}");
            looks[0] += 1;
            looks[1] += u64::from(unsettled > 0);
        }
    });
    println!("{} looks, {} not settled, {changes:?} changes", looks[0], looks[1]);
    assert!(looks[0] > 5 && looks[1] < looks[0], "{looks:?}");
    assert_eq!(digest(&map), Ok(before));
    assert_eq!(damage_in(&map), (Vec::new(), 0));
}
