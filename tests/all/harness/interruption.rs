use testkit::faulty_disk::{Fault, FaultyDisk, Unsynced};
use testkit::support::some_of;
use voxtile::Result;

/// Something that is done to a disk, and leads a map through states with numbers.
pub trait Subject {
    /// The disk that it begins with, in state 0.
    fn disk(&self) -> FaultyDisk;

    /// Does it to its end, from a state.
    fn run(&self, disk: &FaultyDisk, from: usize) -> Reached;

    /// The state that the map is in. Panics if it is none of these, or if the map is not whole.
    fn find(&self, disk: &FaultyDisk, among: &[usize], what: &str) -> usize;

    /// Panics unless the disk is as it must be at the end.
    fn check_end(&self, disk: &FaultyDisk, what: &str);

    /// Looks at a disk that refused something, whose power is on. By default there is nothing to see.
    fn check_refused(&self, _: &FaultyDisk, _: Fault) {}

    /// Panics unless an interruption left one of the states that it may have left, whole, and leads from there to the
    /// same end.
    fn check(&self, left: &FaultyDisk, reached: &Reached, what: &str) {
        let from = self.find(left, &reached.states, what);
        let again = self.run(left, from);
        again.end.unwrap_or_else(|error| panic!("{what}: again from state {from}: {error:#}"));
        self.check_end(left, what);
    }
}

/// How far a [`Subject`] came.
#[derive(Debug)]
pub struct Reached {
    /// The states that it may have left.
    pub states: Vec<usize>,
    /// Whether it made nothing durable, so that a crash may bring back what the run before left.
    pub is_early: bool,
    /// The error that ended it.
    pub end: Result<()>,
}

/// What is found of a disk after a fault.
#[derive(Clone, Copy, Debug)]
pub enum Left {
    /// The same disk without the fault.
    Mended,
    /// The process was killed: nothing is lost yet, and nothing more is on the medium.
    Killed,
    /// The power went: nothing is there but what was synced.
    Dropped,
    /// The power went when everything was on the medium.
    Kept,
    /// The power went: some names and blocks are there, as a seed says.
    Shuffled(u64),
}

/// What a power cut may leave.
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

/// Faults of these kinds at one in so many of the moments of an undisturbed run, whose end is checked.
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

/// Runs the subject with each fault, and checks what is left in each of these ways.
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

/// Kills the process at one in so many changes. The next one goes on, and the power goes at its changes of the numbers
/// that `later` makes of the first.
pub fn sweep_after_kills(subject: &impl Subject, one_in: u64, later: impl Fn(u64) -> Vec<u64>) {
    for fault in faults(subject, &[Fault::Crashes], one_in) {
        let Fault::Crashes(at) = fault else { unreachable!("asked for crashes") };
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
