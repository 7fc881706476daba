use crate::survey::{Scans, digest, folder_for_maps, voxtile, wait_until};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn command(arguments: &[&str]) -> Command {
    let mut command = voxtile();
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs a command that must succeed and returns its output.
fn answer(arguments: &[&str]) -> String {
    let output = command(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Kills a process with SIGKILL when `is_so` holds. Returns false if the process ended before.
fn kill_when(mut child: Child, mut is_so: impl FnMut() -> bool) -> bool {
    let mut has_ended = false;
    wait_until("the moment of the kill", || {
        has_ended = child.try_wait().unwrap().is_some();
        has_ended || is_so()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    !has_ended
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to),
            false => drop(fs::copy(entry.path(), to).unwrap()),
        }
    }
}

fn log_bytes(map: &Path) -> u64 {
    fs::metadata(map.join("commits.log")).unwrap().len()
}

/// After a kill between the commit and the removal of files, `verify` reports the files and the same command removes
/// them.
#[test]
fn a_removal_killed_after_its_commit_is_completed_by_the_same_command() {
    let scans = Scans::new(12, 1);
    let (folder, map) = folder_for_maps();
    // Small tiles: each tile's files are renamed after the commit, which takes time.
    assert!(scans.build(&map, &["--keep-scans", "--tile-size", "2"]).status().unwrap().success());
    let first = |map: &Path| map.join("kept_scans/segment.1");
    assert!(first(&map).exists());
    for attempt in 0..20 {
        let map = {
            let copied = folder.path().join(format!("copy{attempt}"));
            copy(&map, &copied);
            copied
        };
        let text = map.to_str().unwrap();
        let remove = ["remove-scans", text, "--scans", "2..3"];
        let before = log_bytes(&map);
        // The commit appends a record or compacts the log.
        let was_killed = kill_when(command(&remove).spawn().unwrap(), || log_bytes(&map) != before);
        if !was_killed || !first(&map).exists() {
            continue;
        }
        let reported = answer(&["verify", text]);
        assert!(reported.contains("leftovers: ") && reported.contains("intact"), "{reported}");
        let output = command(&remove).output().unwrap();
        let reported = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(reported.contains("completed") || reported.contains("2 scans removed"), "{reported}");
        assert!(!first(&map).exists(), "the removed points are still on disk");
        assert!(!answer(&["verify", text]).contains("leftovers"));
        return;
    }
    panic!("the command was faster than the kill, 20 times");
}

/// The command is killed between its snapshot and its commit.
#[test]
fn a_removal_killed_after_its_snapshot_is_completed_by_the_same_command() {
    let scans = Scans::new(12, 1);
    let (_folder, map) = folder_for_maps();
    assert!(scans.build(&map, &["--keep-scans"]).status().unwrap().success());
    let (text, before) = (map.to_str().unwrap(), digest(&map).unwrap());
    let remove = ["remove-scans", text, "--scans", "2..3", "--keep-as", "before"];
    let snapshot = map.join("snapshots/before");
    let was_killed = kill_when(command(&remove).spawn().unwrap(), || snapshot.exists());
    assert!(was_killed, "the command was faster than the kill");
    assert!(answer(&remove).contains("2 scans removed"));
    assert_eq!(digest(Path::new(&format!("{text}@before"))), Ok(before.clone()));
    assert_ne!(digest(&map), Ok(before));
}
