use std::path::PathBuf;
use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::random_scans::{Random, random_scan};
use testkit::support::some_of;
use voxtile::{
    Error, InMemoryMapper, MapConfig, MapPath, MapQueries, MapReader, MapView, Mapper, Occupancy,
    OutOfCoreTileMapper, Queries, Result, Scan, Storage,
};

const INPUT: &str = "random scans";
/// After these scans the map is flushed; after `REOPENED` it is closed and opened again as well.
const FLUSHED: [usize; 4] = [3, 5, 8, 11];
const REOPENED: usize = 8;

fn map() -> PathBuf {
    PathBuf::from("/city/map")
}

/// Room for two tiles and next to nothing that waits: every scan evicts.
fn config() -> MapConfig {
    MapConfig::new(0.4, 3.2).unwrap().with_range(0.0, 3.0).with_cache_tiles(2).with_write_buffer_bytes(600)
}

/// The same map with compact storage.
fn compact() -> MapConfig {
    config().with_storage(Storage::Compact)
}

/// Next to no memory: resident tiles become compact, those are saved by a thread of their own, and updates wait in
/// files. Which operation comes as the n-th is left to chance then.
fn short_of_memory() -> MapConfig {
    config().with_tight_memory_bytes(6_000)
}

/// Scans on a way there and back again, so that tiles come again that were pushed out.
fn scans() -> Vec<Scan> {
    let mut random = Random(7);
    let ways = [0.0, 3.0, 6.0, 3.0, 0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0];
    ways.iter().map(|&x| random_scan(&mut random, [x, 0.0, 0.0], 4)).collect()
}

/// What must come out: the digests after each number of scans.
struct Oracle {
    config: MapConfig,
    scans: Vec<Scan>,
    digests: Vec<voxtile::Digest>,
    answers: Vec<Occupancy>,
    /// Whether flushes go on beside the scans that come next.
    is_beside: bool,
}

impl Oracle {
    fn new() -> Self {
        Self::of(config())
    }

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
        Self { config, scans, digests, answers, is_beside: false }
    }

    /// The same life with flushes beside scans. Which operation comes as the n-th is left to chance then.
    fn beside(self) -> Self {
        Self { is_beside: true, ..self }
    }

    fn check(&self, map: &impl MapView, what: &str) {
        let number = map.scan_number() as usize;
        let digest = map.digest().unwrap_or_else(|error| panic!("{what}: after {number} scans: {error:#}"));
        assert_eq!(digest, self.digests[number], "{what}: after {number} scans");
    }
}

fn create(disk: &FaultyDisk, oracle: &Oracle) -> Result<OutOfCoreTileMapper> {
    match OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), oracle.config.clone()) {
        // An attempt that failed at its very end has made the map.
        Err(Error::AlreadyExists { .. }) => open(disk, oracle),
        created => created,
    }
}

fn open(disk: &FaultyDisk, oracle: &Oracle) -> Result<OutOfCoreTileMapper> {
    OutOfCoreTileMapper::open(MapPath::on(disk.shared(), map()), oracle.config.clone())
}

fn open_or_create(disk: &FaultyDisk, oracle: &Oracle) -> Result<OutOfCoreTileMapper> {
    match open(disk, oracle) {
        Err(Error::NoMap { .. }) => create(disk, oracle),
        opened => opened,
    }
}

/// Does one thing. If the disk refuses, the subject must be as before; again, in vain if there is no room; and with
/// room it must go. `None` if the power went.
fn insist<S, T>(
    disk: &FaultyDisk,
    subject: &mut S,
    look: impl Fn(&S),
    mut attempt: impl FnMut(&mut S) -> Result<T>,
) -> Option<T> {
    for number in 0.. {
        match attempt(subject) {
            Ok(done) => return Some(done),
            Err(_) if disk.has_crashed() => return None,
            // Of what could not be read when the map was opened, nobody can tell what it was: not before it is opened
            // again.
            Err(Error::Damaged { .. }) if disk.had_a_fault_that_stays() => return None,
            Err(error) => {
                assert!(number < 3 && matches!(error, Error::Io { .. }), "attempt {number}: {error:#}");
                look(subject);
            }
        }
        if number == 1 {
            disk.make_room();
        }
    }
    None
}

/// How far a life came: the last flush that returned, and the one that was tried last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Reached {
    safe: usize,
    tried: usize,
    /// One beside scans that failed before: a crash may bring back its record.
    failed: usize,
    finished: bool,
}

