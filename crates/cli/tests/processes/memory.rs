use crate::survey::{folder_for_maps, voxtile};
use serde_json::Value;
use std::fs::File;
use std::path::Path;
use std::process::Stdio;
use testkit::random_scans::Random;
use voxtile::Scan;
use voxtile_formats::ScanStreamWriter;
use voxtile_simulation::Survey;

/// Builds a map from a drive of `length_m` metres on standard input. Returns the command's JSON.
fn build(map: &Path, length_m: usize) -> Value {
    let mut command = voxtile();
    command.args(["build", "-", "--resolution", "0.2", "--cache-tiles", "8", "--json", "-o"]).arg(map);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut writer = ScanStreamWriter::new(child.stdin.take().unwrap(), "drive", true).unwrap();
    // Every fifth scan: same streets, less time.
    Survey::tour(1, 1_500).step_by(5).take(length_m / 5).for_each(|scan| writer.write_world(&scan).unwrap());
    drop(writer);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    serde_json::from_slice(&output.stdout).unwrap()
}

fn answer(command: &str, map: &Path, how: &[&str]) -> Value {
    let output =
        voxtile().arg(command).arg(map).args(how).args(["--threads", "1", "--json"]).output().unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn peak(answer: &Value) -> u64 {
    answer["peak_rss_bytes"].as_u64().expect("this system reports the peak")
}

/// A build stays within its budget plus 48 MiB, whatever it maps, and the map does not depend on the budget.
#[cfg(target_os = "linux")]
#[test]
fn a_build_keeps_to_its_memory() {
    const MEMORY: u64 = 20 << 20;
    let (folder, _) = folder_for_maps();
    for (name, scans) in [
        ("drive", Survey::tour(1, 4_000).step_by(4).take(60).collect::<Vec<_>>()),
        ("teleports", Survey::teleports(1, 5_000.0, 4_000).take(40).collect()),
    ] {
        let build = |memory: u64| {
            let map = folder.path().join(format!("{name}_{memory}"));
            let memory = memory.to_string();
            let how =
                ["build", "-", "--resolution", "0.1", "--tile-size", "5", "--memory", &memory, "--json"];
            let mut command = voxtile();
            command.args(how).arg("-o").arg(&map);
            let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
            let mut writer = ScanStreamWriter::new(child.stdin.take().unwrap(), name, true).unwrap();
            scans.iter().for_each(|scan| writer.write_world(scan).unwrap());
            drop(writer);
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success());
            let built: Value = serde_json::from_slice(&output.stdout).unwrap();
            (answer("digest", &map, &[])["digest"].clone(), built)
        };
        let ((digest, small), (expected, large)) = (build(MEMORY), build(4 << 30));
        assert_eq!(digest, expected, "{name}");
        assert!(peak(&small) < MEMORY + (48 << 20), "{name}: {} bytes", peak(&small));
        assert!(peak(&large) > MEMORY + (48 << 20), "{name} does not need more than the limit");
    }
}

