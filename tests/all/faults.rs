use crate::harness::{
    EVERY_CRASH, Job, Left, Reached, Subject, at, config, digest_of, faults, make_foreign, map,
    open_or_create, sweep, sweep_after_kills,
};
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::support::some_of;
use voxtile::{
    Digest, Error, InMemoryMapper, MapConfig, MapQueries, MapReader, MapView, Mapper, Occupancy,
    OutOfCoreTileMapper, Queries, Result, Scan, Storage,
};

const INPUT: &str = "random scans";
/// The map is flushed after these numbers of scans, and also closed and reopened after `REOPENED`.
const FLUSHED: [usize; 4] = [3, 5, 8, 11];
const REOPENED: usize = 8;

/// The configuration with compact storage.
fn compact() -> MapConfig {
    config().with_storage(Storage::Compact)
}

/// Scans of a drive forth and back, so that evicted tiles are loaded again.
fn scans() -> Vec<Scan> {
    let mut random = Random(7);
    let ways = [0.0, 3.0, 6.0, 3.0, 0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0];
    ways.iter().map(|&x| random_scan(&mut random, [x, 0.0, 0.0], 4)).collect()
}

/// A complete build of the map from any state, with concurrent readers. State `n` is the map of `n` scans. The process
/// retries failed operations.
struct Build {
    config: MapConfig,
    scans: Vec<Scan>,
    /// Digest after each number of scans, and the result of a query.
    digests: Vec<Digest>,
    answers: Vec<Occupancy>,
    /// Whether flushes run in the background. The order of operations is then not deterministic.
    in_background: bool,
}

impl Build {
    fn of(config: MapConfig) -> Self {
        let scans = scans();
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        let (mut digests, mut answers) = (Vec::new(), Vec::new());
        for number in 0..=scans.len() {
            digests.push(mapper.digest().unwrap());
            answers.push(mapper.occupancy_at([3.0, 0.1, 0.1]).unwrap());
            if let Some(scan) = scans.get(number) {
                mapper.insert_scan(scan).unwrap();
            }
        }
        Self { config, scans, digests, answers, in_background: false }
    }

    fn with_background_flushes(self) -> Self {
        Self { in_background: true, ..self }
    }

    /// Foreground and background flushes, with both storages.
    fn all(config: &MapConfig) -> impl Iterator<Item = Self> {
        [Storage::OctoMap, Storage::Compact].into_iter().flat_map(move |storage| {
            let config = config.clone().with_storage(storage);
            [Self::of(config.clone()), Self::of(config).with_background_flushes()]
        })
    }

    fn open(&self, disk: &FaultyDisk) -> Result<OutOfCoreTileMapper> {
        OutOfCoreTileMapper::open(at(disk), self.config.clone())
    }

    fn create(&self, disk: &FaultyDisk) -> Result<OutOfCoreTileMapper> {
        OutOfCoreTileMapper::create(at(disk), self.config.clone())
    }

    fn check_digest(&self, map: &impl MapView, what: &str) {
        let number = map.scan_number() as usize;
        let digest = map.digest().unwrap_or_else(|error| panic!("{what}: after {number} scans: {error:#}"));
        assert_eq!(digest, self.digests[number], "{what}: after {number} scans");
    }

    /// Checks that an error has not changed the mapper.
    fn look(&self, disk: &FaultyDisk, mapper: &OutOfCoreTileMapper) {
        if disk.broken().is_some() {
            // A read either fails or returns the right content.
            match mapper.digest() {
                Ok(digest) => assert_eq!(digest, self.digests[mapper.scan_number() as usize]),
                Err(error) => assert!(error.is_of_medium(), "{error:#}"),
            }
            return;
        }
        self.check_digest(mapper, "after an error");
        // A query that loads a tile.
        let answer = mapper.occupancy_at([3.0, 0.1, 0.1]).expect("queries still succeed");
        assert_eq!(answer, self.answers[mapper.scan_number() as usize]);
    }

