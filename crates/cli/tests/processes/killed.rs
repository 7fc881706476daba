use crate::random::Random;
use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting, voxtile};
use std::fs;
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn a_build_killed_repeatedly_gives_the_same_map() {
    let scans = Scans::new(24, 1);
    let hows = ["octomap", "compact"].map(|storage| ["--resume", "--flush-every", "2", "--storage", storage]);
    let whole_us = {
        let (_folder, map) = folder_for_maps();
        let started = Instant::now();
        assert!(scans.build(&map, &hows[0]).status().unwrap().success());
        started.elapsed().as_micros() as u64
    };
    let kills = setting("VOXTILE_KILLS", 24);
    let mut random = Random(setting("VOXTILE_SEED", 1));
    let (mut killed, mut lives, mut in_vain) = (0, 0, 0);
    while killed < kills {
        let (_folder, map) = folder_for_maps();
        lives += 1;
        let mut attempts = 0;
        loop {
            let mut child = scans.build(&map, &hows[lives % 2]).spawn().unwrap();
            // Most kills hit the start of the process and the creation, opening or recovery of the map.
            // Builds may be slower than when measured, so the time grows with the attempts.
            attempts += 1;
            let within_us = (whole_us + whole_us * attempts / 20) / [2, 8, 64][random.below(3) as usize];
            sleep(Duration::from_micros(random.below(within_us.max(1))));
            let has_ended = child.try_wait().unwrap().is_some();
            child.kill().unwrap();
            let output = child.wait_with_output().unwrap();
            if has_ended {
                assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
                break;
            }
            killed += 1;
            match digest(&map) {
                Ok((number, digest)) => assert_eq!(digest, scans.digests[number], "after {number} scans"),
                Err(message) if message.contains("no map here") => in_vain += 1,
                Err(message) => panic!("kill {killed}: {message}"),
            }
        }
        assert_eq!(digest(&map), Ok((24, scans.digests[24].clone())));
        assert!(is_whole(&map));
    }
    println!("{killed} kills in {lives} builds, {in_vain} of them before there was a map");
}

#[test]
fn a_killed_conversion_leaves_no_new_map_or_a_complete_one() {
    let scans = Scans::new(12, 1);
    let (_folder, map) = folder_for_maps();
    assert!(scans.build(&map, &[]).status().unwrap().success());
    let expected = digest(&map).unwrap();
    let new = map.with_file_name("new");
    let convert = |storage| {
        let mut command = voxtile();
        command.arg("convert").arg(&map).arg("-o").arg(&new).args(["--storage", storage]);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    let started = Instant::now();
    assert!(convert("compact").status().unwrap().success());
    let whole_us = started.elapsed().as_micros() as u64;
    fs::remove_dir_all(&new).unwrap();
    let mut random = Random(setting("VOXTILE_SEED", 1));
    let (mut in_vain, mut whole) = (0, 0);
    for number in 0..setting("VOXTILE_KILLS", 24) {
        let storage = ["octomap", "compact"][number as usize % 2];
        let mut child = convert(storage).spawn().unwrap();
        sleep(Duration::from_micros(random.below(whole_us * 5 / 4)));
        child.kill().unwrap();
        child.wait().unwrap();
        match digest(&new) {
            Ok(found) => {
                assert_eq!(found, expected, "kill {number}");
                fs::remove_dir_all(&new).unwrap();
                whole += 1;
            }
            Err(message) if message.contains("no map here") => in_vain += 1,
            Err(message) => panic!("kill {number}: {message}"),
        }
        assert_eq!(digest(&map), Ok(expected.clone()), "kill {number}");
    }
    assert!(convert("compact").status().unwrap().success());
    assert!(is_whole(&new) && digest(&new) == Ok(expected));
    println!("{in_vain} kills before there was a new map, {whole} after");
}
