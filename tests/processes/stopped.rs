use crate::survey::{Scans, digest, folder_for_maps};
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

#[test]
fn a_signal_ends_a_build_with_all_of_its_scans_in_the_map() {
    let scans = Scans::new(60, 1);
    for signal in ["-TERM", "-INT"] {
        let (_folder, map) = folder_for_maps();
        let mut stopped = 0;
        loop {
            let mut child = scans.build(&map, &["--resume", "--flush-every", "end"]).spawn().unwrap();
            // Once the map is there, the signals are caught.
            while !map.join("metadata.json").exists() && child.try_wait().unwrap().is_none() {
                sleep(Duration::from_millis(1));
            }
            sleep(Duration::from_millis(30));
            assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().is_ok());
            let output = child.wait_with_output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr);
            if output.status.success() {
                break;
            }
            assert_eq!(output.status.code(), Some(130), "{message}");
            assert_eq!(message.lines().count(), 1, "{message}");
            let (number, seen) = digest(&map).unwrap();
            assert!(message.contains(&format!("stopped after {number} scans")), "{message}");
            assert_eq!(seen, scans.digests[number]);
            stopped += 1;
        }
        assert!(stopped > 0, "the build was faster than the signal");
        assert_eq!(digest(&map), Ok((60, scans.digests[60].clone())));
    }
}
