/// A fault, and the number of the operation at which it occurs, counted from 0. All but `Fails`, `Breaks` and
/// `RefusesRename` count only operations that change the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// The operation fails; a write has written half of its bytes.
    Fails(u64),
    /// The operation fails, and every later operation on the same file or folder, until [`super::FaultyDisk::mend`]:
    /// like a disk with bad sectors.
    Breaks(u64),
    /// A rename (counted from 0 among renames) fails, and every later rename to the same name, until
    /// [`super::FaultyDisk::mend`] or [`super::FaultyDisk::make_room`].
    RefusesRename(u64),
    /// The change fails. If it is a sync, the file on the medium keeps its old content, and later syncs of the same
    /// bytes report success, as on Linux.
    LosesSync(u64),
    /// Same as `LosesSync`, and the process is killed at once: every later operation fails.
    LosesSyncAndDies(u64),
    /// From this change on, the disk has no space for new data, until [`super::FaultyDisk::make_room`].
    IsFull(u64),
    /// From this change on, the disk is read-only, until [`super::FaultyDisk::make_room`].
    IsReadOnly(u64),
    /// The power fails at this change; every later operation fails.
    Crashes(u64),
}

/// Unsynced data that is on the medium after a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsynced {
    /// None.
    Dropped,
    /// All, as after a kill.
    Kept,
    /// Some names and some blocks, in any order; the value is a seed.
    Shuffled(u64),
}
