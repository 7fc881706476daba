//! The writing half of [`TileStore`]: versions beside the committed ones, and the commit that puts them in place.

use super::checkpoint::{TILES_SYNCED_AT_ONCE, sync_folders};
use super::commit_record::Flush;
use super::metadata::Metadata;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::layout::TileFile;
use crate::store::map_files::MapFiles;
use crate::store::scans::{Catalog, CatalogEntry, CatalogVersion, ScanRecord};
use crate::store::tile_store::TileStore;
use crate::store::tiles::file_checksum::FileChecksum;
use crate::store::tiles::tile_writer::TileWriter;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

impl TileStore {
    /// Writes the next version of one of a tile's files; the committed version stays as it is.
    ///
    /// # Errors
    ///
    /// An I/O error; the earlier next version is lost then.
    pub fn write_next(
        &mut self,
        tile: TileIndex,
        file: TileFile,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<FileChecksum> {
        self.writer()?.write_next(tile, file, write)
    }

    /// What writes next versions, for another thread too, until the next commit.
    ///
    /// # Errors
    ///
    /// A disk that refuses to finish what the last commit left to do.
    pub fn writer(&mut self) -> Result<TileWriter> {
        // A committed version may still be there under the name that is written to now.
        self.finish_earlier_work()?;
        let map_id = self.committer.logged_map_id()?;
        Ok(TileWriter::new(self.files.clone(), map_id))
    }

    /// Takes a tile out of the map, at the next commit: its space is unknown again. From here on the store does not
    /// hold the tile, unless a next version of it is written later. What is not committed leaves the tile where it was.
    ///
    /// Memory that holds the tile is the caller's to clear.
    ///
    /// # Errors
    ///
    /// A map of the original format, which has no log that could name removed tiles.
    pub fn remove(&mut self, tile: TileIndex) -> Result<()> {
        self.committer.logged_map_id()?;
        self.versions.remove(tile);
        Ok(())
    }

    /// Records a scan of the next commit whose points are not kept.
    pub fn note_scan(&mut self, scan: ScanRecord) {
        match self.archive.is_on() {
            true => self.archive.note(CatalogEntry::Listed(scan)),
            false => self.scans.note_scan(scan),
        }
    }

    /// Cuts the list of scans to what is whole and committed; returns where it is as it was, if it was damaged.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn settle_scans(&mut self) -> Result<Option<PathBuf>> {
        let count = self.scans.pending();
        let records = self.listed_records();
        let scans = self.scans.write(&self.files, self.versions.commits().flush_number, records, count)?;
        self.scans.commit(scans, count);
        self.committer.set_scan_records(scans.records);
        self.write_metadata()?;
        Ok(self.scans.quarantined().map(Path::to_owned))
    }

    /// Records of the list of scans as of the last commit, if that is known.
    pub(crate) fn listed_records(&self) -> Option<u64> {
        self.metadata().ext.as_ref().and_then(|ext| ext.scan_records)
    }

    /// Records that from the next commit on the map consists of the scans of an earlier one again, which is open as
    /// `past`.
    ///
    /// # Errors
    ///
    /// A list of kept scans that is damaged, a disk that refuses.
    pub fn note_rewind(&mut self, past: &Self) -> Result<()> {
        self.archive.rewind(&past.archive)?;
        if !past.archive.is_on() {
            self.scans.note_rewind(past.commits().flush_number);
        }
        Ok(())
    }

    /// Commits every version written and every tile removed since the last commit. When this returns they are durable,
    /// and only they.
    ///
    /// `metadata` gives the map's parameters; bounds and numbers are filled in here. After an error nothing is
    /// committed, and calling again tries again. What comes after the commit only tidies up: if the disk refuses that,
    /// it is logged as a warning and made good later.
    ///
    /// # Errors
    ///
    /// An I/O error, [`Error::LockLost`], or a map of the original format.
    pub fn commit(&mut self, metadata: Metadata, scan_number: u64) -> Result<()> {
        let begun = self.begin_commit(metadata, scan_number)?;
        if self.has_news(&begun) {
            let synced = self.unsynced().sync();
            self.commit_synced(&begun, synced)?;
        }
        self.tidy_up();
        Ok(())
    }