/// Waits for a flush that went on beside scans; what it could not do is done now, after `number` scans.
fn end_flush(
    disk: &FaultyDisk,
    mapper: &mut OutOfCoreTileMapper,
    look: impl Fn(&OutOfCoreTileMapper),
    reached: &mut Reached,
    number: usize,
) -> Option<()> {
    match mapper.end_flush() {
        Ok(()) => reached.safe = reached.tried,
        Err(_) if disk.has_crashed() => return None,
        Err(error) => {
            assert!(matches!(error, Error::Io { .. }), "{error:#}");
            look(mapper);
            (reached.failed, reached.tried) = (reached.tried, number);
            insist(disk, mapper, look, |mapper| mapper.flush())?;
            reached.safe = number;
        }
    }
    assert!(mapper.flushed_scan_number() as usize == reached.safe && !mapper.is_flushing());
    Some(())
}

/// Builds the map to the end, from wherever it is, with a reader beside it now and then.
fn live(disk: &FaultyDisk, oracle: &Oracle) -> Reached {
    let mut reached = Reached::default();
    let finished = live_until_crash(disk, oracle, &mut reached).is_some();
    Reached { finished, ..reached }
}

fn live_until_crash(disk: &FaultyDisk, oracle: &Oracle, reached: &mut Reached) -> Option<()> {
    let nothing = |_: &()| ();
    let look = |mapper: &OutOfCoreTileMapper| {
        if disk.broken().is_some() {
            // What is not to be had is an error; what is had is right.
            match mapper.digest() {
                Ok(digest) => assert_eq!(digest, oracle.digests[mapper.scan_number() as usize]),
                Err(error) => assert!(error.is_of_medium(), "{error:#}"),
            }
            return;
        }
        oracle.check(mapper, "after an error");
        // A query that wants a tile in memory.
        let answer = mapper.occupancy_at([3.0, 0.1, 0.1]).expect("queries go on");
        assert_eq!(answer, oracle.answers[mapper.scan_number() as usize]);
    };
    let mut mapper = insist(disk, &mut (), nothing, |_| open_or_create(disk, oracle))?;
    let done = insist(disk, &mut mapper, look, |mapper| mapper.resume_input(INPUT))? as usize;
    (reached.safe, reached.tried) = (done, done);
    assert_eq!(mapper.scan_number(), done as u64);
    let digest = insist(disk, &mut mapper, look, |mapper| mapper.digest())?;
    assert_eq!(digest, oracle.digests[done], "as opened");
    let mut readers: Vec<MapReader> = Vec::new();
    for (scan, number) in oracle.scans.iter().zip(1..).skip(done) {
        insist(disk, &mut mapper, look, |mapper| mapper.insert_scan(scan))?;
        if !FLUSHED.contains(&number) {
            continue;
        }
        if oracle.is_beside {
            // Before a reader opens the map: one that comes between a commit and its `metadata.json` waits for the
            // writer a tenth of a second, and this disk has no clock.
            end_flush(disk, &mut mapper, look, reached, number)?;
        }
        let reader = || MapReader::open(MapPath::on(disk.shared(), map()), 0);
        readers.push(insist(disk, &mut (), nothing, |_| reader())?);
        if oracle.is_beside {
            reached.tried = number;
            insist(disk, &mut mapper, look, |mapper| mapper.begin_flush())?;
        } else {
            reached.tried = number;
            insist(disk, &mut mapper, look, |mapper| mapper.flush())?;
            reached.safe = number;
        }
        for reader in &mut readers {
            let digest = insist(disk, reader, |_| (), |reader| reader.digest())?;
            assert_eq!(digest, oracle.digests[reader.scan_number() as usize], "a reader beside the writer");
        }
        if number == REOPENED {
            readers.clear();
            end_flush(disk, &mut mapper, look, reached, number)?;
            drop(mapper);
            mapper = insist(disk, &mut (), nothing, |_| open(disk, oracle))?;
        }
    }
    let digest = insist(disk, &mut mapper, look, |mapper| mapper.digest())?;
    assert_eq!(digest, oracle.digests[oracle.scans.len()], "at the end");
    end_flush(disk, &mut mapper, look, reached, oracle.scans.len())
}

