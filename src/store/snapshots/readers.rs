use super::seen_tables::{KeptFlushes, SeenTables, kept_flushes_bytes};
use crate::space::{TileIndex, hash_table_bytes};
use crate::store::disk::{Disk, ReaderWatch};
use crate::store::layout::Layout;
use rustc_hash::FxHashMap;
use std::io;

/// Readers of a map, and the replaced tables kept for them: for each tile, one version per flush that a reader uses.
///
/// A reader keeps the `metadata.json` open that it found when it opened the map. Every flush replaces this file, and
/// the writer watches all versions, so the writer knows which flushes are in use.
#[derive(Default)]
pub(in crate::store) struct Readers {
    /// Versions of `metadata.json` from past flushes and the current one, in order.
    watched: Vec<Watched>,
    /// Tables that are kept only for readers.
    kept: KeptFlushes,
    /// Tiles added while an earlier flush was read, with the flush that added them.
    added: FxHashMap<TileIndex, u64>,
}

/// A version of `metadata.json`, and the range of flushes that its readers may use: its own, and later ones if the file
/// was older than the log.
struct Watched {
    first: u64,
    last: u64,
    watch: Box<dyn ReaderWatch>,
}

impl Readers {
    /// Watches for readers of the current `metadata.json`, which a flush has written.
    pub(in crate::store) fn watch(&mut self, flush_number: u64, metadata: Box<dyn ReaderWatch>) {
        self.watched.push(Watched { first: flush_number, last: flush_number, watch: metadata });
    }

    /// Records that the current `metadata.json` could not be replaced after a flush, so that its readers may use that
    /// flush.
    pub(in crate::store) fn may_see(&mut self, flush_number: u64) {
        if let Some(present) = self.watched.last_mut() {
            present.last = present.last.max(flush_number);
        }
    }

    /// Records that a flush adds a tile, which readers of earlier flushes do not use.
    pub(in crate::store) fn note_added(&mut self, tile: TileIndex, flush_number: u64) {
        self.added.insert(tile, flush_number);
    }

    pub(in crate::store) fn are_there(&self) -> bool {
        self.watched.iter().any(|watched| watched.watch.has_readers())
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        kept_flushes_bytes(&self.kept) + hash_table_bytes::<(TileIndex, u64)>(self.added.capacity())
    }

    /// Removes the entries of flushes without readers.
    pub(in crate::store) fn look(&mut self) {
        let present = self.watched.last().map(|present| present.first);
        self.watched.retain(|watched| Some(watched.first) == present || watched.watch.has_readers());
        let oldest = self.watched.first().map_or(u64::MAX, |watched| watched.first);
        self.added.retain(|_, flush_number| *flush_number > oldest);
    }

    /// Returns whether a reader uses the current table, which was the last version as of this flush.
    pub(in crate::store) fn see(&self, tile: TileIndex, flush_number: u64, snapshots: &SeenTables) -> bool {
        let flushes = [self.kept.get(&tile), snapshots.pinned().get(&tile)];
        let before = flushes.into_iter().flatten().filter_map(|kept| kept.range(..flush_number).next_back());
        // Readers of earlier flushes use an earlier kept table. Readers from before the tile was added use none.
        let lowest = before.max().map_or(0, |&kept| kept + 1);
        let added = self.added.get(&tile).copied().filter(|&added| added <= flush_number);
        let lowest = lowest.max(added.unwrap_or(0));
        self.watched.iter().any(|watched| {
            watched.first.max(lowest) <= watched.last.min(flush_number) && watched.watch.has_readers()
        })
    }

    /// Records that a table was kept as of a flush.
    pub(in crate::store) fn keep(&mut self, tile: TileIndex, flush_number: u64) {
        self.kept.entry(tile).or_default().insert(flush_number);
    }

    /// Removes the tables that no reader uses any more.
    pub(in crate::store) fn release(&mut self, disk: &dyn Disk, layout: &Layout, snapshots: &SeenTables) {
        self.look();
        let mut unseen = Vec::new();
        for (&tile, flushes) in &self.kept {
            let is_unseen = |&&flush_number: &&u64| !self.see(tile, flush_number, snapshots);
            unseen.extend(flushes.iter().filter(is_unseen).map(|&flush_number| (tile, flush_number)));
        }
        for (tile, flush_number) in unseen {
            if let Some(flushes) = self.kept.get_mut(&tile) {
                flushes.remove(&flush_number);
            }
            if snapshots.sees_kept(tile, flush_number) {
                continue;
            }
            let path = layout.kept(tile, flush_number);
            match disk.remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    log::warn!("{}: cannot remove: {error}", path.display());
                }
                _ => {}
            }
        }
        self.kept.retain(|_, flushes| !flushes.is_empty());
    }
}

impl std::fmt::Debug for Readers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let watched: Vec<_> = self.watched.iter().map(|watched| watched.first).collect();
        f.debug_struct("Readers").field("watched", &watched).field("kept", &self.kept).finish()
    }
}
