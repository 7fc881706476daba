use crate::survey::{
    Scans, StreamedBuild, digest, flushed_scans, folder_for_maps, signal, signals_are_caught, voxtile,
    wait_until,
};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;
use voxtile::Scan;

#[test]
fn a_signal_ends_a_build_with_all_its_scans_in_the_map() {
    let scans = Scans::new(60, 1);
    for name in ["TERM", "INT"] {
        let (_folder, map) = folder_for_maps();
        let mut stopped = 0;
        loop {
            let mut child = scans.build(&map, &["--resume", "--flush-every", "end"]).spawn().unwrap();
            wait_until("signals are caught", || {
                signals_are_caught(child.id()) || child.try_wait().unwrap().is_some()
            });
            // Different delays, so that the signal arrives during different work.
            sleep(Duration::from_millis(7 * stopped));
            signal(&child, name);
            let output = child.wait_with_output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr);
            if output.status.success() {
                break;
            }
            assert_eq!(output.status.code(), Some(130), "{message}");
            assert_eq!(message.lines().count(), 2, "{message}");
            assert!(message.contains("a second Ctrl-C or SIGTERM"), "{message}");
            let (number, seen) = digest(&map).unwrap_or((0, scans.digests[0].clone()));
            let is_reported = message.contains(&format!("stopped after {number} scan"))
                || (message.contains("stopped before the first scan"));
            assert!(is_reported, "{message}");
            assert_eq!(seen, scans.digests[number]);
            stopped += 1;
        }
        assert!(stopped > 0, "the build was faster than the signal");
        assert_eq!(digest(&map), Ok((60, scans.digests[60].clone())));
    }
}

/// Reads the output of a process until a line contains `text`.
fn read_until(child: &mut Child, text: &str) -> BufReader<impl Read + use<>> {
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains(text) {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "it ended without printing `{text}`");
    }
    lines
}

#[test]
fn an_idle_input_blocks_neither_flushes_nor_a_stop() {
    let scans = StreamedBuild::scans(1, 5);
    let (_folder, map) = folder_for_maps();
    let mut build = StreamedBuild::spawn(&map, &["--flush-every", "0.3s"]);
    build.write(&scans);
    // The input stays open without data.
    wait_until("the timer flushes", || flushed_scans(&map) == Some(5));
    signal(&build.child, "TERM");
    let mut lines = read_until(&mut build.child, "a second Ctrl-C or SIGTERM stops at once");
    let status = build.child.wait().unwrap();
    let mut rest = String::new();
    lines.read_to_string(&mut rest).unwrap();
    assert_eq!(status.code(), Some(130), "{rest}");
    assert!(rest.contains("stopped after 5 scans; all of them are in the map"), "{rest}");
    let expected = StreamedBuild::digest_of(&scans);
    assert_eq!(digest(&map).unwrap(), (5, expected));
    drop(build);

    // There is no map before the first scan.
    let (_folder, map) = folder_for_maps();
    let mut build = StreamedBuild::spawn(&map, &[]);
    wait_until("signals are caught", || signals_are_caught(build.child.id()));
    signal(&build.child, "INT");
    read_until(&mut build.child, "stopped before the first scan");
    assert_eq!(build.child.wait().unwrap().code(), Some(130));
    assert!(!map.exists());
}