/// The list of scans is that of the flush that the reader sees.
fn check_scans(reader: &MapReader, what: &str) {
    let scans = reader.scans().unwrap_or_else(|error| panic!("{what}: {error:#}"));
    let numbers: Vec<u64> = scans.iter().map(|scan| scan.number).collect();
    assert_eq!(numbers, (1..=reader.scan_number()).collect::<Vec<_>>(), "{what}");
    if reader.keeps_scans() && reader.scan_number() > 0 {
        let kept = reader.kept_scans().unwrap_or_else(|error| panic!("{what}: {error:#}"));
        let kept = kept.map(|scan| scan.unwrap_or_else(|error| panic!("{what}: {error:#}")).number());
        assert_eq!(kept.collect::<Vec<_>>(), numbers, "{what}");
    }
}

/// The disk after an undisturbed life.
fn undisturbed(oracle: &Oracle) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    assert!(live(&disk, oracle).finished);
    disk
}

/// What a crash left opens as of the last flush that returned, or of the one that it hit, whole; and the build goes
/// on from there to the same end.
fn check_after_crash(disk: &FaultyDisk, oracle: &Oracle, reached: Reached, what: &str) {
    let allowed = [reached.safe, reached.tried, reached.failed];
    match MapReader::open(MapPath::on(disk.shared(), map()), 0) {
        Ok(reader) => {
            assert!(allowed.contains(&(reader.scan_number() as usize)), "{what}: {reached:?}");
            oracle.check(&reader, what);
            check_scans(&reader, what);
        }
        Err(Error::NoMap { .. }) if reached.safe == 0 => {}
        Err(error) => panic!("{what}: {reached:?}: {error:#}"),
    }
    let end = live(disk, oracle);
    assert!(end.finished, "{what}");
    assert!(disk.files().keys().all(|path| !path.to_string_lossy().ends_with(".next")), "{what}");
}

#[test]
fn every_operation_fails_once_and_the_call_is_undone_and_goes_the_next_time() {
    for config in [config(), compact()] {
        fail_once_at_every_operation(&Oracle::of(config.clone()));
        fail_once_at_every_operation(&Oracle::of(config).beside());
    }
    fail_once_at_every_operation(&Oracle::of(config().with_kept_scans(true)).beside());
}

fn fail_once_at_every_operation(oracle: &Oracle) {
    let disk = undisturbed(oracle);
    let (operations, changes) = (disk.operations(), disk.changes());
    println!("{operations} operations, {changes} of them changes, {} storage", oracle.config.storage);
    let faults = (0..operations).map(Fault::Fails);
    let faults = faults.chain((0..changes).map(Fault::LosesSync));
    let faults = faults.chain((0..changes).map(Fault::IsFull));
    for fault in some_of(faults.chain((0..changes).map(Fault::IsReadOnly)), 5) {
        let disk = FaultyDisk::new(fault);
        let reached = live(&disk, oracle);
        assert!(reached.finished, "{fault:?}");
        // What was said to be safe is on the medium.
        let left = disk.after_crash(Unsynced::Dropped);
        let reader = MapReader::open(MapPath::on(left.shared(), map()), 0)
            .unwrap_or_else(|error| panic!("{fault:?}: {error:#}"));
        assert_eq!(reader.scan_number() as usize, oracle.scans.len(), "{fault:?}");
        oracle.check(&reader, &format!("{fault:?}"));
        check_scans(&reader, &format!("{fault:?}"));
    }
}

#[test]
fn a_fault_that_stays_gives_no_wrong_answer_and_once_it_is_mended_the_map_goes_on() {
    for config in [config(), compact()] {
        let oracle = Oracle::of(config);
        for operation in some_of(0..undisturbed(&oracle).operations(), 4) {
            let disk = FaultyDisk::new(Fault::Breaks(operation));
            let mut reached = live(&disk, &oracle);
            disk.mend();
            if !reached.finished {
                reached = live(&disk, &oracle);
            }
            assert!(reached.finished, "{operation}");
            let reader = MapReader::open(MapPath::on(disk.shared(), map()), 0).unwrap();
            oracle.check(&reader, &format!("operation {operation}"));
        }
    }
}

#[test]
fn the_power_goes_at_every_operation_and_the_last_flush_is_there() {
    for config in [config(), compact()] {
        crash_at_every_operation(&Oracle::of(config.clone()));
        crash_at_every_operation(&Oracle::of(config).beside());
    }
    crash_at_every_operation(&Oracle::of(config().with_kept_scans(true)).beside());
}