    fn run_on(&self, disk: &FaultyDisk, from: usize, progress: &mut Progress) -> Result<()> {
        let nothing = |_: &()| ();
        let look = |mapper: &OutOfCoreTileMapper| self.look(disk, mapper);
        let mut mapper = insist(disk, &mut (), nothing, |_| match open_or_create(disk, &self.config) {
            // A failed attempt may have created the map.
            Err(Error::AlreadyExists { .. }) => self.open(disk),
            opened => opened,
        })?;
        let done = insist(disk, &mut mapper, look, |mapper| mapper.resume_input(INPUT))? as usize;
        assert_eq!(done, from, "readers and mappers see the same number of scans");
        *progress = Progress { is_early: false, safe: done, tried: done, failed: None };
        assert_eq!(mapper.scan_number(), done as u64);
        let digest = insist(disk, &mut mapper, look, |mapper| mapper.digest())?;
        assert_eq!(digest, self.digests[done], "after opening");
        let mut readers: Vec<MapReader> = Vec::new();
        for (scan, number) in self.scans.iter().zip(1..).skip(done) {
            insist(disk, &mut mapper, look, |mapper| mapper.insert_scan(scan))?;
            if !FLUSHED.contains(&number) {
                continue;
            }
            if self.in_background {
                // Before a reader opens the map: between a commit and its `metadata.json`, a reader would wait a tenth
                // of a second for the writer, and this disk has no clock.
                self.end_flush(disk, &mut mapper, progress, number)?;
            }
            readers.push(insist(disk, &mut (), nothing, |_| MapReader::open(at(disk), 0))?);
            progress.tried = number;
            if self.in_background {
                insist(disk, &mut mapper, look, |mapper| mapper.begin_flush())?;
            } else {
                insist(disk, &mut mapper, look, |mapper| mapper.flush())?;
                progress.safe = number;
            }
            for reader in &mut readers {
                let digest = insist(disk, reader, |_| (), |reader| reader.digest())?;
                assert_eq!(digest, self.digests[reader.scan_number() as usize], "a concurrent reader");
            }
            if number == REOPENED {
                readers.clear();
                self.end_flush(disk, &mut mapper, progress, number)?;
                drop(mapper);
                mapper = insist(disk, &mut (), nothing, |_| self.open(disk))?;
            }
        }
        let digest = insist(disk, &mut mapper, look, |mapper| mapper.digest())?;
        assert_eq!(digest, self.digests[self.scans.len()], "at the end");
        self.end_flush(disk, &mut mapper, progress, self.scans.len())
    }

    /// Waits for a background flush. If it failed, flushes now, after `number` scans.
    fn end_flush(
        &self,
        disk: &FaultyDisk,
        mapper: &mut OutOfCoreTileMapper,
        progress: &mut Progress,
        number: usize,
    ) -> Result<()> {
        match mapper.end_flush() {
            Ok(()) => progress.safe = progress.tried,
            Err(error) if disk.has_crashed() => return Err(error),
            Err(error) => {
                assert!(matches!(error, Error::Io { .. }), "{error:#}");
                self.look(disk, mapper);
                (progress.failed, progress.tried) = (Some(progress.tried), number);
                insist(disk, mapper, |mapper| self.look(disk, mapper), |mapper| mapper.flush())?;
                progress.safe = number;
            }
        }
        assert!(mapper.flushed_scan_number() as usize == progress.safe && !mapper.is_flushing());
        Ok(())
    }
}

