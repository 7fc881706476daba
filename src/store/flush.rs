//! The writing half of [`TileStore`]: versions beside the committed ones, and the commit that puts them in place.

use super::commit_log::CommitLog;
use super::commit_record::{Flush, whole_map_bytes};
use super::disk::Disk;
use super::layout::{Layout, TileFile};
use super::map_folder::{self, Lock};
use super::metadata::{Bounds, Metadata};
use super::tile_stamp::{FileStamp, TileStamp};
use super::tile_store::TileStore;
use super::tile_writer::TileWriter;
use crate::error::{Error, Result};
use crate::space::{TileIndex, TileTable};
use rustc_hash::FxHashSet;
use std::io::{self, Write};
use std::path::Path;

/// Tiles whose files are synced at once: their paths take several times the memory of what else is known of them.
pub(super) const TILES_SYNCED_AT_ONCE: usize = 4096;

/// A log longer than this many bytes, and than twice what one record of the whole map takes, is compacted.
const COMPACT_LOG_BYTES: u64 = 2048;

impl TileStore {
    /// Writes the next version of one of a tile's files; the committed version stays as it is.
    pub fn write_next(
        &mut self,
        tile: TileIndex,
        file: TileFile,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<FileStamp> {
        self.writer()?.write_next(tile, file, write)
    }

    /// What writes next versions, for another thread too, until the next commit.
    ///
    /// # Errors
    ///
    /// A disk that refuses to finish what the last commit left to do.
    pub fn writer(&mut self) -> Result<TileWriter> {
        // A committed version may still be there under the name that is written to now.
        self.settle()?;
        let map_id = self.map_id().unwrap_or_default();
        Ok(TileWriter { disk: self.disk.clone(), layout: self.layout.clone(), map_id })
    }

    /// Notes that the next version of a tile is written, both files.
    pub fn note_next(&mut self, tile: TileIndex, stamp: TileStamp) {
        self.suspect.remove(&tile);
        self.removed.remove(&tile);
        self.next.insert(tile, stamp);
    }

    /// Takes a tile out of the map, at the next commit: its space is unknown again. From here on the store does not hold
    /// the tile, unless a next version of it is written later. What is not committed leaves the tile where it was.
    ///
    /// Memory that holds the tile is the caller's to clear.
    ///
    /// # Errors
    ///
    /// A map of the seed's format, which has no log that could name removed tiles.
    pub fn remove(&mut self, tile: TileIndex) -> Result<()> {
        if self.log.is_none() {
            return Err(Error::argument("map", "a map of the seed's format must be adopted first"));
        }
        self.drop_next(tile);
        if self.commits.tiles.contains(tile) {
            self.removed.insert(tile);
        }
        Ok(())
    }

    /// Forgets the next version of a tile, as if it had not been written.
    pub fn drop_next(&mut self, tile: TileIndex) {
        self.suspect.remove(&tile);
        self.next.remove(tile);
    }

    /// The tiles whose next version must be written again before the next commit: the disk failed to sync it, and what
    /// it says of these files from then on proves nothing.
    pub fn suspects(&self) -> Vec<TileIndex> {
        let mut suspects: Vec<_> = self.suspect.iter().copied().collect();
        suspects.sort_unstable();
        suspects
    }

    /// Commits every version written and every tile removed since the last commit. When this returns they are durable, and
    /// only they.
    ///
    /// `metadata` gives the map's parameters; bounds and numbers are filled in here. After an error nothing is
    /// committed, and calling again tries again. What comes after the commit only tidies up: if the disk refuses that,
    /// it is logged as a warning and made good later.
    pub fn commit(&mut self, metadata: Metadata, scan_number: u64) -> Result<()> {
        self.settle()?;
        self.keep_for_late_readers();
        let log_path = self.layout.commit_log();
        let Some(mut log) = self.log else {
            return Err(Error::argument("map", "a map of the seed's format must be adopted first"));
        };
        if let Some(&tile) = self.suspect.iter().next() {
            return Err(Error::io(
                &self.layout.tile_folder(tile),
                "trust",
                io::Error::other("an earlier sync failed"),
            ));
        }
        let mut removed: Vec<_> = self.removed.iter().copied().collect();
        removed.sort_unstable();
        let number = self.commits.flush_number + 1;
        let metadata = self.fill_in(metadata, number, scan_number);
        let is_new = !self.is_list_logged
            || self.metadata.ext.is_none()
            || !self.metadata.is_same_but_for_progress(&metadata);
        if !self.next.is_empty() || !removed.is_empty() || is_new || scan_number != self.commits.scan_number {
            self.sync_next()?;
            // As late as can be: what another writer commits must not be cut off.
            self.check_lock()?;
            let text = metadata.to_text();
            let metadata_text = is_new.then_some(&*text);
            let flush = Flush { number, scan_number, changed: &self.next, removed: &removed, metadata_text };
            if let Err(error) = log.append(&*self.disk, &log_path, &flush) {
                self.is_log_settled = false;
                // At once if it goes: another process may come next, and would see a record that is not on the medium.
                let _ = self.settle();
                return Err(Error::io(&log_path, "append to", error));
            }
            // Committed.
            self.log = Some(log);
            self.is_list_logged = true;
            // Who opens the map only now is taken to see more than it does, for a while.
            let is_read = self.readers.are_there();
            let changed = std::mem::take(&mut self.next);
            let is_born = |tile: &TileIndex| is_read && !self.commits.tiles.contains(*tile);
            for tile in changed.tiles().filter(is_born) {
                self.readers.note_birth(tile, number);
            }
            self.removed.clear();
            self.foreign.clear();
            self.unrenamed.extend(changed.tiles().map(|tile| (tile, ())));
            self.unremoved.extend(&removed);
            for &tile in &removed {
                self.commits.tiles.remove(tile);
            }
            self.commits.last_removed = removed;
            self.commits.flush_number = number;
            self.commits.scan_number = scan_number;
            self.commits.tiles.extend(changed.iter());
            self.commits.last_changed = TileTable::default();
            self.metadata = metadata;
        }
        if let Err(error) = self.tidy_up() {
            log::warn!("flushed, but not tidied up: {error}");
        }
        Ok(())
    }

    /// Brings the files to what the last commit says, without another one.
    pub fn tidy(&mut self) -> Result<()> {
        self.settle()?;
        self.tidy_up()
    }

    /// Brings about what earlier calls left open, before anything that builds upon it is written.
    pub(super) fn settle(&mut self) -> Result<()> {
        self.check_lock()?;
        if let (false, Some(log)) = (self.is_log_settled, self.log) {
            // A record that came to disk after all names files that must stay as they are until it is cut off.
            let path = self.layout.commit_log();
            log.cut(&*self.disk, &path).map_err(|error| Error::io(&path, "cut", error))?;
            self.sync_folder(self.layout.folder())?;
            self.is_log_settled = true;
        }
        self.put_in_place()
    }

    fn sync_next(&mut self) -> Result<()> {
        let Self { next, disk, layout, suspect, .. } = self;
        let mut changed = next.tiles().peekable();
        loop {
            let group: Vec<_> = changed.by_ref().take(TILES_SYNCED_AT_ONCE).collect();
            let is_last = changed.peek().is_none();
            sync_group(&**disk, layout, &group, is_last, suspect)?;
            if is_last {
                return Ok(());
            }
        }
    }

    /// Puts the next version of a tile's octree in place by itself: it must be the one that the log names.
    pub fn place_octree(&mut self, tile: TileIndex) -> Result<()> {
        let (next, current) =
            (self.layout.next(tile, TileFile::Octree), self.layout.current(tile, TileFile::Octree));
        self.disk.sync_file(&next).map_err(|error| Error::io(&next, "sync", error))?;
        self.rename(&next, &current)?;
        self.sync_folder(&self.layout.tile_folder(tile))
    }

    /// Takes tiles out of the map: one commit, after which the log does not name them. Their folders stay.
    pub fn forget(&mut self, tiles: &[TileIndex]) -> Result<()> {
        self.settle()?;
        for &tile in tiles {
            self.commits.tiles.remove(tile);
            self.foreign.remove(&tile);
        }
        if self.log.is_some() {
            self.commits.flush_number += 1;
            self.replace_log()?;
        }
        self.write_metadata()
    }

    /// Gives a map of the seed's format an id and a log, so that it can be written to. Its tiles count as unread
    /// until they have been written again.
    pub fn adopt(&mut self, map_id: [u8; 16]) -> Result<()> {
        if self.log.is_none() {
            let (disk, text) = (&*self.disk, self.metadata.to_text());
            let log = map_folder::replace(disk, &self.layout.commit_log(), |next| {
                CommitLog::write_whole(disk, next, map_id, &self.commits, &text)
            })?;
            self.log = Some(log);
        }
        Ok(())
    }

    /// Looks whether others are still kept from writing.
    pub(super) fn check_lock(&self) -> Result<()> {
        self.lock.as_ref().map_or(Ok(()), Lock::check)
    }

    /// Where `metadata.json` could not be replaced after the last commit, readers of it may have opened that commit.
    pub(super) fn keep_for_late_readers(&mut self) {
        if self.is_metadata_behind() {
            self.readers.may_see(self.commits.flush_number);
        }
    }

    pub(super) fn fill_in(&self, mut metadata: Metadata, flush_number: u64, scan_number: u64) -> Metadata {
        metadata.bounds = Bounds::of(self.tiles());
        if let Some(ext) = &mut metadata.ext {
            // A map keeps its storage and its snapshots, whatever the caller says.
            ext.storage = self.layout.storage();
            ext.snapshots = self.listed.clone();
            ext.empty = metadata.bounds.is_none();
            (ext.flush_number, ext.scan_number) = (flush_number, scan_number);
        }
        metadata
    }

    /// Replaces `metadata.json`: written beside, synced, renamed, the folder synced.
    pub(super) fn write_metadata(&mut self) -> Result<()> {
        let (flush_number, scan_number) = (self.commits.flush_number, self.commits.scan_number);
        self.metadata = self.fill_in(self.metadata.clone(), flush_number, scan_number);
        let text = self.metadata.to_text();
        let disk = &*self.disk;
        let watch = map_folder::replace(disk, &self.layout.metadata(), |next| {
            map_folder::write_text(disk, next, &text)?;
            // Before anybody can read it: no reader goes unseen.
            disk.watch(next)
        })?;
        self.written_flush = Some(flush_number);
        self.readers.watch(flush_number, watch);
        self.sync_folder(self.layout.folder())
    }

    pub(super) fn compact_log(&mut self) -> Result<()> {
        let Some(log) = self.log else { return Ok(()) };
        let whole_bytes = whole_map_bytes(self.commits.tiles.len());
        if log.bytes() < COMPACT_LOG_BYTES.max(2 * whole_bytes) { Ok(()) } else { self.replace_log() }
    }

    /// Replaces the log by one record of the whole map.
    pub(super) fn replace_log(&mut self) -> Result<()> {
        let Some(log) = self.log else { return Ok(()) };
        let mut metadata = self.metadata.clone();
        if let Some(ext) = &mut metadata.ext {
            ext.snapshots = self.listed.clone();
        }
        let (disk, text) = (&*self.disk, metadata.to_text());
        let compacted = map_folder::replace(disk, &self.layout.commit_log(), |next| {
            CommitLog::write_whole(disk, next, log.map_id(), &self.commits, &text)
        })?;
        self.log = Some(compacted);
        self.is_list_logged = true;
        // What is appended from now on is in this file only; every commit syncs the folder first.
        self.sync_folder(self.layout.folder())
    }

    pub(super) fn sync_folder(&self, folder: &Path) -> Result<()> {
        self.disk.sync_folder(folder).map_err(|error| Error::io(folder, "sync", error))
    }
}

/// Syncs the versions of some tiles, and notes of which tiles that failed. With the last of them goes the map's own folder,
/// which names the new tile folders.
fn sync_group(
    disk: &dyn Disk,
    layout: &Layout,
    changed: &[TileIndex],
    is_last: bool,
    suspect: &mut FxHashSet<TileIndex>,
) -> Result<()> {
    let files: Vec<_> = changed
        .iter()
        .flat_map(|&tile| layout.files().iter().map(move |&file| layout.next(tile, file)))
        .collect();
    let folders = changed.iter().map(|&tile| layout.tile_folder(tile));
    let folders: Vec<_> = folders.chain(is_last.then(|| layout.folder().to_owned())).collect();
    let [synced_files, synced_folders] = disk.sync_all(&files, &folders);
    let per_tile = layout.files().len();
    for (number, result) in synced_files.iter().enumerate() {
        if result.is_err() {
            suspect.insert(changed[number / per_tile]);
        }
    }
    let files = files.iter().zip(synced_files);
    for (path, result) in files.chain(folders.iter().zip(synced_folders)) {
        result.map_err(|error| Error::io(path, "sync", error))?;
    }
    Ok(())
}