fn crash_at_every_operation(oracle: &Oracle) {
    for at in some_of(0..undisturbed(oracle).changes(), 5) {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let reached = live(&disk, oracle);
        // The last operations may be more or fewer where threads do them side by side.
        assert!(disk.has_crashed() || (oracle.is_beside && reached.finished));
        let shuffled = (0..3).map(|seed| Unsynced::Shuffled(31 * at + seed));
        for unsynced in shuffled.chain([Unsynced::Dropped, Unsynced::Kept]) {
            let what = format!("crash at {at}, {unsynced:?}");
            let left = disk.after_crash(unsynced);
            check_after_crash(&left.copy(), oracle, reached, &what);
        }
    }
}

#[test]
fn short_of_memory_every_operation_fails_once_and_the_power_goes_at_every_operation() {
    for storage in [Storage::OctoMap, Storage::Compact] {
        let config = short_of_memory().with_storage(storage);
        fail_and_crash_short_of_memory(&Oracle::of(config.clone()));
        fail_and_crash_short_of_memory(&Oracle::of(config).beside());
    }
}

fn fail_and_crash_short_of_memory(oracle: &Oracle) {
    let changes = undisturbed(oracle).changes();
    for at in some_of(0..changes, 5) {
        for fault in [Fault::Fails(2 * at), Fault::IsFull(at), Fault::Crashes(at)] {
            let disk = FaultyDisk::new(fault);
            let reached = live(&disk, oracle);
            let left = disk.after_crash(Unsynced::Shuffled(at));
            if reached.finished {
                let reader = MapReader::open(MapPath::on(left.shared(), map()), 0);
                oracle.check(&reader.unwrap_or_else(|error| panic!("{fault:?}: {error:#}")), "at the end");
            } else {
                assert!(disk.has_crashed(), "{fault:?}");
                check_after_crash(&left, oracle, reached, &format!("{fault:?}, short of memory"));
            }
        }
    }
}

#[test]
fn the_power_goes_some_time_after_the_process_was_killed_at_every_operation() {
    let oracle = Oracle::new();
    let changes = undisturbed(&oracle).changes();
    for at in some_of(0..changes, 4) {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let before = live(&disk, &oracle);
        for again in [at % 17, 7 + at % 89] {
            let killed = disk.after_kill();
            killed.set_fault(Fault::Crashes(again));
            let mut reached = live(&killed, &oracle);
            if reached == Reached::default() {
                // It did not come to open the map.
                reached = before;
            }
            let left = killed.after_crash(Unsynced::Shuffled(again));
            check_after_crash(&left, &oracle, reached, &format!("killed at {at}, crash {again} later"));
        }
    }
}

#[test]
fn the_power_goes_again_at_every_operation_of_opening_after_a_crash() {
    for config in [config(), compact()] {
        crash_again_while_opening(&Oracle::of(config));
    }
}

fn crash_again_while_opening(oracle: &Oracle) {
    let mut points = 0;
    for at in some_of(0..undisturbed(oracle).changes(), 12) {
        let disk = FaultyDisk::new(Fault::Crashes(at));
        let reached = live(&disk, oracle);
        for unsynced in [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at)] {
            let left = disk.after_crash(unsynced);
            for again in 0.. {
                let recovering = left.copy();
                recovering.set_fault(Fault::Crashes(again));
                let opened = open(&recovering, oracle);
                if !recovering.has_crashed() {
                    break;
                }
                points += 1;
                // An error, except in the last steps: a later commit replaces `metadata.json` and the log as well.
                drop(opened);
                let what = format!("crash at {at}, {unsynced:?}, again at {again} of opening");
                let left = recovering.after_crash(Unsynced::Shuffled(again));
                match MapReader::open(MapPath::on(left.shared(), map()), 0) {
                    Ok(reader) => {
                        let found = reader.scan_number() as usize;
                        assert!([reached.safe, reached.tried].contains(&found), "{what}");
                        oracle.check(&reader, &what);
                    }
                    Err(Error::NoMap { .. }) if reached.safe == 0 => {}
                    Err(error) => panic!("{what}: {error:#}"),
                }
                match open(&left, oracle) {
                    Ok(mapper) => oracle.check(&mapper, &what),
                    Err(Error::NoMap { .. }) if reached.safe == 0 => {}
                    Err(error) => panic!("{what}: {error:#}"),
                }
            }
        }
    }
    println!("{points} second crashes");
}

