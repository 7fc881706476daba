use super::tile_state::{Base, TileState};
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::TileVersion;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// Open views, and the old states of tiles that they see.
///
/// The map does not wait for views: before a tile changes, its state is kept if an open view may read it. A resident
/// tile is kept by another reference to it, so that the change copies it (copy on write).
#[derive(Debug, Default)]
pub(super) struct Views {
    /// Number of changes of the content; serves as time.
    now: u64,
    /// Number of views opened at each time.
    open: BTreeMap<u64, usize>,
    /// Old states of tiles, each with the last time at which it was valid, in order.
    past: FxHashMap<TileIndex, Vec<(u64, TileState)>>,
    past_bytes: usize,
    /// Views opened before this time have expired.
    kept_since: u64,
    /// Views opened before this time are long-lived: scans no longer wait for them.
    lasting_before: u64,
    /// Version of each tile on disk, tracked from the first reader on, because only the mapper may use the store.
    disk: Option<DiskIndex>,
}

#[derive(Debug)]
struct DiskIndex {
    versions: TileTable<TileVersion>,
    orphans: FxHashSet<TileIndex>,
    /// Bytes of memory that readers may use to cache tiles.
    reader_bytes: usize,
}

/// Identifies a view by the time when it was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mapper) struct ViewId(u64);

impl Views {
    pub(super) fn are_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Returns whether a view is open that may be closed soon.
    pub(super) fn may_close_soon(&self) -> bool {
        self.open.last_key_value().is_some_and(|(newest, _)| *newest >= self.lasting_before)
    }

    /// Marks the open views as long-lived.
    pub(super) fn expect_no_close(&mut self) {
        self.lasting_before = self.now + 1;
    }

    pub(super) fn open(&mut self) -> ViewId {
        *self.open.entry(self.now).or_default() += 1;
        ViewId(self.now)
    }

    /// Closes a view; returns the states that no view needs any more.
    pub(super) fn close(&mut self, ViewId(view): ViewId) -> Vec<TileState> {
        let Some(count) = self.open.get_mut(&view) else { return Vec::new() };
        *count -= 1;
        if *count > 0 {
            return Vec::new();
        }
        self.open.remove(&view);
        self.release()
    }

    /// Removes the states that no view needs any more.
    fn release(&mut self) -> Vec<TileState> {
        let Some((&oldest, _)) = self.open.first_key_value() else { return self.forget() };
        let mut released = Vec::new();
        self.past.retain(|_, states| {
            let kept = states.partition_point(|(until, _)| *until < oldest);
            released.extend(states.drain(..kept).map(|(_, state)| state));
            !states.is_empty()
        });
        // Saturates, because a pointer tree that another thread writes may have grown since it was counted.
        let bytes = released.iter().map(TileState::bytes).sum();
        self.past_bytes = self.past_bytes.saturating_sub(bytes);
        released
    }

    fn forget(&mut self) -> Vec<TileState> {
        self.past_bytes = 0;
        std::mem::take(&mut self.past).into_values().flatten().map(|(_, state)| state).collect()
    }

    /// Returns whether an open view may read the current state of a tile after it has changed.
    pub(super) fn need(&self, tile: TileIndex) -> bool {
        let newest = self.open.last_key_value().map(|(view, _)| *view);
        let kept = self.past.get(&tile).and_then(|states| states.last()).map(|(until, _)| *until);
        newest.is_some_and(|newest| newest >= self.kept_since && kept.is_none_or(|until| until < newest))
    }

    /// Keeps the current state of a tile.
    pub(super) fn keep(&mut self, tile: TileIndex, state: TileState) {
        self.past_bytes += state.bytes();
        self.past.entry(tile).or_default().push((self.now, state));
    }

    /// Drops all kept states and so expires the open views.
    pub(super) fn expire(&mut self) {
        log::debug!("views of the map expired: their old tiles exceeded the memory limit");
        self.kept_since = self.now + 1;
        drop(self.forget());
    }

    /// Records that the content of tiles is about to change.
    pub(super) fn content_changes(&mut self) {
        self.now += 1;
    }

    pub(super) fn is_expired(&self, ViewId(view): ViewId) -> bool {
        view < self.kept_since
    }

    /// Returns the old state of a tile that a view sees, if the tile has changed since.
    pub(super) fn past(&self, ViewId(view): ViewId, tile: TileIndex) -> Option<&TileState> {
        let states = self.past.get(&tile)?;
        states.get(states.partition_point(|(until, _)| *until < view)).map(|(_, state)| state)
    }

    /// Bytes of memory of the kept states.
    pub(super) fn past_bytes(&self) -> usize {
        self.past_bytes
    }

    /// Bytes of memory, including those that readers may use.
    pub(super) fn bytes(&self) -> usize {
        let disk = self.disk.as_ref().map_or(0, |disk| disk.versions.bytes() + disk.reader_bytes);
        self.past_bytes + hash_table_bytes::<(TileIndex, Vec<(u64, TileState)>)>(self.past.capacity()) + disk
    }

    // Tiles on disk.

    /// Begins to track the tiles on disk, and to count the memory of readers.
    pub(super) fn watch_disk(
        &mut self,
        reader_bytes: usize,
        versions: impl Iterator<Item = (TileIndex, TileVersion)>,
        orphans: impl Iterator<Item = TileIndex>,
    ) {
        let (versions, orphans) = (versions.collect(), orphans.collect());
        self.disk = Some(DiskIndex { versions, orphans, reader_bytes });
    }

    pub(super) fn note_on_disk(&mut self, tile: TileIndex, version: TileVersion) {
        if let Some(disk) = &mut self.disk {
            disk.versions.insert(tile, version);
        }
    }

    /// Returns the version of a tile on disk.
    pub(super) fn on_disk(&self, tile: TileIndex) -> Base {
        let Some(disk) = &self.disk else { return Base::Nothing };
        match disk.versions.get(tile) {
            Some(version) => Base::OnDisk(version),
            None if disk.orphans.contains(&tile) => Base::Orphan,
            None => Base::Nothing,
        }
    }

    pub(super) fn tiles_on_disk(&self) -> impl Iterator<Item = TileIndex> {
        let orphans = |disk: &DiskIndex| disk.orphans.iter().copied().collect::<Vec<_>>();
        self.disk.iter().flat_map(move |disk| disk.versions.tiles().chain(orphans(disk)))
    }
}
