use crate::random::Random;
use crate::survey::{
    digest, flushed_scans, folder_for_maps, is_whole, limited, setting, voxtile, wait_until,
};
use serde_json::Value;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::NamedTempFile;
use voxtile::{InMemoryMapper, MapConfig, MapQueries, Mapper};
use voxtile_formats::{ReadOptions, ScanStreamWriter, open_scans};
use voxtile_simulation::Survey;

const SCANS: usize = 16;
const RESOLUTION_M: f64 = 0.2;
const MAX_RANGE_M: f64 = 20.0;

/// Limits of address space in KiB: with the first every command succeeds, with the second no process starts.
const PLENTY_KIB: f64 = 200.0 * 1024.0;
const TOO_FEW_KIB: f64 = 8.0 * 1024.0;

/// A stream of scans, and the digest of the map after each number of scans.
struct Drive {
    stream: NamedTempFile,
    digests: Vec<String>,
}

impl Drive {
    fn new() -> Self {
        let mut stream = tempfile::Builder::new().suffix(".scans").tempfile().unwrap();
        let mut writer = ScanStreamWriter::new(&mut stream, "drive", true).unwrap();
        Survey::tour(5, 3_000).take(SCANS).for_each(|scan| writer.write_world(&scan).unwrap());
        writer.flush().unwrap();
        drop(writer);
        let config = MapConfig::new(RESOLUTION_M, 10.0).unwrap().with_range(0.0, MAX_RANGE_M);
        let mut mapper = InMemoryMapper::new(config).unwrap();
        let mut digests = vec![mapper.digest().unwrap().to_string()];
        let mut source = open_scans(stream.path(), &ReadOptions::default()).unwrap();
        while let Some(scan) = source.next_scan().unwrap() {
            mapper.insert_scan(&scan.into_scan()).unwrap();
            digests.push(mapper.digest().unwrap().to_string());
        }
        assert_eq!(digests.len(), SCANS + 1);
        Self { stream, digests }
    }

    /// Returns the command that creates or extends the map.
    fn build(&self, map: &Path, storage: &str) -> Command {
        let mut command = voxtile();
        let [resolution, range] = [RESOLUTION_M, MAX_RANGE_M].map(|metres| metres.to_string());
        command.args(["build", "-", "--append", "--resume", "--flush-every", "2", "--threads", "2"]);
        command.args(["--resolution", &resolution, "--max-range", &range, "--memory", "64MiB"]);
        command.args(["--storage", storage, "-o"]).arg(map);
        command
    }

    fn stdin(&self) -> Stdio {
        File::open(self.stream.path()).unwrap().into()
    }

    fn build_whole(&self, map: &Path, storage: &str) {
        let output = self.build(map, storage).stdin(self.stdin()).output().unwrap();
        assert!(output.status.success(), "{}", printed(&output));
        assert_eq!(digest(map), Ok((SCANS, self.digests[SCANS].clone())));
    }
}

/// Returns decreasing limits in KiB, most of them near the point where processes start to fail.
fn falling_limits(seed: u64) -> impl Iterator<Item = u64> {
    let steps = setting("VOXTILE_LIMITS", 16);
    let mut random = Random(setting("VOXTILE_SEED", 1) + seed);
    (0..=steps).map(move |step| {
        let down = step as f64 / steps as f64;
        let limit_kib = TOO_FEW_KIB * (PLENTY_KIB / TOO_FEW_KIB).powf((1.0 - down).powi(2));
        limit_kib as u64 + random.below(512)
    })
}