/// Repeats a call until it succeeds: at most twice on a full disk, then with free space. After each failure the subject
/// must be unchanged. Returns an error only after a crash, or for damage caused by a persistent fault.
fn insist<S, T>(
    disk: &FaultyDisk,
    subject: &mut S,
    look: impl Fn(&S),
    mut attempt: impl FnMut(&mut S) -> Result<T>,
) -> Result<T> {
    let mut number = 0;
    loop {
        match attempt(subject) {
            Ok(done) => return Ok(done),
            Err(error) if disk.has_crashed() => return Err(error),
            // A file that was unreadable when the map was opened is reported as damaged until the map is reopened.
            Err(error @ Error::Damaged { .. }) if disk.had_permanent_fault() => return Err(error),
            Err(error) => {
                assert!(number < 3 && matches!(error, Error::Io { .. }), "attempt {number}: {error:#}");
                look(subject);
            }
        }
        if number == 1 {
            disk.make_room();
        }
        number += 1;
    }
}

/// Scans after the last successful flush, after the last attempted one, and after a failed background flush, whose
/// record may reappear after a crash.
struct Progress {
    is_early: bool,
    safe: usize,
    tried: usize,
    failed: Option<usize>,
}

impl Progress {
    fn reached(&self, end: Result<()>) -> Reached {
        let states = [self.safe, self.tried].into_iter().chain(self.failed).collect();
        Reached { states, is_early: self.is_early, end }
    }
}

impl Subject for Build {
    fn disk(&self) -> FaultyDisk {
        FaultyDisk::new(Fault::None)
    }

    fn run(&self, disk: &FaultyDisk, from: usize) -> Reached {
        let mut progress = Progress { is_early: true, safe: from, tried: from, failed: None };
        let end = self.run_on(disk, from, &mut progress);
        if let Err(error) = &end {
            assert!(disk.has_crashed() || disk.had_permanent_fault(), "{error:#}");
        }
        progress.reached(end)
    }

