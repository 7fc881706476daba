use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting, voxtile};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

fn merge(maps: [&Path; 2], output: &Path) -> Command {
    let mut command = voxtile();
    command.arg("merge").args(maps).arg("-o").arg(output);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

#[test]
fn a_killed_merge_leaves_no_map_and_succeeds_later() {
    let (folder, a) = folder_for_maps();
    let b = folder.path().join("b");
    for (map, scans) in [(&a, 20), (&b, 30)] {
        assert!(Scans::new(scans, 1).build(map, &[]).status().unwrap().success());
    }
    let whole = folder.path().join("whole");
    let started = Instant::now();
    assert!(merge([&a, &b], &whole).status().unwrap().success());
    let whole_us = started.elapsed().as_micros() as u64;
    let expected = digest(&whole).unwrap();
    let output = folder.path().join("merged");
    let kills = setting("VOXTILE_KILLS", 24) / 2;
    let (mut killed, mut ended) = (0, 0);
    while killed < kills {
        let mut child = merge([&a, &b], &output).spawn().unwrap();
        // Spread the kills evenly over the duration of a merge and a little longer.
        sleep(Duration::from_micros(whole_us * ((killed + ended) * 7 % 24) / 20));
        child.kill().unwrap();
        let run = child.wait_with_output().unwrap();
        if run.status.code().is_none() {
            killed += 1;
        } else {
            ended += 1;
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        }
        match digest(&output) {
            // The kill may be after the end of the work.
            Ok(found) => {
                assert_eq!(found, expected);
                assert!(is_whole(&output));
                std::fs::remove_dir_all(&output).unwrap();
            }
            Err(message) => assert!(message.contains("no map here"), "{message}"),
        }
        assert!(ended < 20 * kills, "every merge ended before its kill");
    }
    let last = merge([&a, &b], &output).output().unwrap();
    assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));
    assert_eq!(digest(&output).unwrap(), expected);
    let left = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert!(left.into_iter().all(|name| !name.contains("unfinished")));
    println!("{killed} kills, {ended} too late");
}
