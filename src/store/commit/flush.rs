//! Write operations of [`TileStore`]: next versions of tiles and the commit.

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
    /// Writes the next version of a tile's file. The committed version is unchanged.
    ///
    /// # Errors
    ///
    /// An I/O error. A next version of the file that was written before is lost then.
    pub fn write_next(
        &mut self,
        tile: TileIndex,
        file: TileFile,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<FileChecksum> {
        self.writer()?.write_next(tile, file, write)
    }

    /// Returns a writer of next versions, valid until the next commit. It can be used on another thread.
    ///
    /// # Errors
    ///
    /// An I/O error while finishing the last commit.
    pub fn writer(&mut self) -> Result<TileWriter> {
        // A committed version may still have the `*.next` name of the new one.
        self.finish_earlier_work()?;
        let map_id = self.committer.logged_map_id()?;
        Ok(TileWriter::new(self.files.clone(), map_id))
    }

    /// Removes a tile from the map at the next commit: its space becomes unknown. The store does not contain the tile
    /// from now on, unless its next version is written later. Without a commit the tile remains in the map.
    ///
    /// The caller must remove the tile from memory.
    ///
    /// # Errors
    ///
    /// A map of the original format, whose removed tiles cannot be logged.
    pub fn remove(&mut self, tile: TileIndex) -> Result<()> {
        self.committer.logged_map_id()?;
        self.versions.remove(tile);
        Ok(())
    }

    /// Adds a scan whose points are not kept to the next commit.
    pub fn note_scan(&mut self, scan: ScanRecord) {
        match self.archive.is_on() {
            true => self.archive.note(CatalogEntry::Listed(scan)),
            false => self.scans.note_scan(scan),
        }
    }

    /// Truncates the list of scans to its valid, committed part. If the list was damaged, returns the path of a copy of
    /// the original.
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

    /// Removes uncommitted entries of the list of scans, before a commit without scans.
    pub(in crate::store) fn remove_excess_scans(&mut self) -> Result<()> {
        let (flush_number, records) = (self.versions.commits().flush_number, self.listed_records());
        self.scans.remove_excess(&self.files, flush_number, records)
    }

    /// Number of records in the list of scans as of the last commit, if known.
    pub(crate) fn listed_records(&self) -> Option<u64> {
        self.metadata().ext.as_ref().and_then(|ext| ext.scan_records)
    }

    /// Resets the scans of the map, at the next commit, to those of its earlier state `past`.
    ///
    /// # Errors
    ///
    /// A damaged list of kept scans or an I/O error.
    pub fn note_rewind(&mut self, past: &Self) -> Result<()> {
        self.archive.rewind(&past.archive)?;
        if !past.archive.is_on() {
            self.scans.note_rewind(past.commits().flush_number);
        }
        Ok(())
    }

    /// Commits all versions written and all tiles removed since the last commit. When this returns, exactly these
    /// changes are durable.
    ///
    /// `metadata` contains the map's parameters. Bounds and numbers are filled in here. After an error nothing is
    /// committed, and the next call retries. An I/O error after the commit itself is logged as a warning, and its work
    /// is done later.
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

    /// Begins a commit in steps, so that the map can be used meanwhile. The commit contains the scans noted so far.
    ///
    /// The caller then writes the versions of this commit and no others, syncs them concurrently
    /// ([`TileStore::unsynced`]), commits ([`TileStore::commit_synced`]), and finishes in steps
    /// ([`TileStore::begin_step`]).
    ///
    /// # Errors
    ///
    /// As for [`TileStore::commit`].
    pub fn begin_commit(&mut self, metadata: Metadata, scan_number: u64) -> Result<BegunCommit> {
        self.finish_earlier_work()?;
        self.keep_for_late_readers();
        self.committer.logged_map_id()?;
        if let Some(&tile) = self.versions.failed_syncs().first() {
            let folder = self.layout().tile_folder(tile);
            return Err(Error::io(&folder, "commit", io::Error::other("an earlier sync failed")));
        }
        self.archive.begin_commit();
        Ok(BegunCommit { metadata, scan_number, listed_scans: self.scans.pending() })
    }

    /// Returns whether there is something to commit.
    pub fn has_news(&self, begun: &BegunCommit) -> bool {
        let has_changed = !self.versions.next().is_empty() || !self.versions.removed().is_empty();
        has_changed
            || self.committer.is_new(&self.metadata_of(begun))
            || self.archive.has_news()
            || begun.scan_number != self.commits().scan_number
    }

    /// Returns the files to sync before the commit.
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
            ext.keeps_motion = self.archive.has_motion();
        }
        metadata
    }

    /// Commits the files that [`Unsynced::sync`] has made durable.
    ///
    /// # Errors
    ///
    /// The error of the sync, and those of [`TileStore::commit`].
    pub fn commit_synced(&mut self, begun: &BegunCommit, synced: Synced) -> Result<()> {
        synced.failed.into_iter().for_each(|tile| self.versions.note_failed_sync(tile));
        if synced.has_lost_scans {
            self.archive.note_failed_sync();
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
        // Checked as late as possible: if another writer has taken over, an append would truncate its commit.
        self.committer.check_lock()?;
        let text = metadata.to_text();
        let metadata_text = is_new.then_some(&*text);
        let (changed, scan_number) = (self.versions.next(), begun.scan_number);
        let flush = Flush { number, scan_number, changed, removed: &removed, catalog, metadata_text };
        if let Err(error) = self.committer.append(&self.files, &flush, &metadata) {
            // Remove the record at once, if possible: another process could see a flush that is not durable.
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

    /// Finishes the last commit. After an I/O error the rest is done later.
    pub fn tidy_up(&mut self) {
        if let Err(error) = self.finish_commit() {
            log::warn!("committed, but the cleanup failed: {error:#}");
        }
    }

    /// Selects some of the committed versions to rename, and returns them as a step; `None` if all are renamed. Then
    /// [`TileStore::put_in_place`] renames them one by one.
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

    /// Renames the version of one tile of a step, once [`Step::sync_kept`] has succeeded. A rename can take
    /// milliseconds on a busy disk, so release a shared store between tiles.
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

    /// Records the tiles that a commit adds. Readers of an earlier flush do not use them, so their tables need not be
    /// kept. A reader that opens the map at the same time may cause a table to be kept needlessly.
    fn note_added(&mut self, number: u64) {
        if !self.kept.has_readers() {
            return;
        }
        let committed = &self.versions.commits().tiles;
        for tile in self.versions.next().tiles().filter(|tile| !committed.contains(*tile)) {
            self.kept.note_added(tile, number);
        }
    }

    /// Finishes the pending work of the last commit, without a new commit.
    ///
    /// # Errors
    ///
    /// An I/O error, [`Error::LockLost`].
    pub fn checkpoint(&mut self) -> Result<()> {
        self.finish_earlier_work()?;
        self.finish_commit()
    }

    /// Finishes the work that an earlier call left. Required before any write.
    pub(in crate::store) fn finish_earlier_work(&mut self) -> Result<()> {
        self.committer.check_lock()?;
        self.committer.settle_log(&self.files)?;
        self.run_checkpoint()
    }

    pub(in crate::store) fn run_checkpoint(&mut self) -> Result<()> {
        self.checkpoint.run(&self.files, &mut self.versions, &mut self.kept)
    }

    /// Does the steps after the commit record: `metadata.json`, renames, removals, log compaction. After an I/O error
    /// the next call resumes.
    pub(in crate::store) fn finish_commit(&mut self) -> Result<()> {
        // Replace `metadata.json` first: until then, the writer cannot know which flush a new reader uses.
        if self.committer.written_flush() != Some(self.commits().flush_number) {
            self.write_metadata()?;
        }
        self.run_checkpoint()?;
        self.kept.release(&self.files);
        self.committer.compact_log(&self.files, self.versions.commits())
    }

    /// Renames the next version of a tile's octree, without its table. It must be the octree that the log names.
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

    /// Removes tiles from the log in one commit. Their folders remain.
    ///
    /// # Errors
    ///
    /// An I/O error, [`Error::LockLost`].
    pub fn forget(&mut self, tiles: &[TileIndex]) -> Result<()> {
        self.finish_earlier_work()?;
        self.remove_excess_scans()?;
        self.versions.forget(tiles);
        if self.map_id().is_some() {
            self.committed_nothing(self.commits().flush_number + 1);
            self.committer.replace_log(&self.files, self.versions.commits())?;
        }
        self.write_metadata()
    }

    /// Records a commit without changes of tiles or scans.
    pub(in crate::store) fn committed_nothing(&mut self, number: u64) {
        self.versions.committed_nothing(number);
        self.archive.set_last_commit(self.versions.commits());
    }

    /// Gives a map of the original format an id and a log, so that it can be written, and returns the id. Its tiles
    /// have no versions until they are written again. A map with an id keeps it.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn upgrade(&mut self, map_id: [u8; 16]) -> Result<[u8; 16]> {
        self.committer.begin_log(&self.files, map_id, self.versions.commits())?;
        self.committer.logged_map_id()
    }

    /// Keeps the tables of the last commit if `metadata.json` could not be replaced after it: readers may have opened
    /// this commit undetected.
    pub(in crate::store) fn keep_for_late_readers(&mut self) {
        if self.is_metadata_behind() {
            let flush_number = self.commits().flush_number;
            self.kept.may_see(flush_number);
        }
    }

    pub(in crate::store) fn write_metadata(&mut self) -> Result<()> {
        let watch = self.committer.write_metadata(&self.files, &self.versions)?;
        self.kept.watch(self.commits().flush_number, watch);
        self.files.sync_map_folder()
    }
}

/// Number of tiles renamed in one step of a concurrent flush.
const TILES_OF_STEP: usize = 64;

/// A commit that has begun.
#[derive(Debug)]
pub struct BegunCommit {
    metadata: Metadata,
    scan_number: u64,
    /// Number of noted scans that belong to the commit.
    listed_scans: usize,
}

/// Files to sync before a commit.
#[derive(Debug)]
pub struct Unsynced {
    files: MapFiles,
    tiles: Vec<TileIndex>,
    segments: Vec<u64>,
}

/// Result of [`Unsynced::sync`].
#[derive(Debug)]
pub struct Synced {
    failed: Vec<TileIndex>,
    /// Whether kept scans could not be synced.
    has_lost_scans: bool,
    result: Result<()>,
}

/// Committed versions to rename in one step.
#[derive(Debug)]
pub struct Step {
    files: MapFiles,
    tiles: Vec<TileIndex>,
    /// Tiles whose replaced tables a snapshot uses.
    pinned: Vec<TileIndex>,
}

impl Unsynced {
    /// Syncs all versions of the commit. Does not need the store.
    pub fn sync(&self) -> Synced {
        let mut failed = Vec::new();
        let mut changed = self.tiles.chunks(TILES_SYNCED_AT_ONCE).peekable();
        let result = loop {
            let group = changed.next().unwrap_or_default();
            let is_last = changed.peek().is_none();
            let synced = sync_group(&self.files, group, is_last, &mut failed);
            if is_last || synced.is_err() {
                break synced;
            }
        };
        Synced { failed, has_lost_scans: false, result }
    }

    /// Like [`Unsynced::sync`], but syncs the kept scans first, so that the commit itself has little left to sync.
    pub fn sync_with_scans(&self) -> Synced {
        for &segment in &self.segments {
            let path = self.files.layout().segment(segment);
            if let Err(error) = self.files.disk().sync_file(&path) {
                // A failed sync is reported only once: later successful syncs of this file prove nothing.
                let result = Err(Error::io(&path, "sync", error));
                return Synced { failed: Vec::new(), has_lost_scans: true, result };
            }
        }
        self.sync()
    }
}

impl Step {
    /// Makes the tables kept for snapshots durable.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn sync_kept(&self) -> Result<()> {
        sync_folders(&self.files, &self.pinned, |_| {})
    }

    /// Tiles for [`TileStore::put_in_place`].
    pub fn tiles(&self) -> &[TileIndex] {
        &self.tiles
    }

    /// Makes the new names of the versions durable.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn sync_names(&self) -> Result<()> {
        sync_folders(&self.files, &self.tiles, |_| {})
    }
}

/// Syncs the versions of some tiles, and adds those whose sync failed to `failed`. The last group includes the map's
/// folder, which contains the names of new tile folders.
fn sync_group(
    files: &MapFiles,
    changed: &[TileIndex],
    is_last: bool,
    failed: &mut Vec<TileIndex>,
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
            failed.push(changed[number / per_tile]);
        }
    }
    let synced_files = paths.iter().zip(synced_files);
    for (path, result) in synced_files.chain(folders.iter().zip(synced_folders)) {
        result.map_err(|error| Error::io(path, "sync", error))?;
    }
    Ok(())
}
