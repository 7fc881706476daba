use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use voxtile::{InMemoryMapper, MapConfig, MapQueries, Mapper, Scan};
use voxtile_formats::{ReadOptions, ScanStreamWriter, open_scans};
use voxtile_simulation::{City, Drive, Lidar, Survey};

/// A folder of scans, and the digest of the map after each number of scans.
pub struct Scans {
    pub folder: TempDir,
    pub digests: Vec<String>,
    /// Parent of `folder`. Builds also look for poses next to their input, where other tests may have files.
    _around: TempDir,
}

pub const RESOLUTION_M: f64 = 0.5;
const MAX_RANGE_M: f64 = 20.0;

impl Scans {
    /// Writes `count` scans of a drive through a synthetic city. Also computes the digests of a build that inserts all
    /// of them `rounds` times.
    pub fn new(count: usize, rounds: usize) -> Self {
        let around = TempDir::new().unwrap();
        let folder = TempDir::new_in(around.path()).unwrap();
        let survey = Survey::new(City::new(3), Drive::new(3, 2.0), Lidar::demo(), 3);
        for (number, scan) in survey.take(count).enumerate() {
            let points: Vec<_> = scan.points.iter().step_by(9).collect();
            fs::write(folder.path().join(format!("{number:04}.pcd")), pcd(scan.origin, &points)).unwrap();
        }
        let config = MapConfig::new(RESOLUTION_M, 10.0).unwrap().with_range(0.0, MAX_RANGE_M);
        let mut mapper = InMemoryMapper::new(config).unwrap();
        let mut digests = vec![mapper.digest().unwrap().to_string()];
        for _ in 0..rounds {
            let mut source = open_scans(folder.path(), &ReadOptions::default()).unwrap();
            while let Some(scan) = source.next_scan().unwrap() {
                mapper.insert_scan(&scan.into_scan()).unwrap();
                digests.push(mapper.digest().unwrap().to_string());
            }
        }
        Self { folder, digests, _around: around }
    }

    /// Returns the command that builds the map with little memory, so that it evicts tiles all the time.
    pub fn build(&self, map: &Path, how: &[&str]) -> Command {
        let mut command = voxtile();
        let resolution = RESOLUTION_M.to_string();
        let range = MAX_RANGE_M.to_string();
        command.arg("build").arg(self.folder.path()).arg("-o").arg(map);
        command.args(["--resolution", &resolution, "--max-range", &range, "--cache-tiles", "4"]);
        command.args(how).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }
}

/// Returns the tested command.
pub fn voxtile() -> Command {
    Command::new(env!("CARGO_BIN_EXE_voxtile"))
}

/// Returns the same command with a limit of the shell's `ulimit`: open files (`n`) or address space in KiB (`v`). Core
/// dumps are disabled.
pub fn limited(command: &Command, of: char, limit: u64) -> Command {
    let mut limited = Command::new("sh");
    limited.args(["-c", &format!("ulimit -c 0; ulimit -{of} $0 && exec \"$@\"")]).arg(limit.to_string());
    limited.arg(command.get_program()).args(command.get_args());
    limited.env("RUST_BACKTRACE", "0");
    limited
}

/// Reads the number of scans and the digest of a map in a separate process.
pub fn digest(map: &Path) -> Result<(usize, String), String> {
    let output = voxtile().arg("digest").arg(map).arg("--json").output().unwrap();
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let scan_number = answer["scan_number"].as_u64().unwrap() as usize;
    Ok((scan_number, answer["digest"].as_str().unwrap().to_owned()))
}

/// Returns whether `voxtile verify` finds no damage, and prints what it finds.
pub fn is_whole(map: &Path) -> bool {
    let output = voxtile().arg("verify").arg(map).output().unwrap();
    if !output.status.success() {
        println!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    }
    output.status.success()
}

/// Returns a number from the environment, or the default of the short form.
pub fn setting(name: &str, short: u64) -> u64 {
    std::env::var(name).map_or(short, |value| value.parse().expect("a number"))
}