/// A flush that the disk refused is not tried again at once: the map goes on, and the power goes.
#[test]
fn a_flush_that_failed_leaves_nothing_behind_that_a_crash_could_bring_back() {
    let oracle = Oracle::new();
    let mut points = 0;
    for at in some_of(0..undisturbed(&oracle).changes(), 8) {
        for later in [0, 1, 2, 3, 5, 8, 13, 21, 34] {
            let disk = FaultyDisk::new(Fault::LosesSync(at));
            let Some(reached) = live_carelessly(&disk, &oracle, Fault::Crashes(later)) else { break };
            points += 1;
            let unsynced =
                [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at), Unsynced::Shuffled(later)];
            for unsynced in unsynced {
                let what = format!("sync lost at {at}, crash {later} later, {unsynced:?}");
                check_after_crash(&disk.after_crash(unsynced), &oracle, reached, &what);
            }
        }
    }
    println!("{points} crashes after a failed flush");
}

/// Inserts all scans and flushes as always, whatever a flush answers; after the first that fails comes another fault.
/// `None` if none failed, or something else did.
fn live_carelessly(disk: &FaultyDisk, oracle: &Oracle, then: Fault) -> Option<Reached> {
    let mut mapper = create(disk, oracle).ok()?;
    mapper.begin_input(INPUT).ok()?;
    let (mut reached, mut has_failed) = (Reached::default(), false);
    for (scan, number) in oracle.scans.iter().zip(1..) {
        if mapper.insert_scan(scan).is_err() {
            break;
        }
        if FLUSHED.contains(&number) {
            reached.tried = number;
            match mapper.flush() {
                Ok(()) => reached.safe = number,
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
    has_failed.then_some(reached)
}

#[test]
fn a_flush_that_failed_is_not_believed_by_the_next_process() {
    let oracle = Oracle::new();
    let mut points = 0;
    for at in some_of(0..undisturbed(&oracle).changes(), 2) {
        for fault in [Fault::LosesSync(at), Fault::LosesSyncAndDies(at)] {
            let disk = FaultyDisk::new(fault);
            // The process ends where the flush fails.
            let Some(reached) = live_carelessly(&disk, &oracle, Fault::Crashes(0)) else { continue };
            points += 1;
            let next = disk.after_kill();
            drop(open(&next, &oracle).unwrap());
            let left = next.after_crash(Unsynced::Dropped);
            check_after_crash(&left, &oracle, reached, &format!("{fault:?}"));
        }
    }
    println!("{points} failed flushes and new processes");
}

/// What a map was built from is known from the commit on, not from when `metadata.json` says it too.
#[test]
fn the_input_is_that_of_the_last_commit() {
    let oracle = Oracle::new();
    let begin = |fault| {
        let disk = FaultyDisk::new(Fault::None);
        let mut mapper = create(&disk, &oracle).unwrap();
        mapper.insert_scan(&oracle.scans[0]).unwrap();
        mapper.begin_input("other scans").unwrap();
        disk.set_fault(fault);
        let begun = mapper.begin_input(INPUT).is_ok();
        (disk, begun)
    };
    // The commit is the whole record in the log; that is longest before it is compacted, after `metadata.json`.
    let log_bytes = |disk: &FaultyDisk| disk.files()[&map().join("commits.log")].len();
    let says_so = |disk: &FaultyDisk| {
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
        let is_committed = log_bytes(left) == longest || says_so(left);
        assert!(is_committed || !begun);
        *(if is_committed { &mut committed } else { &mut not_committed }) += 1;
        let resumed =
            open(left, &oracle).unwrap().resume_input(if is_committed { INPUT } else { "other scans" });
        assert!(resumed.is_ok(), "crash at {at}: {resumed:?}");
    }
    assert!(committed > 1 && not_committed > 0);
}

#[test]
fn a_failed_sync_and_then_a_full_disk_lose_nothing() {
    let oracle = Oracle::new();
    for at in 0..60 {
        for full in 0..12 {
            let disk = FaultyDisk::new(Fault::None);
            let mut mapper = create(&disk, &oracle).unwrap();
            for scan in &oracle.scans[..3] {
                mapper.insert_scan(scan).unwrap();
            }
            disk.set_fault(Fault::LosesSync(at));
            if mapper.flush().is_ok() {
                continue;
            }
            disk.set_fault(Fault::IsFull(full));
            let _ = mapper.flush();
            disk.make_room();
            // Queries push tiles out of memory.
            for tile in mapper.tile_indices() {
                mapper.tile(tile).unwrap();
            }
            mapper.flush().unwrap_or_else(|error| panic!("at {at}, full {full}: {error:#}"));
            oracle.check(&mapper, "with room");
            let left = disk.after_crash(Unsynced::Dropped);
            oracle.check(&MapReader::open(MapPath::on(left.shared(), map()), 0).unwrap(), "after a crash");
        }
    }
}

#[test]
fn a_reload_that_fails_changes_nothing() {
    let oracle = Oracle::new();
    let disk = FaultyDisk::new(Fault::None);
    let roomy = config().with_write_buffer_bytes(1 << 20);
    let mut mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), map()), roomy).unwrap();
    for (scan, number) in oracle.scans.iter().zip(1..) {
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
            oracle.check(&mapper, "after a reload that failed");
        }
    }
}