#[test]
fn a_stopped_demo_resumes_when_run_again() {
    let (folder, _) = folder_for_maps();
    let out = folder.path().join("demo");
    let map = out.join("map_tiles");
    let demo = || {
        let mut command = voxtile();
        command
            .args(["demo", "--length", "60", "--out"])
            .arg(&out)
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        command
    };
    let mut child = demo().spawn().unwrap();
    wait_until("the map is begun", || flushed_scans(&map).is_some());
    signal(&child, "INT");
    let mut lines = read_until(&mut child, "run the same command to continue");
    lines.read_to_string(&mut String::new()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    for _ in 0..2 {
        let output = demo().output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(digest(&map).unwrap().0, 30);
        assert!(out.join("map.png").exists());
    }
}

/// Returns a scan of long rays in all directions, which is slow to insert at this resolution.
fn endless_scan(rays: u32) -> Scan {
    let point = |k: u32| {
        let (azimuth, up) = (f64::from(k) * 2.399_963, 2.0 * f64::from(k) / f64::from(rays) - 1.0);
        let flat = (1.0 - up * up).sqrt();
        [900.0 * flat * azimuth.cos(), 900.0 * flat * azimuth.sin(), 900.0 * up]
    };
    Scan { origin: [0.0; 3], points: (0..rays).map(point).collect(), intensities: None }
}

#[test]
fn a_slow_scan_is_cancelled() {
    let (_folder, map) = folder_for_maps();
    let how = ["--max-range", "1000", "--resolution", "0.02", "--tile-size", "4", "--memory", "256MiB"];
    let mut build = StreamedBuild::spawn_with(&map, &how);
    build.write(&[endless_scan(400_000)]);
    wait_until("the map is begun", || flushed_scans(&map).is_some());
    signal(&build.child, "TERM");
    read_until(&mut build.child, "stopped after 0 scans");
    assert_eq!(build.child.wait().unwrap().code(), Some(130));
    assert_eq!(digest(&map).unwrap().0, 0);
}

#[test]
fn a_signal_to_share_ends_voxtile_share() {
    // It would run for a minute without a signal.
    const PROGRAM: &str = "#!/bin/sh\ntrap 'echo ended; exit 7' TERM\necho begun\n\
        for k in $(seq 600); do sleep 0.1; done\n";
    let folder = tempfile::tempdir().unwrap();
    // Write the program in a separate process: a file that a child of another test still has open for writing cannot be
    // executed.
    let line = r#"cp "$0" "$1/voxtile"; printf '%s' "$2" >"$1/voxtile-share"; chmod +x "$1/voxtile-share""#;
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", line, env!("CARGO_BIN_EXE_voxtile")]).arg(folder.path()).arg(PROGRAM);
    assert!(shell.status().unwrap().success());
    let mut command = std::process::Command::new(folder.path().join("voxtile"));
    let mut child = command.arg("share").stdout(Stdio::piped()).spawn().unwrap();
    let mut printed = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    printed.read_line(&mut line).unwrap();
    assert_eq!(line, "begun\n");
    signal(&child, "TERM");
    assert_eq!(child.wait().unwrap().code(), Some(7));
    line.clear();
    printed.read_to_string(&mut line).unwrap();
    assert_eq!(line, "ended\n");
}

#[test]
fn a_stopped_export_leaves_no_temporary_files() {
    let (folder, _) = folder_for_maps();
    let (demo, out) = (folder.path().join("demo"), folder.path().join("out"));
    let made = voxtile().args(["demo", "--length", "60", "--out"]).arg(&demo).output().unwrap();
    assert!(made.status.success());
    std::fs::create_dir(&out).unwrap();
    for name in ["a.ply", "a.npz", "a.bt"] {
        let file = out.join(name);
        std::fs::write(&file, "as it was").unwrap();
        let mut stopped = 0;
        loop {
            let mut export = voxtile();
            export.arg("export").arg(demo.join("map_tiles")).arg("-o").arg(&file).stderr(Stdio::piped());
            if name != "a.bt" {
                export.args(["--what", "all"]);
            }
            let mut child = export.stdout(Stdio::null()).spawn().unwrap();
            wait_until("signals are caught", || {
                signals_are_caught(child.id()) || child.try_wait().unwrap().is_some()
            });
            sleep(Duration::from_millis(20 * stopped));
            signal(&child, "INT");
            let output = child.wait_with_output().unwrap();
            let left: Vec<_> = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path()).collect();
            let message = String::from_utf8_lossy(&output.stderr);
            if output.status.success() {
                break;
            }
            assert_eq!(output.status.code(), Some(130), "{message}");
            assert!(message.contains("stopping; the output does not change"), "{message}");
            assert!(left.iter().eq([&file]), "{left:?}");
            assert_eq!(std::fs::read_to_string(&file).unwrap(), "as it was");
            stopped += 1;
        }
        assert!(stopped > 0, "{name}: the export was faster than the signal");
        std::fs::remove_file(&file).unwrap();
    }
}