/// Returns a folder on the disk of the build folder, where syncs are real.
pub fn folder_for_maps() -> (TempDir, PathBuf) {
    let folder = TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let map = folder.path().join("map");
    (folder, map)
}

fn pcd(origin: [f64; 3], points_in_world: &[&[f64; 3]]) -> Vec<u8> {
    let [x, y, z] = origin;
    let count = points_in_world.len();
    let header = format!(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n\
         VIEWPOINT {x} {y} {z} 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    );
    let mut bytes = header.into_bytes();
    for point in points_in_world {
        for axis in 0..3 {
            bytes.extend_from_slice(&((point[axis] - origin[axis]) as f32).to_le_bytes());
        }
    }
    bytes
}

/// A build from scans on standard input.
pub struct StreamedBuild {
    pub child: Child,
    writer: ScanStreamWriter<ChildStdin>,
}

impl StreamedBuild {
    /// Returns scans of a drive, rounded as in a scan stream.
    pub fn scans(seed: u64, count: usize) -> Vec<Scan> {
        Survey::tour(seed, 300).take(count).collect()
    }

    /// Starts a build with few tiles in memory.
    pub fn spawn(map: &Path, how: &[&str]) -> Self {
        let resolution = RESOLUTION_M.to_string();
        let few = ["--resolution", &resolution, "--cache-tiles", "4"];
        Self::spawn_with(map, &[&few[..], how].concat())
    }

    pub fn spawn_with(map: &Path, how: &[&str]) -> Self {
        let mut command = voxtile();
        command.args(["build", "-", "-o"]).arg(map).args(how);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let writer = ScanStreamWriter::new(child.stdin.take().unwrap(), "drive", false).unwrap();
        Self { child, writer }
    }

    pub fn write(&mut self, scans: &[Scan]) {
        scans.iter().for_each(|scan| self.writer.write_world(scan).unwrap());
        self.writer.flush().unwrap();
    }

    /// Closes the input and waits for the build.
    pub fn end(self) -> ExitStatus {
        let Self { mut child, writer } = self;
        drop(writer);
        child.wait().unwrap()
    }

    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Returns the digest of an undisturbed build of these scans.
    pub fn digest_of(scans: &[Scan]) -> String {
        let (_folder, map) = folder_for_maps();
        let mut build = Self::spawn(&map, &[]);
        build.write(scans);
        assert!(build.end().success());
        digest(&map).unwrap().1
    }
}

/// Waits for a condition; on a busy machine this may take long.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    const PATIENCE: Duration = Duration::from_secs(300);
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < PATIENCE, "waited in vain: {what}");
        sleep(Duration::from_millis(2));
    }
}

/// Returns the metadata of a map, if there is one. The file is replaced atomically.
fn metadata(map: &Path) -> Option<serde_json::Value> {
    let text = fs::read_to_string(map.join("metadata.json")).ok()?;
    Some(serde_json::from_str(&text).expect("metadata are JSON at all times"))
}

/// Number of the last scan in the map's last flush; `None` without a map.
pub fn flushed_scans(map: &Path) -> Option<u64> {
    metadata(map)?.pointer("/ext/scan_number")?.as_u64()
}

/// Returns the number of inputs in a map's metadata.
pub fn inputs(map: &Path) -> usize {
    let inputs = metadata(map).and_then(|metadata| Some(metadata.pointer("/ext/inputs")?.as_array()?.len()));
    inputs.unwrap_or(0)
}

/// Returns whether a process catches SIGINT and SIGTERM. On systems that do not report this, waits for a while.
pub fn signals_are_caught(process: u32) -> bool {
    let Ok(status) = fs::read_to_string(format!("/proc/{process}/status")) else {
        sleep(Duration::from_millis(500));
        return true;
    };
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    [2, 15].iter().all(|signal| caught & (1 << (signal - 1)) != 0)
}

/// Sends a signal to a child process.
pub fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(status.is_ok());
}
