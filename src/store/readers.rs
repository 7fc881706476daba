use super::disk::{Disk, ReaderWatch};
use super::layout::Layout;
use crate::space::TileIndex;
use std::collections::BTreeMap;
use std::io;

/// The readers of a map beside its writer, and the tables that are kept for them.
///
/// A reader holds `metadata.json` open as it was when it opened the map. Every flush puts another file in its place,
/// so the writer, which watches over all of these files, knows from which flush on tables are still wanted.
#[derive(Default)]
pub(super) struct Readers {
    /// The `metadata.json` of past flushes and of the present one, with their flush numbers, in order.
    watched: Vec<(u64, Box<dyn ReaderWatch>)>,
    /// By flush: the tiles of which a table as of that flush is kept.
    kept: BTreeMap<u64, Vec<TileIndex>>,
}

impl Readers {
    /// Watches over the present `metadata.json`, which a flush has written.
    pub(super) fn watch(&mut self, flush_number: u64, metadata: Box<dyn ReaderWatch>) {
        self.watched.push((flush_number, metadata));
    }

    /// Whether a table that a flush replaces may be wanted by somebody.
    pub(super) fn are_there(&self) -> bool {
        self.watched.iter().any(|(_, watch)| watch.has_readers())
    }

    /// Notes that a table as of a flush was kept.
    pub(super) fn keep(&mut self, tile: TileIndex, flush_number: u64) {
        self.kept.entry(flush_number).or_default().push(tile);
    }

    /// Removes the tables that no reader wants any more.
    pub(super) fn release(&mut self, disk: &dyn Disk, layout: &Layout) {
        let present = self.watched.last().map(|&(flush_number, _)| flush_number);
        self.watched.retain(|(flush_number, watch)| Some(*flush_number) == present || watch.has_readers());
        // A reader of the metadata of flush n may see flush n or one after it.
        let oldest = self.watched.first().map_or(u64::MAX, |&(flush_number, _)| flush_number);
        while let Some(entry) = self.kept.first_entry()
            && *entry.key() < oldest
        {
            let (flush_number, tiles) = entry.remove_entry();
            for tile in tiles {
                let path = layout.kept(tile, flush_number);
                match disk.remove_file(&path) {
                    Err(error) if error.kind() != io::ErrorKind::NotFound => {
                        log::warn!("{}: cannot remove: {error}", path.display());
                    }
                    _ => {}
                }
            }
        }
    }
}

impl std::fmt::Debug for Readers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let watched: Vec<_> = self.watched.iter().map(|(flush_number, _)| flush_number).collect();
        f.debug_struct("Readers").field("watched", &watched).field("kept", &self.kept).finish()
    }
}
