use super::commit_log::Commits;
use super::disk::Disk;
use super::layout::Layout;
use super::snapshot_file::Snapshot;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;

/// Tables that were kept when they were replaced: for each tile, the flushes that they were the last version of.
pub(super) type KeptTables = FxHashMap<TileIndex, BTreeSet<u64>>;

/// Which tables a map's snapshots see, so that its writer keeps them.
///
/// A snapshot of flush `n` sees of each of its tiles the table that was kept as of the first flush not before `n`, and if
/// none was, the one in place: it is readers' rule, and needs nothing but names.
#[derive(Debug, Default)]
pub(super) struct Snapshots {
    /// Tiles of which a snapshot sees the table in place.
    shared: FxHashSet<TileIndex>,
    /// Kept tables that a snapshot sees.
    pinned: KeptTables,
    /// Whether there is a snapshot that cannot be read: it may see anything.
    see_all: bool,
}

impl Snapshots {
    /// Looks which of the kept tables the snapshots of a map see. One snapshot is in memory at a time.
    ///
    /// # Errors
    ///
    /// A disk that refuses. A damaged snapshot counts as one that sees everything.
    pub(super) fn look(
        disk: &dyn Disk,
        layout: &Layout,
        map_id: [u8; 16],
        kept: &KeptTables,
    ) -> Result<Self> {
        let mut snapshots = Self::default();
        let names = match Snapshot::list(disk, layout) {
            Err(error @ Error::Damaged { .. }) => {
                snapshots.cannot_read(&error, kept);
                return Ok(snapshots);
            }
            names => names?,
        };
        for name in names {
            match Snapshot::read(disk, layout, &name, map_id) {
                Ok(snapshot) => snapshots.take(&snapshot.commits, kept),
                Err(error @ Error::Damaged { .. }) => snapshots.cannot_read(&error, kept),
                Err(error) => return Err(error),
            }
        }
        Ok(snapshots)
    }

    fn cannot_read(&mut self, error: &Error, kept: &KeptTables) {
        log::warn!("{error}; until then every table is kept");
        self.see_all = true;
        self.pinned = kept.clone();
    }

    fn take(&mut self, commits: &Commits, kept: &KeptTables) {
        for &tile in commits.tiles.keys() {
            match seen_by(kept.get(&tile), commits.flush_number) {
                Some(flush_number) => self.pin(tile, flush_number),
                None => drop(self.shared.insert(tile)),
            }
        }
    }

    /// Notes that there is a snapshot of the map as it is.
    pub(super) fn share(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        self.shared.extend(tiles);
    }

    /// Whether a snapshot sees the table in place.
    pub(super) fn sees_present(&self, tile: TileIndex) -> bool {
        self.see_all || self.shared.contains(&tile)
    }

    /// Whether a snapshot sees the table that was kept as of a flush.
    pub(super) fn sees_kept(&self, tile: TileIndex, flush_number: u64) -> bool {
        self.pinned.get(&tile).is_some_and(|flushes| flushes.contains(&flush_number))
    }

    /// Notes that the table in place was kept as of a flush for the snapshots that see it.
    pub(super) fn pin(&mut self, tile: TileIndex, flush_number: u64) {
        self.pinned.entry(tile).or_default().insert(flush_number);
    }

    /// Notes that what was kept of the table in place is durable: what takes its place is seen by no snapshot yet.
    pub(super) fn has_replaced(&mut self, tile: TileIndex) {
        self.shared.remove(&tile);
    }

    /// Every kept table that a snapshot sees.
    pub(super) fn pinned(&self) -> &KeptTables {
        &self.pinned
    }

    /// Bytes of memory, about.
    pub(super) fn bytes(&self) -> usize {
        // A set of few numbers takes a leaf of its tree.
        const FLUSHES_BYTES: usize = 120;
        let slot = size_of::<TileIndex>() + 1;
        self.shared.capacity() * 8 / 7 * slot
            + self.pinned.capacity() * 8 / 7 * (slot + size_of::<BTreeSet<u64>>())
            + self.pinned.len() * FLUSHES_BYTES
    }
}

/// Which of a tile's kept tables a snapshot of a flush sees; `None` if the one in place.
pub(super) fn seen_by(kept: Option<&BTreeSet<u64>>, flush_number: u64) -> Option<u64> {
    kept?.range(flush_number..).next().copied()
}
