use voxtile::{Aabb, SnapshotName};

/// Request to the mapping thread.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Flush the map.
    Save,
    /// Set all voxels to unknown.
    Reset,
    /// Set the voxels of a box to unknown.
    Clear(Aabb),
    /// Keep the current map as a snapshot.
    Snapshot(SnapshotName),
    /// Revert the map to a snapshot.
    Revert(SnapshotName),
}
