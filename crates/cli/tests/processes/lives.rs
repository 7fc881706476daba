use crate::random::Random;
use crate::survey::{Scans, digest, folder_for_maps, is_whole, setting, voxtile};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const SCANS: usize = 8;
const ROUNDS: usize = 12;

/// Expected state of a map: the number of scans in it and in each snapshot.
#[derive(Clone, Debug, Default)]
struct Expected {
    scans: usize,
    snapshots: BTreeMap<&'static str, usize>,
}

/// One map over its lifetime. A killed command leaves the map in its state before or after the command; a killed build
/// may also leave a state in between.
struct Life<'a> {
    scans: &'a Scans,
    map: PathBuf,
    random: Random,
    expected: Expected,
    kills: u64,
    what: String,
}

impl Life<'_> {
    /// Runs a command to its end or kills it. Returns whether it ended.
    fn run(&mut self, mut child: Child) -> bool {
        if self.random.below(3) > 0 {
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success(), "{}: {}", self.what, String::from_utf8_lossy(&output.stderr));
            return true;
        }
        sleep(Duration::from_micros(self.random.below(60_000)));
        let has_ended = child.try_wait().unwrap().is_some();
        child.kill().unwrap();
        child.wait().unwrap();
        self.kills += u64::from(!has_ended);
        false
    }

    /// Adds the scans once more, with random options that do not affect the resulting map.
    fn build(&mut self) {
        let from = self.expected.scans;
        let mut how = vec!["--append", "--again"];
        how.extend(
            [["--flush-every", "1"], ["--flush-every", "3"], ["--flush-every", "end"]]
                [self.random.below(3) as usize],
        );
        how.extend(
            [["--threads", "1"], ["--threads", "2"], ["--threads", "3"]][self.random.below(3) as usize],
        );
        let child = self.scans.build(&self.map, &how).spawn().unwrap();
        self.run(child);
        let (found, _) = digest(&self.map).unwrap_or_else(|error| panic!("{}: {error}", self.what));
        assert!((from..=from + SCANS).contains(&found), "{}: {found} scans after {from}", self.what);
        // After a kill, adds the rest of the round, so that rounds are complete.
        if found < from + SCANS {
            let output = self.scans.build(&self.map, &["--resume"]).output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr);
            let ended = digest(&self.map).unwrap().0;
            assert!(ended == from + SCANS || ended == from, "{}: {ended}: {message}", self.what);
            self.expected.scans = ended;
        } else {
            self.expected.scans = found;
        }
    }

    fn command(&mut self, arguments: &[&str], after: Expected) {
        let mut command = voxtile();
        command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
        let child = command.spawn().unwrap();
        let before = self.expected.clone();
        self.expected = match self.run(child) {
            true => after,
            // Read the outcome from the map.
            false => {
                let mut now = Expected { scans: digest(&self.map).unwrap().0, ..Expected::default() };
                for name in before.snapshots.keys().chain(after.snapshots.keys()) {
                    if let Ok((scans, _)) = digest(&self.at(name)) {
                        now.snapshots.insert(*name, scans);
                    }
                }
                let is = |one: &Expected| one.scans == now.scans && one.snapshots == now.snapshots;
                assert!(is(&before) || is(&after), "{}: {before:?}, then {now:?}", self.what);
                now
            }
        };
    }

    fn at(&self, snapshot: &str) -> PathBuf {
        PathBuf::from(format!("{}@{snapshot}", self.map.display()))
    }

    fn check(&self, place: &Path, scans: usize) {
        let found =
            digest(place).unwrap_or_else(|error| panic!("{}: {}: {error}", self.what, place.display()));
        assert_eq!(found, (scans, self.scans.digests[scans].clone()), "{}: {}", self.what, place.display());
    }

    fn step(&mut self) {
        let map = self.map.to_str().unwrap().to_owned();
        let name = ["a", "b", "c"][self.random.below(3) as usize];
        let kept = self.expected.snapshots.get(name).copied();
        let mut after = self.expected.clone();
        match (self.random.below(8), kept) {
            (0..4, _) if self.expected.scans + SCANS <= SCANS * ROUNDS => self.build(),
            (_, None) => {
                after.snapshots.insert(name, after.scans);
                self.command(&["snapshot", &map, name], after);
            }
            (6, Some(_)) => {
                after.snapshots.remove(name);
                self.command(&["snapshot", &map, name, "--delete"], after);
            }
            (_, Some(scans)) => {
                after.scans = scans;
                self.command(&["revert", &map, name], after);
            }
        }
        self.check(&self.map, self.expected.scans);
        for (name, scans) in &self.expected.snapshots {
            self.check(&self.at(name), *scans);
        }
    }
}

/// Random lifetimes of maps; `VOXTILE_LIVES_SECONDS=3600` runs for an hour.
#[test]
fn a_map_has_the_expected_state_after_random_commands_kills_and_reads() {
    let until = Instant::now() + Duration::from_secs(setting("VOXTILE_LIVES_SECONDS", 12));
    let scans = Scans::new(SCANS, ROUNDS);
    let seed = setting("VOXTILE_SEED", 1);
    let (mut lives, mut steps, mut kills) = (0, 0, 0);
    while Instant::now() < until {
        let (_folder, map) = folder_for_maps();
        let mut random = Random(seed + lives);
        let storage = ["octomap", "compact"][random.below(2) as usize];
        assert!(scans.build(&map, &["--storage", storage]).status().unwrap().success());
        let expected = Expected { scans: SCANS, ..Expected::default() };
        let mut life =
            Life { scans: &scans, map: map.clone(), random, expected, kills: 0, what: String::new() };
        for step in 0..30 {
            if Instant::now() > until {
                break;
            }
            life.what = format!("seed {}, step {step}", seed + lives);
            // A concurrent reader sees only states that existed.
            let reader =
                voxtile().arg("digest").arg(&map).arg("--json").stdout(Stdio::piped()).spawn().unwrap();
            life.step();
            let answer = reader.wait_with_output().unwrap();
            assert!(answer.status.success(), "{}: a concurrent reader failed", life.what);
            let answer: serde_json::Value = serde_json::from_slice(&answer.stdout).unwrap();
            let number = answer["scan_number"].as_u64().unwrap() as usize;
            assert_eq!(answer["digest"], scans.digests[number].as_str(), "{}", life.what);
            steps += 1;
        }
        assert!(is_whole(&map), "{}", life.what);
        kills += life.kills;
        lives += 1;
    }
    println!("{lives} lives, {steps} steps, {kills} kills");
}
