use super::seen_tables::{KeptFlushes, SeenTables, kept_flushes_bytes};
use crate::space::{TileIndex, hash_table_bytes};
use crate::store::disk::{Disk, ReaderWatch};
use crate::store::layout::Layout;
use rustc_hash::FxHashMap;
use std::io;

/// The readers of a map, and the replaced tables kept for them: for each tile, one version per flush that is being
/// read.
///
/// A reader holds `metadata.json` open as it was when it opened the map. Every flush puts another file in its place,
/// so the writer, which watches over all of these files, knows which flushes are being read.
#[derive(Default)]
pub(in crate::store) struct Readers {
    /// The `metadata.json` of past flushes and of the present one, in order.
    watched: Vec<Watched>,
    /// Tables that were kept for readers alone.
    kept: KeptFlushes,
    /// Tiles that were added while an earlier flush was being read, with the flush that added them.
    added: FxHashMap<TileIndex, u64>,
}

/// A `metadata.json`, and the flushes that those who hold it may see: its own, and where it fell behind the log, later
/// ones.
struct Watched {
    first: u64,
    last: u64,
    watch: Box<dyn ReaderWatch>,
}

impl Readers {
    /// Watches over the present `metadata.json`, which a flush has written.
    pub(in crate::store) fn watch(&mut self, flush_number: u64, metadata: Box<dyn ReaderWatch>) {
        self.watched.push(Watched { first: flush_number, last: flush_number, watch: metadata });
    }

    /// Notes that the present `metadata.json` could not be replaced after a flush, so that who holds it may see that
    /// one.
    pub(in crate::store) fn may_see(&mut self, flush_number: u64) {
        if let Some(present) = self.watched.last_mut() {
            present.last = present.last.max(flush_number);
        }
    }

    /// Records that a flush adds a tile: a reader of an earlier flush does not see it.
    pub(in crate::store) fn note_added(&mut self, tile: TileIndex, flush_number: u64) {
        self.added.insert(tile, flush_number);
    }

    /// Whether anybody reads the map.
    pub(in crate::store) fn are_there(&self) -> bool {
        self.watched.iter().any(|watched| watched.watch.has_readers())
    }

    /// Bytes of memory, about.
    pub(in crate::store) fn bytes(&self) -> usize {
        kept_flushes_bytes(&self.kept) + hash_table_bytes::<(TileIndex, u64)>(self.added.capacity())
    }

    /// Looks who is still there.
    pub(in crate::store) fn look(&mut self) {
        let present = self.watched.last().map(|present| present.first);
        self.watched.retain(|watched| Some(watched.first) == present || watched.watch.has_readers());
        let oldest = self.watched.first().map_or(u64::MAX, |watched| watched.first);
        self.added.retain(|_, flush_number| *flush_number > oldest);
    }

    /// Whether a reader sees the table in place, which was the last version as of this flush.
    pub(in crate::store) fn see(&self, tile: TileIndex, flush_number: u64, snapshots: &SeenTables) -> bool {
        let flushes = [self.kept.get(&tile), snapshots.pinned().get(&tile)];
        let before = flushes.into_iter().flatten().filter_map(|kept| kept.range(..flush_number).next_back());
        // Who reads a flush up to that one sees an earlier table; so does who reads one from before the tile was there.
        let lowest = before.max().map_or(0, |&kept| kept + 1);
        let added = self.added.get(&tile).copied().filter(|&added| added <= flush_number);
        let lowest = lowest.max(added.unwrap_or(0));
        self.watched.iter().any(|watched| {
            watched.first.max(lowest) <= watched.last.min(flush_number) && watched.watch.has_readers()
        })
    }

    /// Notes that a table as of a flush was kept.
    pub(in crate::store) fn keep(&mut self, tile: TileIndex, flush_number: u64) {
        self.kept.entry(tile).or_default().insert(flush_number);
    }

    /// Removes the tables that no reader sees any more.
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