/// Runs a command with a limit of address space in KiB. It may fail but must not panic. Exception: if a thread has its
/// stack but no memory for its signal stack, the Rust runtime aborts.
fn run(command: &Command, limit_kib: u64, stdin: Stdio) -> Output {
    let mut command = limited(command, 'v', limit_kib);
    let mut child = command.stdin(stdin).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until("a process with limited address space ends", || child.try_wait().unwrap().is_some());
    let output = child.wait_with_output().unwrap();
    let printed = printed(&output);
    let is_panic =
        printed.contains("panicked") && !printed.contains("failed to allocate an alternative stack");
    assert!(!is_panic, "{limit_kib} KiB: {printed}");
    output
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn copy(map: &Path, to: &Path) {
    let _ = fs::remove_dir_all(to);
    assert!(Command::new("cp").arg("-r").args([map, to]).status().unwrap().success());
}

#[test]
fn a_build_with_failing_allocations_keeps_its_flushes_and_resumes() {
    let drive = Drive::new();
    for (seed, storage) in (0..).zip(["octomap", "compact"]) {
        let (mut whole, mut cut, mut in_vain) = (0, 0, 0);
        // Smallest limit of a complete build, and largest limit of a build without any scan.
        let (mut enough_kib, mut too_few_kib) = (u64::MAX, 0);
        let mut try_with = |limit_kib: u64| {
            let (_folder, map) = folder_for_maps();
            // The second build resumes from the first.
            match [(); 2].map(|()| scans_of_build(&drive, &map, storage, limit_kib)) {
                [None, None] => {
                    in_vain += 1;
                    too_few_kib = too_few_kib.max(limit_kib);
                }
                [first, second] => {
                    assert!(first <= second, "{storage}, {limit_kib} KiB: {first:?}, then {second:?}");
                    if second == Some(SCANS) {
                        whole += 1;
                        enough_kib = enough_kib.min(limit_kib);
                    } else {
                        cut += 1;
                    }
                    drive.build_whole(&map, storage);
                }
            }
            (cut, (enough_kib / 2).saturating_add(too_few_kib / 2))
        };
        let mut between_kib = 0;
        for limit_kib in falling_limits(seed) {
            (_, between_kib) = try_with(limit_kib);
        }
        // Search for limits at which builds end early: they are between these two, in a range that may be small.
        for _ in 0..8 {
            match try_with(between_kib) {
                (0, next_kib) => between_kib = next_kib,
                _ => break,
            }
        }
        assert!(
            whole > 0 && cut > 0 && in_vain > 0,
            "{storage}: {whole} whole, {cut} ended early, {in_vain} without a map"
        );
        println!("{storage}: {whole} whole, {cut} ended early, {in_vain} without a map");
    }
}

/// Returns the number of scans in the map after a build with a limit in KiB, if there is a map.
fn scans_of_build(drive: &Drive, map: &Path, storage: &str, limit_kib: u64) -> Option<usize> {
    let output = run(&drive.build(map, storage), limit_kib, drive.stdin());
    let what = format!("{storage}, {limit_kib} KiB: {}", printed(&output));
    let is_success = output.status.success();
    let Some(flushed) = flushed_scans(map) else {
        assert!(!is_success, "{what}");
        return None;
    };
    let (found, seen) = digest(map).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(found >= flushed as usize, "{found} scans where {flushed} were flushed: {what}");
    assert_eq!(Some(&seen), drive.digests.get(found), "{found} scans: {what}");
    assert!(is_whole(map), "{what}");
    assert!(found == SCANS || !is_success, "{what}");
    Some(found)
}

/// Out of memory is never reported as damage, and repair removes only damaged data.
#[test]
fn verify_and_repair_report_no_false_damage_if_allocations_fail() {
    let drive = Drive::new();
    for (seed, storage) in (10..).zip(["octomap", "compact"]) {
        let (_folder, map) = folder_for_maps();
        drive.build_whole(&map, storage);
        let [damaged, repaired, tried] =
            ["damaged", "repaired", "tried"].map(|name| map.with_file_name(name));
        copy(&map, &damaged);
        damage_a_tile(&damaged);
        assert!(!is_whole(&damaged));
        copy(&damaged, &repaired);
        let command = |command: &str, map: &Path| {
            let mut whole = voxtile();
            whole.arg(command).arg(map).arg("--json");
            whole
        };
        assert_eq!(command("repair", &repaired).output().unwrap().status.code(), Some(1), "a tile is lost");
        let expected = digest(&repaired).unwrap();
        let (mut answers, mut failures) = (0, 0);
        for limit_kib in falling_limits(seed) {
            let what = format!("{storage}, {limit_kib} KiB");
            for (map, is_whole) in [(&map, true), (&damaged, false)] {
                let output = run(&command("verify", map), limit_kib, Stdio::null());
                match serde_json::from_slice::<Value>(&output.stdout) {
                    Ok(answer) => {
                        assert_eq!(answer["whole"], is_whole, "{what}: {answer}");
                        assert_eq!(answer["damage"], u64::from(!is_whole), "{what}: {answer}");
                        answers += 1;
                    }
                    Err(_) => {
                        assert!(!output.status.success(), "{what}: {}", printed(&output));
                        failures += 1;
                    }
                }
            }
            run(&command("repair", &map), limit_kib, Stdio::null());
            assert!(!map.join("quarantine").exists(), "{what}");

            copy(&damaged, &tried);
            run(&command("repair", &tried), limit_kib, Stdio::null());
            run(&command("repair", &tried), PLENTY_KIB as u64, Stdio::null());
            assert_eq!(digest(&tried).unwrap(), expected, "{what}");
            assert!(is_whole(&tried), "{what}");
        }
        assert!(answers > 0 && failures > 0, "{storage}: {answers} answers, {failures} failures");
        assert!(is_whole(&map));
        assert_eq!(digest(&map), Ok((SCANS, drive.digests[SCANS].clone())));
    }
}

/// Changes a byte in the middle of one tile's table.
fn damage_a_tile(map: &Path) {
    let tiles = fs::read_dir(map).unwrap().map(|entry| entry.unwrap().path());
    let mut tables: Vec<_> = tiles
        .flat_map(|tile| ["iwlo_meta.bin", "tile.vxt"].map(|name| tile.join(name)))
        .filter(|table| table.exists())
        .collect();
    tables.sort_unstable();
    let table = &tables[tables.len() / 2];
    let mut bytes = fs::read(table).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(table, bytes).unwrap();
}

#[test]
fn an_export_with_failing_allocations_leaves_the_old_or_the_new_file() {
    const OLD: &[u8] = b"what was there before";
    let drive = Drive::new();
    for (seed, storage) in (20..).zip(["octomap", "compact"]) {
        let (folder, map) = folder_for_maps();
        drive.build_whole(&map, storage);
        for (extension, how) in [("ply", None), ("bt", Some("2MiB")), ("ot", Some("8MiB"))] {
            let target = folder.path().join("export").with_extension(extension);
            let mut export = voxtile();
            export.arg("export").arg(&map).arg("-o").arg(&target);
            if let Some(memory) = how {
                export.args(["--memory", memory]);
            }
            assert!(run(&export, PLENTY_KIB as u64, Stdio::null()).status.success());
            let whole = fs::read(&target).unwrap();
            let (mut made, mut failed) = (0, 0);
            for limit_kib in falling_limits(seed) {
                fs::write(&target, OLD).unwrap();
                let output = run(&export, limit_kib, Stdio::null());
                let found = fs::read(&target).unwrap();
                let what = format!("{storage}, {extension}, {limit_kib} KiB: {}", printed(&output));
                assert!(found == whole || (found == OLD && !output.status.success()), "{what}");
                if found == OLD { failed += 1 } else { made += 1 }
            }
            assert!(made > 0 && failed > 0, "{storage}, {extension}: {made} made, {failed} failed");
        }
        assert_eq!(digest(&map), Ok((SCANS, drive.digests[SCANS].clone())));
    }
}
