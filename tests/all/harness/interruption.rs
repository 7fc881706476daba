use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::support::some_of;
use voxtile::Result;

/// A procedure on a disk that leads a map through numbered states.
pub trait Subject {
    /// Returns the initial disk, in state 0.
    fn disk(&self) -> FaultyDisk;

    /// Runs the procedure from a state to its end.
    fn run(&self, disk: &FaultyDisk, from: usize) -> Reached;

    /// Returns the state of the map. Panics if it is not in `among`, or if the map is damaged.
    fn find(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize;

    /// Panics unless the disk is in its final state.
    fn check_end(&self, disk: &FaultyDisk, what: &str);

    /// Checks a disk on which an operation failed without a crash. Does nothing by default.
    fn check_refused(&self, _: &FaultyDisk, _: Fault) {}

    /// Panics unless the map is intact and in one of the reached states, and another run completes the procedure.
    fn check(&self, left: &FaultyDisk, reached: &Reached, what: &str) {
        let from = self.find(left, &reached.states, what);
        let again = self.run(left, from);
        again.end.unwrap_or_else(|error| panic!("{what}: again from state {from}: {error:#}"));
        self.check_end(left, what);
    }
}

/// Result of a run of a [`Subject`].
#[derive(Debug)]
pub struct Reached {
    /// States that the map may be in.
    pub states: Vec<usize>,
    /// Whether the run made nothing durable, so that a crash may restore the state before the previous run.
    pub is_early: bool,
    /// Error that ended the run.
    pub end: Result<()>,
}

/// State of a disk after a fault.
#[derive(Clone, Copy, Debug)]
pub enum Left {
    /// The same disk without the fault.
    Mended,
    /// The process was killed: written data is complete, but not yet on the medium.
    Killed,
    /// Power cut: only synced data is left.
    Dropped,
    /// Power cut after all data reached the medium.
    Kept,
    /// Power cut: a random part of unsynced names and blocks is left. The number is a seed.
    Shuffled(u64),
}

/// Possible states after a power cut.
pub const EVERY_CRASH: [Left; 5] =
    [Left::Dropped, Left::Kept, Left::Shuffled(0), Left::Shuffled(1), Left::Shuffled(2)];

impl Left {
    fn of(self, disk: &FaultyDisk, seed: u64) -> FaultyDisk {
        match self {
            Self::Mended => {
                disk.make_room();
                disk.mend();
                disk.clone()
            }
            Self::Killed => disk.after_kill(),
            Self::Dropped => disk.after_crash(Unsynced::Dropped),
            Self::Kept => disk.after_crash(Unsynced::Kept),
            Self::Shuffled(number) => disk.after_crash(Unsynced::Shuffled(31 * seed + number)),
        }
    }
}

/// Returns faults of these kinds at one in `one_in` moments of an undisturbed run, whose end is checked.
pub fn faults(subject: &impl Subject, kinds: &[fn(u64) -> Fault], one_in: u64) -> Vec<Fault> {
    let undisturbed = subject.disk();
    undisturbed.set_fault(Fault::None);
    subject.run(&undisturbed, 0).end.unwrap();
    let (operations, changes) = (undisturbed.operations(), undisturbed.changes());
    subject.check_end(&undisturbed, "undisturbed");
    println!("{operations} operations, {changes} of them changes");
    let of_kind = |kind: &fn(u64) -> Fault| {
        let moments =
            if matches!(kind(0), Fault::Fails(_) | Fault::Breaks(_)) { operations } else { changes };
        (0..moments).map(*kind)
    };
    some_of(kinds.iter().flat_map(of_kind), one_in).collect()
}

/// Runs the subject with each fault, and checks the disk in each of these states.
pub fn sweep(subject: &impl Subject, faults: impl IntoIterator<Item = Fault>, lefts: &[Left]) {
    for (number, fault) in (0..).zip(faults) {
        let disk = subject.disk();
        disk.set_fault(fault);
        let reached = subject.run(&disk, 0);
        if reached.end.is_err() && !disk.has_crashed() {
            subject.check_refused(&disk, fault);
        }
        for left in lefts {
            subject.check(&left.of(&disk, number), &reached, &format!("{fault:?}, {left:?}"));
        }
    }
}

/// Kills the process at one in `one_in` changes. The next run is interrupted by a power cut at each change that `later`
/// computes from the first one.
pub fn sweep_after_kills(subject: &impl Subject, one_in: u64, later: impl Fn(u64) -> Vec<u64>) {
    for fault in faults(subject, &[Fault::Crashes], one_in) {
        let Fault::Crashes(at) = fault else { unreachable!("only crashes were requested") };
        let disk = subject.disk();
        disk.set_fault(fault);
        let killed = subject.run(&disk, 0);
        for again in later(at) {
            let what = format!("killed at {at}, crash {again} later");
            let disk = disk.after_kill();
            let from = subject.find(&disk, &killed.states, &what);
            disk.set_fault(Fault::Crashes(again));
            let mut reached = subject.run(&disk, from);
            if !disk.has_crashed() {
                continue;
            }
            if reached.is_early {
                reached.states.extend(&killed.states);
            }
            subject.check(&Left::Shuffled(again).of(&disk, at), &reached, &what);
        }
    }
}
