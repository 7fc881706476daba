use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting, voxtile};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

fn command(arguments: &[&str]) -> Command {
    let mut command = voxtile();
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[test]
fn killed_snapshots_reverts_and_deletions_are_atomic() {
    let scans = Scans::new(16, 2);
    let (_folder, map) = folder_for_maps();
    assert!(scans.build(&map, &[]).status().unwrap().success());
    let map_text = map.to_str().unwrap();
    let run = |arguments: &[&str]| assert!(command(arguments).status().unwrap().success(), "{arguments:?}");
    run(&["snapshot", map_text, "base"]);
    assert!(scans.build(&map, &["--append", "--again"]).status().unwrap().success());
    run(&["snapshot", map_text, "twice"]);
    let past = |name: &str| PathBuf::from(format!("{map_text}@{name}"));
    let expected = [digest(&past("base")).unwrap(), digest(&past("twice")).unwrap()];
    assert_eq!(expected[0], (16, scans.digests[16].clone()));
    assert_eq!(expected[1], (32, scans.digests[32].clone()));
    let whole_us = {
        let started = Instant::now();
        run(&["revert", map_text, "base"]);
        started.elapsed().as_micros() as u64
    };
    let (mut state, mut seed, mut happened) = (0, setting("VOXTILE_SEED", 1), 0);
    for number in 0..setting("VOXTILE_KILLS", 24) {
        let to = 1 - state;
        let name = ["base", "twice"][to];
        let arguments: &[&str] = match number % 4 {
            0 => &["snapshot", map_text, "third"],
            1 => &["snapshot", map_text, "third", "--delete"],
            _ => &["revert", map_text, name],
        };
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut child = command(arguments).spawn().unwrap();
        sleep(Duration::from_micros((seed >> 33) % (whole_us * 5 / 4)));
        child.kill().unwrap();
        child.wait().unwrap();
        let found = digest(&map).unwrap();
        assert!(expected.contains(&found), "kill {number}: {found:?}");
        happened += u64::from(found == expected[to]);
        state = usize::from(found == expected[1]);
        assert_eq!(digest(&past("base")).as_ref(), Ok(&expected[0]), "kill {number}");
        assert_eq!(digest(&past("twice")).as_ref(), Ok(&expected[1]), "kill {number}");
        if let Ok(third) = digest(&past("third")) {
            assert!(expected.contains(&third), "kill {number}");
        }
        if number % 10 == 0 {
            assert!(is_whole(&map), "kill {number}");
        }
    }
    run(&["revert", map_text, "base"]);
    assert_eq!(digest(&map).as_ref(), Ok(&expected[0]));
    assert!(is_whole(&map));
    println!("{happened} reverts had happened when they were killed");
}