/// A brick of a scan is divided into 64 tiles of two voxels with their own lists, which count in the budget.
#[cfg(target_os = "linux")]
#[test]
fn a_build_of_tiles_of_two_voxels_keeps_to_its_memory() {
    const MEMORY: u64 = 20 << 20;
    /// Memory that the process may use in addition to `--memory`. It is about half of the guaranteed 48 MiB, because the
    /// scan is small.
    const OVERHEAD: u64 = 26 << 20;
    let (folder, map) = folder_for_maps();
    let mut random = Random(1);
    let on_sphere = |_| {
        let direction = random.point([0.0; 3], 1.0);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        direction.map(|x| 12.0 * x / length)
    };
    let scan = Scan { origin: [0.0; 3], points: (0..200).map(on_sphere).collect(), intensities: None };
    let input = folder.path().join("sphere.scans");
    let mut writer = ScanStreamWriter::new(File::create(&input).unwrap(), "sphere", false).unwrap();
    writer.write_world(&scan).unwrap();
    drop(writer);
    let how =
        ["--resolution", "0.1", "--tile-size", "0.2", "--storage", "compact", "--threads", "1", "--json"];
    let mut command = voxtile();
    command.arg("build").arg(&input).arg("-o").arg(&map).args(how).args(["--memory", &MEMORY.to_string()]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let built: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(peak(&built) < MEMORY + OVERHEAD, "{} bytes", peak(&built));
}

/// Commands that read a whole map need no more memory for a long drive than for a short one, and octree files are
/// written within their memory option.
#[cfg(target_os = "linux")]
#[test]
fn whole_maps_are_read_in_constant_memory() {
    const MEMORY: u64 = 2 << 20;
    let (folder, _) = folder_for_maps();
    let (short, long) = (folder.path().join("short"), folder.path().join("long"));
    build(&short, 20);
    let built = build(&long, crate::survey::setting("VOXTILE_DRIVE_METRES", 600) as usize);
    let map_bytes = answer("info", &long, &[])["table_bytes"].as_u64().unwrap();
    assert!(map_bytes > 20 * MEMORY, "{map_bytes} bytes");
    assert!(peak(&built) > 0);
    let out = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (ply, bt, ot) = (out("map.ply"), out("map.bt"), out("map.ot"));
    let memory = MEMORY.to_string();
    let cases: [(&str, &[&str], u64); 5] = [
        ("digest", &[], 0),
        ("verify", &[], 0),
        ("export", &["-o", &ply], 0),
        ("export", &["-o", &bt, "--memory", &memory], MEMORY),
        ("export", &["-o", &ot, "--memory", &memory], MEMORY),
    ];
    for (command, how, memory) in cases {
        let (few, many) = (peak(&answer(command, &short, how)), peak(&answer(command, &long, how)));
        // A tile of the long drive may have more voxels, and allocators keep freed memory.
        assert!(many < few + memory + (2 << 20), "{command} {how:?}: {few} bytes, then {many}");
    }
}

/// Commands that create or change whole maps need no more memory for a long drive than for a short one.
#[cfg(target_os = "linux")]
#[test]
fn whole_maps_are_merged_cropped_cleared_and_decayed_in_constant_memory() {
    const MORE: u64 = 3 << 20;
    let (folder, _) = folder_for_maps();
    let path = |name: &str| folder.path().join(name);
    for (name, length_m) in
        [("short", 20), ("long", crate::survey::setting("VOXTILE_DRIVE_METRES", 600) as usize)]
    {
        build(&path(name), length_m);
    }
    let map_bytes = answer("info", &path("long"), &[])["table_bytes"].as_u64().unwrap();
    assert!(map_bytes > 12 * MORE, "{map_bytes} bytes");
    let text = |name: &str| path(name).to_str().unwrap().to_owned();
    let region = ["--region", "-1e6", "-1e6", "-1e6", "1e6", "0.3", "1e6"];
    let mut cases: Vec<(&str, Vec<String>)> = Vec::new();
    cases.push(("merge", vec!["MAP".into()]));
    cases.push(("crop", region.map(str::to_owned).to_vec()));
    cases.push(("decay", ["--halflife", "50", "--scans", "20"].map(str::to_owned).to_vec()));
    cases.push(("clear", region.map(str::to_owned).to_vec()));
    for (command, how) in cases {
        let [few, many] = ["short", "long"].map(|name| {
            let out = text(&format!("{name}_{command}"));
            let mut how: Vec<String> = how.iter().map(|part| part.replace("MAP", &text(name))).collect();
            if ["merge", "crop"].contains(&command) {
                how.extend(["-o".to_owned(), out]);
            }
            let how: Vec<&str> = how.iter().map(String::as_str).collect();
            peak(&answer(command, &path(name), &how))
        });
        assert!(many < few + MORE, "{command}: {few} bytes, then {many}");
    }
}
