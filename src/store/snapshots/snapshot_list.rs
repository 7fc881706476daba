use super::snapshot_name::SnapshotName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names of a map's snapshots, as recorded in its log. Other files in the folder of snapshots are ignored. A listed
/// snapshot without a file is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SnapshotList(BTreeMap<SnapshotName, Option<u64>>);

/// Maximum number of snapshots of a map. The list is part of `metadata.json`, which is read into memory as a whole.
pub(in crate::store) const MAX_SNAPSHOTS: usize = 4096;

impl SnapshotList {
    pub(in crate::store) fn of(name: SnapshotName, flush_number: u64) -> Self {
        Self(BTreeMap::from([(name, Some(flush_number))]))
    }

    /// Adds a snapshot with its flush, if known.
    pub fn insert(&mut self, name: SnapshotName, flush_number: Option<u64>) {
        self.0.insert(name, flush_number);
    }

    /// Removes a name. Returns whether it was listed.
    pub(in crate::store) fn remove(&mut self, name: &SnapshotName) -> bool {
        self.0.remove(name).is_some()
    }

    /// Returns whether the map has a snapshot of this name.
    pub fn contains(&self, name: &SnapshotName) -> bool {
        self.0.contains_key(name)
    }

    /// Flush of a snapshot, if known.
    pub fn flush_of(&self, name: &SnapshotName) -> Option<u64> {
        self.0.get(name).copied().flatten()
    }

    /// Names in order.
    pub fn names(&self) -> impl Iterator<Item = &SnapshotName> {
        self.0.keys()
    }

    /// Number of snapshots.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(in crate::store) fn flushes(&self) -> impl Iterator<Item = u64> {
        self.0.values().copied().flatten()
    }
}
