use crate::survey::{Scans, digest, folder_for_maps, is_whole, limited};
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Small tmpfs, unmounted on drop.
struct SmallDisk(TempDir);

impl SmallDisk {
    /// Returns `None` if this process may not mount.
    fn new(bytes: u32) -> Option<Self> {
        let disk = Self(TempDir::new().unwrap());
        disk.mount(&format!("size={bytes}")).then_some(disk)
    }

    fn mount(&self, options: &str) -> bool {
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(self.0.path()).stderr(Stdio::null());
        mount.status().is_ok_and(|status| status.success())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).stderr(Stdio::null()).status();
    }
}

#[test]
fn a_full_disk_keeps_the_last_flush_and_the_build_resumes_later() {
    let scans = Scans::new(30, 1);
    let Some(disk) = SmallDisk::new(1500 << 10) else {
        println!("skipped: this process may not mount a small disk");
        return;
    };
    let map = disk.path().join("map");
    let how = ["--resume", "--flush-every", "3"];
    for _ in 0..2 {
        let output = scans.build(&map, &how).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains("No space left on device"), "{message}");
        assert!(message.contains("continue with the same command and --resume"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        let (number, seen) = digest(&map).unwrap();
        assert!((1..30).contains(&number), "{number}");
        assert_eq!(seen, scans.digests[number]);
    }
    assert!(disk.mount("remount,size=64m"));
    assert!(scans.build(&map, &how).status().unwrap().success());
    assert_eq!(digest(&map), Ok((30, scans.digests[30].clone())));
    assert!(is_whole(&map));
}

/// The disk is full at the first flush, so the map is empty.
#[test]
fn a_disk_full_at_the_first_flush_leaves_no_map() {
    let scans = Scans::new(30, 1);
    let Some(disk) = SmallDisk::new(300 << 10) else {
        println!("skipped: this process may not mount a small disk");
        return;
    };
    let map = disk.path().join("map");
    for _ in 0..2 {
        let output = scans.build(&map, &[]).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        for part in ["No space left", "no scan was flushed, and the new map was removed", "--storage compact"]
        {
            assert!(message.contains(part), "{part}: {message}");
        }
        assert_eq!(message.lines().count(), 1, "{message}");
        assert_eq!(std::fs::read_dir(disk.path()).unwrap().count(), 0);
    }
    assert!(disk.mount("remount,size=64m"));
    assert!(scans.build(&map, &[]).status().unwrap().success());
    assert_eq!(digest(&map), Ok((30, scans.digests[30].clone())));
}

#[test]
fn a_read_only_disk_is_readable_and_never_written() {
    let scans = Scans::new(6, 1);
    let Some(disk) = SmallDisk::new(64 << 20) else {
        println!("skipped: this process may not mount a small disk");
        return;
    };
    let map = disk.path().join("map");
    assert!(scans.build(&map, &[]).status().unwrap().success());
    assert!(disk.mount("remount,ro"));
    assert_eq!(digest(&map), Ok((6, scans.digests[6].clone())));
    assert!(is_whole(&map));
    let output = scans.build(&map, &["--append"]).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("Read-only file system"), "{message}");
}

/// Stacks larger than the address space: no thread starts, or only one.
#[cfg(all(target_os = "linux", target_pointer_width = "64"))]
#[test]
fn the_map_is_the_same_if_threads_cannot_start() {
    let scans = Scans::new(8, 1);
    let (folder, _) = folder_for_maps();
    for (number, stack_bytes) in [1_u64 << 47, 1 << 46, (1 << 46) / 3].into_iter().enumerate() {
        for how in [["--threads", "4"], ["--voxel-cache", "parallel"]] {
            let map = folder.path().join(format!("{number}{}", how[0]));
            let mut build = scans.build(&map, &how);
            let output = build.env("RUST_MIN_STACK", stack_bytes.to_string()).output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success() && !message.contains("panicked"), "{message}");
            assert!(message.contains("mapping with"), "{message}");
            assert_eq!(digest(&map), Ok((8, scans.digests[8].clone())));
        }
    }
}

#[test]
fn too_many_open_files_lose_nothing() {
    let scans = Scans::new(12, 1);
    let (_folder, map) = folder_for_maps();
    let how = ["--resume", "--flush-every", "3"];
    for files in 4..12 {
        let build = scans.build(&map, &how);
        let output = limited(&build, 'n', files).stdout(Stdio::null()).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!message.contains("panicked"), "{message}");
        if map.join("metadata.json").exists() {
            let (number, seen) = digest(&map).unwrap();
            assert_eq!(seen, scans.digests[number], "{files} files");
        }
    }
    assert!(scans.build(&map, &how).status().unwrap().success());
    assert_eq!(digest(&map), Ok((12, scans.digests[12].clone())));
    assert!(is_whole(&map));
}