    fn find(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize {
        let reader = match MapReader::open(at(disk), 0) {
            Err(Error::NoMap { .. }) if among.contains(&0) => return 0,
            opened => opened.unwrap_or_else(|error| panic!("{what}: {among:?}: {error:#}")),
        };
        let found = reader.scan_number() as usize;
        assert!(among.contains(&found), "{what}: {found} is not one of {among:?}");
        self.check_digest(&reader, what);
        // The list of scans and the kept scans match the flush that the reader sees.
        let numbers: Vec<u64> = (1..=found as u64).collect();
        let listed = reader.scans().unwrap_or_else(|error| panic!("{what}: {error:#}"));
        assert!(listed.iter().map(|scan| scan.number).eq(numbers.iter().copied()), "{what}");
        if reader.keeps_scans() && found > 0 {
            let kept = reader.kept_scans().unwrap_or_else(|error| panic!("{what}: {error:#}"));
            let kept = kept.map(|scan| scan.unwrap_or_else(|error| panic!("{what}: {error:#}")).number());
            assert_eq!(kept.collect::<Vec<_>>(), numbers, "{what}");
        }
        found
    }

    fn check_end(&self, disk: &FaultyDisk, what: &str) {
        self.find(disk, &[self.scans.len()], what);
        let is_left = |path: &std::path::PathBuf| path.to_string_lossy().ends_with(".next");
        assert!(!disk.files().keys().any(is_left), "{what}");
    }
}

/// Faults after which the same process eventually succeeds.
const REFUSALS: [fn(u64) -> Fault; 4] = [Fault::Fails, Fault::LosesSync, Fault::IsFull, Fault::IsReadOnly];

#[test]
fn a_call_that_fails_once_changes_nothing_and_succeeds_on_retry() {
    let keeping = Build::of(config().with_kept_scans(true)).with_background_flushes();
    for build in Build::all(&config()).chain([keeping]) {
        sweep(&build, faults(&build, &REFUSALS, 32), &[Left::Dropped]);
    }
}

#[test]
fn a_persistent_fault_gives_no_wrong_results_and_the_map_recovers_after_it() {
    for config in [config(), compact()] {
        let build = Build::of(config);
        sweep(&build, faults(&build, &[Fault::Breaks], 16), &[Left::Mended]);
    }
}

#[test]
fn a_power_cut_at_any_operation_keeps_the_last_flush() {
    let keeping = Build::of(config().with_kept_scans(true)).with_background_flushes();
    for build in Build::all(&config()).chain([keeping]) {
        sweep(&build, faults(&build, &[Fault::Crashes], 24), &EVERY_CRASH);
    }
}

/// With little memory, resident tiles become compact, a separate thread writes them, and updates wait in files. The
/// order of operations is then not deterministic.
#[test]
fn faults_and_power_cuts_with_little_memory() {
    let kinds: [fn(u64) -> Fault; 3] = [Fault::Fails, Fault::IsFull, Fault::Crashes];
    for build in Build::all(&config().with_tight_memory_bytes(6_000)) {
        sweep(&build, faults(&build, &kinds, 40), &[Left::Shuffled(0)]);
    }
}

#[test]
fn a_power_cut_after_a_kill_keeps_the_last_flush() {
    sweep_after_kills(&Build::of(config()), 4, |at| vec![at % 17, 7 + at % 89]);
}

/// Other tests take samples of the fault points; this one takes each, because a map with `metadata.json` but without its
/// log is damaged.
#[test]
fn a_power_cut_during_creation_leaves_no_map_or_an_empty_one() {
    for change in 0.. {
        let disk = FaultyDisk::new(Fault::Crashes(change));
        let created = OutOfCoreTileMapper::create(at(&disk), config());
        if !disk.has_crashed() {
            assert!(created.is_ok() && change > 8, "{change}");
            break;
        }
        drop(created);
        for unsynced in [Unsynced::Dropped, Unsynced::Kept].into_iter().chain((0..32).map(Unsynced::Shuffled))
        {
            let left = disk.after_crash(unsynced);
            let found = MapReader::open(at(&left), 0).map(|reader| reader.scan_number());
            assert!(matches!(found, Ok(0) | Err(Error::NoMap { .. })), "{change}, {unsynced:?}: {found:?}");
            assert_eq!(open_or_create(&left, &config()).unwrap().scan_number(), 0, "{change}, {unsynced:?}");
        }
    }
}

#[test]
fn a_second_power_cut_while_opening_keeps_the_last_flush() {
    for config in [config(), compact()] {
        crash_again_while_opening(&Build::of(config));
    }
}

fn crash_again_while_opening(build: &Build) {
    let mut points = 0;
    for (at, fault) in (0..).zip(faults(build, &[Fault::Crashes], 24)) {
        let disk = build.disk();
        disk.set_fault(fault);
        let reached = build.run(&disk, 0);
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at)] {
            let left = disk.after_crash(unsynced);
            for again in 0.. {
                let recovering = left.copy();
                recovering.set_fault(Fault::Crashes(again));
                let opened = build.open(&recovering);
                if !recovering.has_crashed() {
                    break;
                }
                points += 1;
                // Opening fails, except if the crash is in its last steps: the next commit repeats these, so their
                // errors are only logged.
                drop(opened);
                let what = format!("{fault:?}, {unsynced:?}, again at {again} of opening");
                let left = recovering.after_crash(Unsynced::Shuffled(again));
                build.find(&left, &reached.states, &what);
                match build.open(&left) {
                    Ok(mapper) => build.check_digest(&mapper, &what),
                    Err(Error::NoMap { .. }) if reached.states.contains(&0) => {}
                    Err(error) => panic!("{what}: {error:#}"),
                }
            }
        }
    }
    println!("{points} second crashes");
}

/// The process does not retry the failed flush: it continues to insert scans until the power fails.
#[test]
fn a_failed_flush_does_not_reappear_after_a_crash() {
    let build = Build::of(config());
    let mut points = 0;
    for (at, fault) in (0..).zip(faults(&build, &[Fault::LosesSync], 16)) {
        for later in [0, 1, 2, 3, 5, 8, 13, 21, 34] {
            let disk = FaultyDisk::new(fault);
            let Some(reached) = run_ignoring_failed_flushes(&disk, &build, Fault::Crashes(later)) else {
                break;
            };
            points += 1;
            let unsynced =
                [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at), Unsynced::Shuffled(later)];
            for unsynced in unsynced {
                let what = format!("{fault:?}, crash {later} later, {unsynced:?}");
                build.check(&disk.after_crash(unsynced), &reached, &what);
            }
        }
    }
    println!("{points} crashes after a failed flush");
}