    /// Begins a commit that others complete while the map goes on: it takes along the scans that were noted until now.
    ///
    /// Then the versions are written that the commit is to name, and no others; [`TileStore::unsynced`] makes them
    /// durable, beside the map; [`TileStore::commit_synced`] commits; and what is left to do is done in steps
    /// ([`TileStore::begin_step`]).
    ///
    /// # Errors
    ///
    /// As for [`TileStore::commit`].
    pub fn begin_commit(&mut self, metadata: Metadata, scan_number: u64) -> Result<BegunCommit> {
        self.finish_earlier_work()?;
        self.keep_for_late_readers();
        self.committer.logged_map_id()?;
        if let Some(&tile) = self.versions.suspects().first() {
            let folder = self.layout().tile_folder(tile);
            return Err(Error::io(&folder, "trust", io::Error::other("an earlier sync failed")));
        }
        self.archive.begin_commit();
        Ok(BegunCommit { metadata, scan_number, listed_scans: self.scans.pending() })
    }

    /// Whether there is something to commit.
    pub fn has_news(&self, begun: &BegunCommit) -> bool {
        let has_changed = !self.versions.next().is_empty() || !self.versions.removed().is_empty();
        has_changed
            || self.committer.is_new(&self.metadata_of(begun))
            || self.archive.has_news()
            || begun.scan_number != self.commits().scan_number
    }

    /// What a commit is to make durable before it can name it.
    pub fn unsynced(&self) -> Unsynced {
        let tiles = self.versions.next().tiles().collect();
        Unsynced { files: self.files.clone(), tiles, segments: self.archive.unsynced() }
    }

    fn metadata_of(&self, begun: &BegunCommit) -> Metadata {
        let numbers = [self.commits().flush_number + 1, begun.scan_number];
        let mut metadata =
            self.committer.fill_in(begun.metadata.clone(), &self.files, &self.versions, numbers);
        if let Some(ext) = &mut metadata.ext {
            ext.keeps_scans = self.archive.is_on();
        }
        metadata
    }

    /// Commits what [`Unsynced::sync`] has made durable.
    ///
    /// # Errors
    ///
    /// Why that failed; as for [`TileStore::commit`].
    pub fn commit_synced(&mut self, begun: &BegunCommit, synced: Synced) -> Result<()> {
        synced.suspects.into_iter().for_each(|tile| self.versions.suspect(tile));
        if synced.has_lost_scans {
            self.archive.suspect_unsynced();
        }
        synced.result?;
        let number = self.commits().flush_number + 1;
        let mut metadata = self.metadata_of(begun);
        let is_new = self.committer.is_new(&metadata);
        let removed = self.versions.removed();
        let scans = self.scans.write(&self.files, number - 1, self.listed_records(), begun.listed_scans)?;
        let kept = self.archive.write(!self.versions.commits().tiles.is_empty())?;
        let named = || kept.map_or(CatalogVersion::NONE, Catalog::version);
        let catalog = self.archive.is_on().then(named);
        if let Some(ext) = &mut metadata.ext {
            (ext.scan_records, ext.catalog) = (Some(scans.records), catalog);
        }
        // As late as can be: what another writer commits must not be cut off.
        self.committer.check_lock()?;
        let text = metadata.to_text();
        let metadata_text = is_new.then_some(&*text);
        let (changed, scan_number) = (self.versions.next(), begun.scan_number);
        let flush = Flush { number, scan_number, changed, removed: &removed, catalog, metadata_text };
        if let Err(error) = self.committer.append(&self.files, &flush, &metadata) {
            // At once if it goes: another process may come next, and would see a record that is not on the medium.
            let _ = self.finish_earlier_work();
            self.archive.not_committed();
            return Err(error);
        }
        // Committed.
        self.note_added(number);
        self.scans.commit(scans, begun.listed_scans);
        self.archive.commit(kept);
        let changed = self.versions.committed(number, scan_number, catalog);
        self.archive.set_last_commit(self.versions.commits());
        log::info!(
            "{}: flush {number}, as of scan {scan_number}: {} tiles written, {} removed",
            self.files.folder().display(),
            changed.len(),
            removed.len()
        );
        self.checkpoint.add(changed.tiles(), &removed);
        Ok(())
    }

    /// Does what a commit leaves to do. What the disk refuses is done later.
    pub fn tidy_up(&mut self) {
        if let Err(error) = self.finish_commit() {
            log::warn!("flushed, but not tidied up: {error:#}");
        }
    }

