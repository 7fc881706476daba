use super::tile_state::{Base, TileState};
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::TileVersion;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// Who looks at the map as it was, and what they see of it that has changed since.
///
/// The map does not wait for them: before a tile changes, its state is kept if somebody may still ask for it. A
/// resident tile is kept by another reference to it, so that changing it makes a copy (copy on write).
#[derive(Debug, Default)]
pub(super) struct Views {
    /// How often the content has changed.
    now: u64,
    /// How many views were opened at each time.
    open: BTreeMap<u64, usize>,
    /// What tiles were until a time, in order.
    past: FxHashMap<TileIndex, Vec<(u64, TileState)>>,
    /// Bytes of memory of these.
    past_bytes: usize,
    /// Views opened before have expired.
    kept_since: u64,
    /// Views opened before last: nobody waits for them any more.
    lasting_before: u64,
    /// Which version of each tile is on disk, from the first reader on: the store belongs to the mapper.
    disk: Option<DiskIndex>,
}

#[derive(Debug)]
struct DiskIndex {
    versions: TileTable<TileVersion>,
    orphans: FxHashSet<TileIndex>,
    /// Bytes of memory that readers may take for tiles that they make.
    reader_bytes: usize,
}

/// When a view was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mapper) struct ViewId(u64);

impl Views {
    /// Whether there are any.
    pub(super) fn are_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Whether there are any that may be closed soon.
    pub(super) fn may_close_soon(&self) -> bool {
        self.open.last_key_value().is_some_and(|(newest, _)| *newest >= self.lasting_before)
    }

    /// Notes that those which are open will last.
    pub(super) fn expect_no_close(&mut self) {
        self.lasting_before = self.now + 1;
    }

    pub(super) fn open(&mut self) -> ViewId {
        *self.open.entry(self.now).or_default() += 1;
        ViewId(self.now)
    }

    /// Closes a view; returns what nobody can ask for any more.
    pub(super) fn close(&mut self, ViewId(view): ViewId) -> Vec<TileState> {
        let Some(count) = self.open.get_mut(&view) else { return Vec::new() };
        *count -= 1;
        if *count > 0 {
            return Vec::new();
        }
        self.open.remove(&view);
        self.release()
    }

    /// Lets go of what no view can ask for any more.
    fn release(&mut self) -> Vec<TileState> {
        let Some((&oldest, _)) = self.open.first_key_value() else { return self.forget() };
        let mut released = Vec::new();
        self.past.retain(|_, states| {
            let kept = states.partition_point(|(until, _)| *until < oldest);
            released.extend(states.drain(..kept).map(|(_, state)| state));
            !states.is_empty()
        });
        // A pointer tree that another thread writes may have grown since it was counted.
        let bytes = released.iter().map(TileState::bytes).sum();
        self.past_bytes = self.past_bytes.saturating_sub(bytes);
        released
    }

    fn forget(&mut self) -> Vec<TileState> {
        self.past_bytes = 0;
        std::mem::take(&mut self.past).into_values().flatten().map(|(_, state)| state).collect()
    }

    /// Whether somebody may ask for a tile as it is now, once it has changed.
    pub(super) fn need(&self, tile: TileIndex) -> bool {
        let newest = self.open.last_key_value().map(|(view, _)| *view);
        let kept = self.past.get(&tile).and_then(|states| states.last()).map(|(until, _)| *until);
        newest.is_some_and(|newest| newest >= self.kept_since && kept.is_none_or(|until| until < newest))
    }

    /// Keeps a tile as it is now.
    pub(super) fn keep(&mut self, tile: TileIndex, state: TileState) {
        self.past_bytes += state.bytes();
        self.past.entry(tile).or_default().push((self.now, state));
    }

    /// Lets go of all that is kept: whoever looks has to look anew.
    pub(super) fn expire(&mut self) {
        log::debug!("views of the map expired: what they held took too much memory");
        self.kept_since = self.now + 1;
        drop(self.forget());
    }

    /// Notes that what the tiles hold is about to change.
    pub(super) fn content_changes(&mut self) {
        self.now += 1;
    }

    pub(super) fn is_expired(&self, ViewId(view): ViewId) -> bool {
        view < self.kept_since
    }

    /// A tile as a view sees it, if it has changed since.
    pub(super) fn past(&self, ViewId(view): ViewId, tile: TileIndex) -> Option<&TileState> {
        let states = self.past.get(&tile)?;
        states.get(states.partition_point(|(until, _)| *until < view)).map(|(_, state)| state)
    }

    /// Bytes of memory of what is kept.
    pub(super) fn past_bytes(&self) -> usize {
        self.past_bytes
    }

    /// Bytes of memory, with those that readers may take.
    pub(super) fn bytes(&self) -> usize {
        let disk = self.disk.as_ref().map_or(0, |disk| disk.versions.bytes() + disk.reader_bytes);
        self.past_bytes + hash_table_bytes::<(TileIndex, Vec<(u64, TileState)>)>(self.past.capacity()) + disk
    }

    // What is on disk.

    /// Begins to note what is on disk, and to count the memory of readers.
    pub(super) fn watch_disk(
        &mut self,
        reader_bytes: usize,
        versions: impl Iterator<Item = (TileIndex, TileVersion)>,
        orphans: impl Iterator<Item = TileIndex>,
    ) {
        let (versions, orphans) = (versions.collect(), orphans.collect());
        self.disk = Some(DiskIndex { versions, orphans, reader_bytes });
    }

    /// Notes that a version of a tile was written.
    pub(super) fn note_on_disk(&mut self, tile: TileIndex, version: TileVersion) {
        if let Some(disk) = &mut self.disk {
            disk.versions.insert(tile, version);
        }
    }

    /// What is on disk of a tile.
    pub(super) fn on_disk(&self, tile: TileIndex) -> Base {
        let Some(disk) = &self.disk else { return Base::Nothing };
        match disk.versions.get(tile) {
            Some(version) => Base::OnDisk(version),
            None if disk.orphans.contains(&tile) => Base::Orphan,
            None => Base::Nothing,
        }
    }

    /// The tiles on disk, in no particular order.
    pub(super) fn tiles_on_disk(&self) -> impl Iterator<Item = TileIndex> {
        let orphans = |disk: &DiskIndex| disk.orphans.iter().copied().collect::<Vec<_>>();
        self.disk.iter().flat_map(move |disk| disk.versions.tiles().chain(orphans(disk)))
    }
}