/// A map of the original format, with the content of the first three scans.
fn foreign(oracle: &Oracle) -> FaultyDisk {
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = create(&disk, oracle).unwrap();
    for scan in &oracle.scans[..3] {
        mapper.insert_scan(scan).unwrap();
    }
    mapper.flush().unwrap();
    drop(mapper);
    let disk = disk.copy();
    disk.take(&map().join("commits.log"));
    let metadata = br#"{"version": "1.0", "resolution": 0.4, "tile_size": 3.2, "bounds": {"min": [0,0,0], "max": [0,0,0]}}"#;
    disk.put(&map().join("metadata.json"), metadata);
    for (path, bytes) in disk.files() {
        if path.ends_with("iwlo_meta.bin") {
            let count = u64::from_le_bytes(bytes[8..16].try_into().unwrap()) as usize;
            disk.put(&path, &bytes[..16 + 18 * count]);
        }
    }
    disk
}

#[test]
fn a_map_of_the_seeds_format_is_adopted_whole_or_not_at_all() {
    let oracle = Oracle::new();
    let foreign = foreign(&oracle);
    let (before, after) = {
        let mut mapper = open(&foreign.copy(), &oracle).unwrap();
        let before = mapper.digest().unwrap();
        mapper.insert_scan(&oracle.scans[3]).unwrap();
        (before, mapper.digest().unwrap())
    };
    let adopt = |disk: &FaultyDisk| -> Result<()> {
        let mut mapper = open(disk, &oracle)?;
        mapper.insert_scan(&oracle.scans[3])?;
        mapper.flush()
    };
    for at in 0.. {
        let disk = foreign.copy();
        disk.set_fault(Fault::Crashes(at));
        let done = adopt(&disk).is_ok();
        for unsynced in
            [Unsynced::Dropped, Unsynced::Kept, Unsynced::Shuffled(at), Unsynced::Shuffled(at + 7)]
        {
            let left = disk.after_crash(unsynced);
            let what = format!("crash at {at}, {unsynced:?}");
            let reader = MapReader::open(MapPath::on(left.shared(), map()), 0)
                .unwrap_or_else(|error| panic!("{what}: {error:#}"));
            let digest = reader.digest().unwrap_or_else(|error| panic!("{what}: {error:#}"));
            assert!(digest == after || (!done && digest == before), "{what}");
            let mapper = open(&left, &oracle).unwrap_or_else(|error| panic!("{what}: {error:#}"));
            assert_eq!(mapper.digest().unwrap(), digest, "{what}");
        }
        if !disk.has_crashed() {
            break;
        }
    }
    // Twice no room, at any two changes.
    for first in (0..90).step_by(3) {
        for second in (0..90).step_by(2) {
            let disk = foreign.copy();
            let mut mapper = open(&disk, &oracle).unwrap();
            mapper.insert_scan(&oracle.scans[3]).unwrap();
            for full in [first, second] {
                disk.set_fault(Fault::IsFull(full));
                let _ = mapper.flush();
            }
            disk.make_room();
            mapper.flush().unwrap_or_else(|error| panic!("full at {first}, at {second}: {error:#}"));
            assert_eq!(mapper.digest().unwrap(), after);
        }
    }
    // A reader that opened it before sees what it was.
    let disk = foreign.copy();
    let reader = MapReader::open(MapPath::on(disk.shared(), map()), 0).unwrap();
    adopt(&disk).unwrap();
    assert_eq!(reader.digest().unwrap(), before);
}
