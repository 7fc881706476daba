use voxtile::{Aabb, SnapshotName};

/// What the mapping thread is asked to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Make durable what is mapped.
    Save,
    /// Forget all voxels.
    Reset,
    /// Forget the voxels of a box.
    Clear(Aabb),
    /// Keep the map as it is under a name.
    Snapshot(SnapshotName),
    /// Make the map what it was.
    Revert(SnapshotName),
}