    /// Begins to put some of the committed versions in place; `None` if all are, or as far as they could be.
    /// [`TileStore::put_in_place`] comes next.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn begin_step(&mut self) -> Result<Option<Step>> {
        let flush_number = self.commits().flush_number;
        if self.committer.written_flush() != Some(flush_number) {
            self.write_metadata()?;
        }
        let tiles = self.checkpoint.some_unrenamed(TILES_OF_STEP);
        if tiles.is_empty() {
            return Ok(None);
        }
        let pinned = self.checkpoint.keep_replaced(&self.files, &tiles, flush_number, &mut self.kept)?;
        Ok(Some(Step { files: self.files.clone(), tiles, pinned }))
    }

    /// Puts the version of a tile of a step in place, once [`Step::sync_kept`] has succeeded. On a busy disk a rename
    /// takes milliseconds, so whoever shares the store lets others have it between two tiles.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn put_in_place(&mut self, step: &Step, tile: TileIndex) -> Result<()> {
        if step.pinned.contains(&tile) {
            self.kept.is_durable(tile);
        }
        self.checkpoint.rename(&self.files, &[tile])
    }

    /// Ends a step, once [`Step::sync_names`] has succeeded.
    pub fn end_step(&mut self, step: &Step) {
        self.checkpoint.renames_are_durable(&step.tiles);
    }

    /// Records the tiles that a commit adds. A reader of an earlier flush does not see them, so their tables need not
    /// be kept for it. A reader that opens the map meanwhile may cause a table to be kept in vain.
    fn note_added(&mut self, number: u64) {
        if !self.kept.has_readers() {
            return;
        }
        let committed = &self.versions.commits().tiles;
        for tile in self.versions.next().tiles().filter(|tile| !committed.contains(*tile)) {
            self.kept.note_added(tile, number);
        }
    }

    /// Brings the files to what the last commit says, without another one.
    ///
    /// # Errors
    ///
    /// An I/O error, [`Error::LockLost`].
    pub fn checkpoint(&mut self) -> Result<()> {
        self.finish_earlier_work()?;
        self.finish_commit()
    }

    /// Completes the steps that an earlier call could not. Must come before any write.
    pub(in crate::store) fn finish_earlier_work(&mut self) -> Result<()> {
        self.committer.check_lock()?;
        self.committer.settle_log(&self.files)?;
        self.run_checkpoint()
    }

    pub(in crate::store) fn run_checkpoint(&mut self) -> Result<()> {
        self.checkpoint.run(&self.files, &mut self.versions, &mut self.kept)
    }

    /// Does the steps after the commit record: `metadata.json`, renames, removals, log compaction. The next call
    /// completes what the disk refuses.
    pub(in crate::store) fn finish_commit(&mut self) -> Result<()> {
        // At once: who opens the map in between cannot tell the writer which flush it reads.
        if self.committer.written_flush() != Some(self.commits().flush_number) {
            self.write_metadata()?;
        }
        self.run_checkpoint()?;
        self.kept.release(&self.files);
        self.committer.compact_log(&self.files, self.versions.commits())
    }

    /// Puts the next version of a tile's octree in place by itself: it must be the one that the log names.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn place_octree(&mut self, tile: TileIndex) -> Result<()> {
        let layout = self.layout();
        let (next, current) = (layout.next(tile, TileFile::Octree), layout.current(tile, TileFile::Octree));
        self.disk().sync_file(&next).map_err(|error| Error::io(&next, "sync", error))?;
        self.files.rename(&next, &current)?;
        self.files.sync_folder(&layout.tile_folder(tile))
    }

    /// Takes tiles out of the map: one commit, after which the log does not name them. Their folders stay.
    ///
    /// # Errors
    ///
    /// An I/O error, [`Error::LockLost`].
    pub fn forget(&mut self, tiles: &[TileIndex]) -> Result<()> {
        self.finish_earlier_work()?;
        self.versions.forget(tiles);
        if self.map_id().is_some() {
            self.committed_nothing(self.commits().flush_number + 1);
            self.committer.replace_log(&self.files, self.versions.commits())?;
        }
        self.write_metadata()
    }

    /// Notes a commit in which no tile and no scan changed.
    pub(in crate::store) fn committed_nothing(&mut self, number: u64) {
        self.versions.committed_nothing(number);
        self.archive.set_last_commit(self.versions.commits());
    }

    /// Gives a map of the original format an id and a log, so that it can be written to, and returns the id. Its tiles
    /// count as unread until they have been written again. A map that has an id keeps it.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn upgrade(&mut self, map_id: [u8; 16]) -> Result<[u8; 16]> {
        self.committer.begin_log(&self.files, map_id, self.versions.commits())?;
        self.committer.logged_map_id()
    }

    /// Where `metadata.json` could not be replaced after the last commit, readers of it may have opened that commit.
    pub(in crate::store) fn keep_for_late_readers(&mut self) {
        if self.is_metadata_behind() {
            let flush_number = self.commits().flush_number;
            self.kept.may_see(flush_number);
        }
    }

    /// Replaces `metadata.json`, durably.
    pub(in crate::store) fn write_metadata(&mut self) -> Result<()> {
        let watch = self.committer.write_metadata(&self.files, &self.versions)?;
        self.kept.watch(self.commits().flush_number, watch);
        self.files.sync_map_folder()
    }
}