/// Inserts all scans and ignores failed flushes. The second fault begins after the first failed flush. Returns `None`
/// if no flush failed, or if another operation failed.
fn run_ignoring_failed_flushes(disk: &FaultyDisk, build: &Build, then: Fault) -> Option<Reached> {
    let mut mapper = build.create(disk).ok()?;
    mapper.begin_input(INPUT).ok()?;
    let mut progress = Progress { is_early: false, safe: 0, tried: 0, failed: None };
    let mut has_failed = false;
    for (scan, number) in build.scans.iter().zip(1..) {
        if mapper.insert_scan(scan).is_err() {
            break;
        }
        if FLUSHED.contains(&number) {
            progress.tried = number;
            match mapper.flush() {
                Ok(()) => progress.safe = number,
                Err(_) if has_failed => break,
                Err(_) => {
                    has_failed = true;
                    if disk.has_crashed() {
                        break;
                    }
                    disk.set_fault(then);
                }
            }
        }
    }
    has_failed.then(|| progress.reached(Ok(())))
}

#[test]
fn the_next_process_ignores_a_failed_flush() {
    let build = Build::of(config());
    let mut points = 0;
    for fault in faults(&build, &[Fault::LosesSync, Fault::LosesSyncAndDies], 4) {
        let disk = FaultyDisk::new(fault);
        // The process ends at the failed flush.
        let Some(reached) = run_ignoring_failed_flushes(&disk, &build, Fault::Crashes(0)) else { continue };
        points += 1;
        let next = disk.after_kill();
        drop(build.open(&next).unwrap());
        build.check(&next.after_crash(Unsynced::Dropped), &reached, &format!("{fault:?}"));
    }
    println!("{points} failed flushes and new processes");
}

/// The input of a map is recorded by the commit, before `metadata.json` contains it.
#[test]
fn the_input_is_that_of_the_last_commit() {
    let build = Build::of(config());
    let begin = |fault| {
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = build.create(&disk).unwrap();
        mapper.insert_scan(&build.scans[0]).unwrap();
        mapper.begin_input("other scans").unwrap();
        disk.set_fault(fault);
        let begun = mapper.begin_input(INPUT).is_ok();
        (disk, begun)
    };
    // The commit is the complete record in the log. The log is longest just before it is compacted, after
    // `metadata.json`.
    let log_bytes = |disk: &FaultyDisk| disk.files()[&map().join("commits.log")].len();
    let metadata_has_input = |disk: &FaultyDisk| {
        String::from_utf8_lossy(&disk.files()[&map().join("metadata.json")]).contains(INPUT)
    };
    let crash = |at| {
        let (disk, begun) = begin(Fault::Crashes(at));
        disk.has_crashed().then(|| (disk.after_crash(Unsynced::Kept), begun))
    };
    let crashes: Vec<_> = (0..).map_while(crash).collect();
    let longest = crashes.iter().map(|(left, _)| log_bytes(left)).max().unwrap();
    let (mut committed, mut not_committed) = (0, 0);
    for (at, (left, begun)) in crashes.iter().enumerate() {
        let is_committed = log_bytes(left) == longest || metadata_has_input(left);
        assert!(is_committed || !begun);
        *(if is_committed { &mut committed } else { &mut not_committed }) += 1;
        let resumed =
            build.open(left).unwrap().resume_input(if is_committed { INPUT } else { "other scans" });
        assert!(resumed.is_ok(), "crash at {at}: {resumed:?}");
    }
    assert!(committed > 1 && not_committed > 0);
}

