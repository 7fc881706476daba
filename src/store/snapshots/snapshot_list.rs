use super::snapshot_name::SnapshotName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which snapshots a map has, by name, as its log says: a file of the folder of snapshots is none unless it is named
/// here, and one that is named and has no file is missing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SnapshotList(BTreeMap<SnapshotName, Option<u64>>);

/// Most snapshots of a map: the list is part of `metadata.json`, which is read whole.
pub(in crate::store) const MAX_SNAPSHOTS: usize = 4096;

impl SnapshotList {
    /// A list of one.
    pub(in crate::store) fn of(name: SnapshotName, flush_number: u64) -> Self {
        Self(BTreeMap::from([(name, Some(flush_number))]))
    }

    /// Names a snapshot, and the flush that it is of if that is known.
    pub fn insert(&mut self, name: SnapshotName, flush_number: Option<u64>) {
        self.0.insert(name, flush_number);
    }

    /// Takes a name off the list; whether it was there.
    pub(in crate::store) fn remove(&mut self, name: &SnapshotName) -> bool {
        self.0.remove(name).is_some()
    }

    /// Whether the map has a snapshot of this name.
    pub fn contains(&self, name: &SnapshotName) -> bool {
        self.0.contains_key(name)
    }

    /// The flush that a snapshot is of, if that is known.
    pub fn flush_of(&self, name: &SnapshotName) -> Option<u64> {
        self.0.get(name).copied().flatten()
    }

    /// The names, in order.
    pub fn names(&self) -> impl Iterator<Item = &SnapshotName> {
        self.0.keys()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Every flush that is named.
    pub(in crate::store) fn flushes(&self) -> impl Iterator<Item = u64> {
        self.0.values().copied().flatten()
    }
}