/// Tiles whose new names are made durable at once beside the map.
const TILES_OF_STEP: usize = 64;

/// A commit that has begun.
#[derive(Debug)]
pub struct BegunCommit {
    metadata: Metadata,
    scan_number: u64,
    /// How many of the scans that were noted belong to it.
    listed_scans: usize,
}

/// What a commit is to make durable.
#[derive(Debug)]
pub struct Unsynced {
    files: MapFiles,
    tiles: Vec<TileIndex>,
    segments: Vec<u64>,
}

/// What came of that.
#[derive(Debug)]
pub struct Synced {
    suspects: Vec<TileIndex>,
    /// Whether kept scans could not be synced.
    has_lost_scans: bool,
    result: Result<()>,
}

/// Some committed versions that are put in place.
#[derive(Debug)]
pub struct Step {
    files: MapFiles,
    tiles: Vec<TileIndex>,
    /// Those of which a snapshot sees what was in place before.
    pinned: Vec<TileIndex>,
}

impl Unsynced {
    /// Syncs all versions that the commit names. The store needs not wait for it.
    pub fn sync(&self) -> Synced {
        let mut suspects = Vec::new();
        let mut changed = self.tiles.chunks(TILES_SYNCED_AT_ONCE).peekable();
        let result = loop {
            let group = changed.next().unwrap_or_default();
            let is_last = changed.peek().is_none();
            let synced = sync_group(&self.files, group, is_last, &mut suspects);
            if is_last || synced.is_err() {
                break synced;
            }
        };
        Synced { suspects, has_lost_scans: false, result }
    }

    /// The same, and brings kept scans to the medium ahead of the commit, which then has little of them left to sync.
    pub fn sync_with_scans(&self) -> Synced {
        for &segment in &self.segments {
            let path = self.files.layout().segment(segment);
            if let Err(error) = self.files.disk().sync_file(&path) {
                // A disk tells this once: what it says of the file from now on proves nothing.
                let result = Err(Error::io(&path, "sync", error));
                return Synced { suspects: Vec::new(), has_lost_scans: true, result };
            }
        }
        self.sync()
    }
}

impl Step {
    /// Makes durable what snapshots see from now on.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn sync_kept(&self) -> Result<()> {
        sync_folders(&self.files, &self.pinned, |_| {})
    }

    /// The tiles for [`TileStore::put_in_place`].
    pub fn tiles(&self) -> &[TileIndex] {
        &self.tiles
    }

    /// Makes durable that the versions have their names.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn sync_names(&self) -> Result<()> {
        sync_folders(&self.files, &self.tiles, |_| {})
    }
}

/// Syncs the versions of some tiles, and adds the tiles of which that failed to `suspects`. With the last of them goes
/// the map's own folder, which names the new tile folders.
fn sync_group(
    files: &MapFiles,
    changed: &[TileIndex],
    is_last: bool,
    suspects: &mut Vec<TileIndex>,
) -> Result<()> {
    let layout = files.layout();
    let paths: Vec<_> = changed
        .iter()
        .flat_map(|&tile| layout.files().iter().map(move |&file| layout.next(tile, file)))
        .collect();
    let folders = changed.iter().map(|&tile| layout.tile_folder(tile));
    let folders: Vec<_> = folders.chain(is_last.then(|| layout.folder().to_owned())).collect();
    let [synced_files, synced_folders] = files.disk().sync_all(&paths, &folders);
    let per_tile = layout.files().len();
    for (number, result) in synced_files.iter().enumerate() {
        if result.is_err() {
            suspects.push(changed[number / per_tile]);
        }
    }
    let synced_files = paths.iter().zip(synced_files);
    for (path, result) in synced_files.chain(folders.iter().zip(synced_folders)) {
        result.map_err(|error| Error::io(path, "sync", error))?;
    }
    Ok(())
}