#[test]
fn a_failed_sync_and_then_a_full_disk_lose_nothing() {
    let build = Build::of(config());
    for (lost, full) in some_of((0..60).flat_map(|lost| (0..12).map(move |full| (lost, full))), 2) {
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = build.create(&disk).unwrap();
        for scan in &build.scans[..3] {
            mapper.insert_scan(scan).unwrap();
        }
        disk.set_fault(Fault::LosesSync(lost));
        if mapper.flush().is_ok() {
            continue;
        }
        disk.set_fault(Fault::IsFull(full));
        let _ = mapper.flush();
        disk.make_room();
        // Queries evict tiles from memory.
        for tile in mapper.tile_indices() {
            mapper.tile(tile).unwrap();
        }
        mapper.flush().unwrap_or_else(|error| panic!("at {lost}, full {full}: {error:#}"));
        build.check_digest(&mapper, "after the disk has space again");
        let left = disk.after_crash(Unsynced::Dropped);
        build.check_digest(&MapReader::open(at(&left), 0).unwrap(), "after a crash");
    }
}

#[test]
fn a_failed_reload_changes_nothing() {
    let build = Build::of(config());
    let disk = FaultyDisk::new(Fault::None);
    let roomy = config().with_write_buffer_bytes(1 << 20);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), roomy).unwrap();
    for (scan, number) in build.scans.iter().zip(1..) {
        mapper.insert_scan(scan).unwrap();
        if number == 3 {
            mapper.flush().unwrap();
        }
    }
    for tile in mapper.tile_indices() {
        for at in 0..6 {
            disk.set_fault(Fault::Fails(at));
            let reloaded = mapper.is_tile_dirty(tile).then(|| mapper.reload(tile, true).is_ok());
            disk.make_room();
            if reloaded == Some(true) {
                return;
            }
            build.check_digest(&mapper, "after a failed reload");
        }
    }
}

/// A map of the original format with the content of the first three scans.
fn foreign(build: &Build) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = build.create(&disk).unwrap();
    for scan in &build.scans[..3] {
        mapper.insert_scan(scan).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    let disk = disk.copy();
    make_foreign(&disk, map());
    disk
}

#[test]
fn conversion_of_the_original_format_is_atomic() {
    let build = Build::of(config());
    let (foreign, fourth) = (foreign(&build), build.scans[3].clone());
    let before = digest_of(&foreign, None).unwrap();
    let convert = move |disk: &FaultyDisk| -> Result<()> {
        let mut mapper = OutOfCoreTileMapper::open(at(disk), config())?;
        if mapper.digest()? == before {
            mapper.insert_scan(&fourth)?;
        }
        mapper.flush()
    };
    let done = foreign.copy();
    convert(&done).unwrap();
    let after = digest_of(&done, None).unwrap();
    let job = Job::new(foreign.copy(), map(), convert.clone(), |disk| digest_of(disk, None).unwrap());
    sweep(&job, faults(&job, &[Fault::Crashes], 2), &EVERY_CRASH);
    // The disk becomes full twice, at any two changes.
    for (first, second) in some_of((0..90).flat_map(|first| (0..90).map(move |second| (first, second))), 6) {
        let disk = foreign.copy();
        let mut mapper = build.open(&disk).unwrap();
        mapper.insert_scan(&build.scans[3]).unwrap();
        for full in [first, second] {
            disk.set_fault(Fault::IsFull(full));
            let _ = mapper.flush();
        }
        disk.make_room();
        mapper.flush().unwrap_or_else(|error| panic!("full at {first}, at {second}: {error:#}"));
        assert_eq!(mapper.digest().unwrap(), after);
    }
    // A reader that was opened before the conversion sees the old content.
    let disk = foreign.copy();
    let reader = MapReader::open(at(&disk), 0).unwrap();
    convert(&disk).unwrap();
    assert_eq!(reader.digest().unwrap(), before);
}
