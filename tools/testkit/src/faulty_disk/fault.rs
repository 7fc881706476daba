/// What goes wrong, and at which operation, counted from 0. All but `Fails` count only operations that change
/// something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// The operation fails; a write has written half.
    Fails(u64),
    /// The operation fails, and from then on every operation on the same file or folder, until
    /// [`super::FaultyDisk::mend`]: what a disk does with sectors that it cannot read or write.
    Breaks(u64),
    /// The rename of this number, counted from 0 among renames, fails, and from then on every rename to the same name,
    /// until [`super::FaultyDisk::mend`] or [`super::FaultyDisk::make_room`].
    RefusesRename(u64),
    /// The change fails; and a sync that fails leaves the file as it was on the medium, while later syncs of the same
    /// bytes report success, as Linux does.
    LosesSync(u64),
    /// The same, and the process is killed before it can do anything about it: every later operation fails.
    LosesSyncAndDies(u64),
    /// From this change on there is no room for anything new, until [`super::FaultyDisk::make_room`].
    IsFull(u64),
    /// From this change on only reading works, until [`super::FaultyDisk::make_room`].
    IsReadOnly(u64),
    /// The power goes at this change; every later operation fails.
    Crashes(u64),
}

/// What is on the medium after a crash, beside what was synced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsynced {
    /// Nothing.
    Dropped,
    /// Everything, as after a kill.
    Kept,
    /// Some names and some blocks, whatever their order was.
    Shuffled(u64),
}
