use super::snapshot_file::Snapshot;
use super::snapshot_list::SnapshotList;
use super::snapshot_name::SnapshotName;
use crate::error::{Error, Result};
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::commit::commits::Commits;
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::scans::{KeptAsOf, kept_as_of};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, BTreeSet};

/// For each tile, the flushes as of which its replaced tables were kept.
pub(in crate::store) type KeptFlushes = FxHashMap<TileIndex, BTreeSet<u64>>;

/// Tables that a map's snapshots use, so that its writer keeps them.
///
/// A snapshot of flush `n` uses, for each of its tiles, the table that was kept as of the first flush not before `n`.
/// If there is none, it uses the current table. Readers follow the same rule. The rule needs only file names.
#[derive(Debug, Default)]
pub(in crate::store) struct SeenTables {
    /// Tiles whose current table a snapshot uses.
    shared: TileTable<()>,
    /// Kept tables that a snapshot uses.
    pinned: KeptFlushes,
    /// Whether a snapshot is unreadable and its flush is unknown: it may use any table.
    see_all: bool,
    /// Snapshots that were found.
    found: SnapshotList,
    /// Kept scans of each snapshot that was read, if it has any.
    kept_scans: BTreeMap<SnapshotName, Option<KeptAsOf>>,
}

impl SeenTables {
    /// Finds the snapshots of a map and the kept tables that they use. One snapshot is in memory at a time.
    ///
    /// A missing or unreadable snapshot is not an error. It is assumed to use every tile as of its flush, or every
    /// table if its flush is unknown.
    ///
    /// # Errors
    ///
    /// An I/O error that is not specific to one file.
    pub(in crate::store) fn read_all(
        disk: &dyn Disk,
        layout: &Layout,
        map_id: [u8; 16],
        map: &Commits,
        listed: Option<&SnapshotList>,
        kept: &KeptFlushes,
    ) -> Result<Self> {
        let mut snapshots = Self::default();
        let names: Vec<_> = match (listed, Snapshot::list(disk, layout)) {
            (Some(listed), _) => listed.names().cloned().collect(),
            (None, Ok(names)) => names,
            (None, Err(error)) => {
                snapshots.cannot_read(error, None, map, kept)?;
                return Ok(snapshots);
            }
        };
        for name in names {
            let flush_number = match Snapshot::read(disk, layout, &name, map_id, listed) {
                Ok(snapshot) => {
                    snapshots.take(&snapshot, kept);
                    Some(snapshot.commits.flush_number)
                }
                Err(error) => {
                    let flush_number = listed.and_then(|listed| listed.flush_of(&name));
                    snapshots.cannot_read(error, flush_number, map, kept)?;
                    flush_number
                }
            };
            snapshots.found.insert(name, flush_number);
        }
        Ok(snapshots)
    }

    fn cannot_read(
        &mut self,
        error: Error,
        flush_number: Option<u64>,
        map: &Commits,
        kept: &KeptFlushes,
    ) -> Result<()> {
        if !matches!(error, Error::Damaged { .. }) && !error.is_of_medium() {
            return Err(error);
        }
        match flush_number {
            Some(flush_number) => {
                log::warn!(
                    "{error:#}; every table of flush {flush_number} is kept until the snapshot is repaired or deleted"
                );
                let tiles: FxHashSet<_> = map.tiles.tiles().chain(kept.keys().copied()).collect();
                self.take_tiles(tiles.into_iter(), flush_number, kept);
            }
            None => {
                log::warn!("{error:#}; every table is kept until the snapshot is repaired or deleted");
                self.see_all = true;
                for (&tile, flushes) in kept {
                    self.pinned.entry(tile).or_default().extend(flushes);
                }
            }
        }
        Ok(())
    }

    pub(in crate::store) fn found(&self) -> &SnapshotList {
        &self.found
    }

    fn take(&mut self, snapshot: &Snapshot, kept: &KeptFlushes) {
        self.take_tiles(snapshot.commits.tiles.tiles(), snapshot.commits.flush_number, kept);
        self.kept_scans.insert(snapshot.name.clone(), kept_as_of(snapshot));
    }

    /// Returns the kept scans that the snapshots of this list need; `None` if those of one snapshot are unknown.
    pub(in crate::store) fn kept_scans_of(&self, listed: Option<&SnapshotList>) -> Option<Vec<KeptAsOf>> {
        let names = listed.into_iter().flat_map(SnapshotList::names);
        let needed = names.map(|name| self.kept_scans.get(name).copied());
        needed.collect::<Option<Vec<_>>>().map(|needed| needed.into_iter().flatten().collect())
    }

    fn take_tiles(&mut self, tiles: impl Iterator<Item = TileIndex>, as_of_flush: u64, kept: &KeptFlushes) {
        for tile in tiles {
            match seen_by(kept.get(&tile), as_of_flush) {
                Some(flush_number) => self.pin(tile, flush_number),
                None => self.shared.insert(tile, ()),
            }
        }
    }

    /// Records a snapshot of the current map.
    pub(in crate::store) fn share(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        self.shared.extend(tiles.map(|tile| (tile, ())));
    }

    /// Returns whether a snapshot uses the current table.
    pub(in crate::store) fn sees_present(&self, tile: TileIndex) -> bool {
        self.see_all || self.shared.contains(tile)
    }

    /// Returns whether a snapshot uses the table that was kept as of a flush.
    pub(in crate::store) fn sees_kept(&self, tile: TileIndex, flush_number: u64) -> bool {
        self.pinned.get(&tile).is_some_and(|flushes| flushes.contains(&flush_number))
    }

    /// Records that the current table was kept as of a flush, for the snapshots that use it.
    pub(in crate::store) fn pin(&mut self, tile: TileIndex, flush_number: u64) {
        self.pinned.entry(tile).or_default().insert(flush_number);
    }

    /// Records that a kept table is durable. No snapshot uses the table that replaces it yet.
    pub(in crate::store) fn unshare(&mut self, tile: TileIndex) {
        self.shared.remove(tile);
    }

    pub(in crate::store) fn pinned(&self) -> &KeptFlushes {
        &self.pinned
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        self.shared.bytes() + kept_flushes_bytes(&self.pinned)
    }
}

/// Approximate memory of a list of kept tables in bytes.
pub(in crate::store) fn kept_flushes_bytes(kept: &KeptFlushes) -> usize {
    // A small set takes one leaf of its tree.
    const FLUSHES_BYTES: usize = 120;
    hash_table_bytes::<(TileIndex, BTreeSet<u64>)>(kept.capacity()) + kept.len() * FLUSHES_BYTES
}

/// Returns which of a tile's kept tables a snapshot of a flush uses; `None` if it uses the current table.
pub(in crate::store) fn seen_by(kept: Option<&BTreeSet<u64>>, flush_number: u64) -> Option<u64> {
    kept?.range(flush_number..).next().copied()
}
