use super::commit_log::CommitLog;
use super::commit_record::{Flush, whole_map_bytes};
use super::commits::Commits;
use super::input_record::forget_earliest;
use super::metadata::{Bounds, Metadata};
use crate::error::{Error, Result};
use crate::store::WriterLock;
use crate::store::disk::ReaderWatch;
use crate::store::map_files::MapFiles;
use crate::store::map_folder;
use crate::store::snapshots::snapshot_list::SnapshotList;
use crate::store::tiles::tile_versions::TileVersions;

/// Owner of `commits.log`, `metadata.json` and the writer lock.
#[derive(Debug)]
pub(in crate::store) struct Committer {
    /// `None` only for a map of the original format.
    log: Option<CommitLog>,
    /// Whether the log ends with its last commit; false after a failed append, which may have written a part of a
    /// record.
    is_log_settled: bool,
    metadata: Metadata,
    /// Flush number in the `metadata.json` on disk; `None` in the original format. After a crash it may be older than
    /// the log.
    written_flush: Option<u64>,
    /// Snapshots of the map; `None` if neither log nor metadata lists them.
    listed: Option<SnapshotList>,
    /// Whether the log contains the list of snapshots.
    is_list_logged: bool,
    /// Writer lock; `None` if the map is open for reading only.
    lock: Option<WriterLock>,
}

/// A log is compacted when it exceeds this many bytes and twice the length of one record of the whole map.
const COMPACT_LOG_BYTES: u64 = 2048;

impl Committer {
    pub(in crate::store) fn new(
        log: Option<CommitLog>,
        metadata: Metadata,
        written_flush: Option<u64>,
    ) -> Self {
        let listed = metadata.ext.as_ref().and_then(|ext| ext.snapshots.clone());
        let (is_log_settled, is_list_logged, lock) = (true, true, None);
        Self { log, is_log_settled, metadata, written_flush, listed, is_list_logged, lock }
    }

    /// Starts holding the lock, which allows writes. `is_torn` states that the log ends with an incomplete record.
    pub(in crate::store) fn begin_writing(&mut self, lock: WriterLock, is_torn: bool) {
        self.lock = Some(lock);
        self.is_log_settled = !is_torn;
    }

    pub(in crate::store) fn is_writer(&self) -> bool {
        self.lock.is_some()
    }

    pub(in crate::store) fn check_lock(&self) -> Result<()> {
        self.lock.as_ref().map_or(Ok(()), WriterLock::check)
    }

    /// The map's id; `None` for a map of the original format.
    pub(in crate::store) fn map_id(&self) -> Option<[u8; 16]> {
        self.log.map(|log| log.map_id())
    }

    /// The map's id.
    ///
    /// # Errors
    ///
    /// A map of the original format has none.
    pub(in crate::store) fn logged_map_id(&self) -> Result<[u8; 16]> {
        Ok(self.log()?.map_id())
    }

    fn log(&self) -> Result<CommitLog> {
        let reason = "a map of the original format must be upgraded first";
        self.log.ok_or_else(|| Error::argument("map", reason))
    }

    pub(in crate::store) fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Sets the metadata for the next log and `metadata.json`.
    pub(in crate::store) fn set_metadata(&mut self, metadata: Metadata) {
        self.metadata = metadata;
    }

    /// Flush number in the `metadata.json` on disk.
    pub(in crate::store) fn written_flush(&self) -> Option<u64> {
        self.written_flush
    }

    /// Returns whether `metadata.json` is older than `flush_number`, the last flush in the log.
    pub(in crate::store) fn is_metadata_behind(&self, flush_number: u64) -> bool {
        self.log.is_some() && self.written_flush != Some(flush_number)
    }

    /// List of snapshots, if log or metadata contains one.
    pub(in crate::store) fn snapshots(&self) -> Option<&SnapshotList> {
        self.listed.as_ref()
    }

    /// Sets the list of snapshots to those found. The next commit records it.
    pub(in crate::store) fn set_snapshots(&mut self, found: SnapshotList) {
        self.listed = Some(found);
        self.is_list_logged = false;
    }

    /// Fills in the fields that the store manages (bounds, numbers, storage, snapshots), and drops the earliest inputs
    /// beyond the limit.
    pub(in crate::store) fn fill_in(
        &self,
        mut metadata: Metadata,
        files: &MapFiles,
        versions: &TileVersions,
        [flush_number, scan_number]: [u64; 2],
    ) -> Metadata {
        metadata.bounds = Bounds::of(versions.iter());
        if let Some(ext) = &mut metadata.ext {
            ext.storage = files.layout().storage();
            ext.snapshots = self.listed.clone();
            ext.catalog = versions.commits().catalog;
            forget_earliest(&mut ext.inputs);
            ext.empty = metadata.bounds.is_none();
            (ext.flush_number, ext.scan_number) = (flush_number, scan_number);
        }
        metadata
    }

    /// Corrects the number of records in the list of scans, for the next `metadata.json`.
    pub(in crate::store) fn set_scan_records(&mut self, records: u64) {
        if let Some(ext) = &mut self.metadata.ext {
            ext.scan_records = Some(records);
        }
    }

    /// Returns whether the next commit must contain the metadata.
    pub(in crate::store) fn is_new(&self, metadata: &Metadata) -> bool {
        !self.is_list_logged
            || self.metadata.ext.is_none()
            || !self.metadata.is_same_but_for_progress(metadata)
    }

    /// Appends and syncs a record: the commit. After an error the end of the log is unknown until [`Self::settle_log`]
    /// succeeds.
    pub(in crate::store) fn append(
        &mut self,
        files: &MapFiles,
        flush: &Flush<'_>,
        metadata: &Metadata,
    ) -> Result<()> {
        let mut log = self.log()?;
        let path = files.layout().commit_log();
        if let Err(error) = log.append(&**files.disk(), &path, flush) {
            self.is_log_settled = false;
            return Err(Error::io(&path, "append to", error));
        }
        (self.log, self.is_list_logged) = (Some(log), true);
        self.metadata = metadata.clone();
        Ok(())
    }

    /// Truncates the log after a failed append. Until then the failed record may reach the disk, so the `*.next` files
    /// that it names must not change.
    pub(in crate::store) fn settle_log(&mut self, files: &MapFiles) -> Result<()> {
        if let (false, Some(log)) = (self.is_log_settled, self.log) {
            let path = files.layout().commit_log();
            log.cut(&**files.disk(), &path).map_err(|error| Error::io(&path, "cut", error))?;
            files.sync_map_folder()?;
            self.is_log_settled = true;
        }
        Ok(())
    }

    /// Gives a map of the original format an id and a log.
    pub(in crate::store) fn begin_log(
        &mut self,
        files: &MapFiles,
        map_id: [u8; 16],
        commits: &Commits,
    ) -> Result<()> {
        if self.log.is_none() {
            let (disk, text) = (&**files.disk(), self.metadata.to_text());
            let log = map_folder::replace(disk, &files.layout().commit_log(), |next| {
                CommitLog::write_whole(disk, next, map_id, commits, &text)
            })?;
            self.log = Some(log);
        }
        Ok(())
    }

    /// Replaces the log by one record of the whole map.
    pub(in crate::store) fn replace_log(&mut self, files: &MapFiles, commits: &Commits) -> Result<()> {
        let Some(log) = self.log else { return Ok(()) };
        let mut metadata = self.metadata.clone();
        if let Some(ext) = &mut metadata.ext {
            (ext.snapshots, ext.catalog) = (self.listed.clone(), commits.catalog);
        }
        let (disk, text) = (&**files.disk(), metadata.to_text());
        let compacted = map_folder::replace(disk, &files.layout().commit_log(), |next| {
            CommitLog::write_whole(disk, next, log.map_id(), commits, &text)
        })?;
        self.log = Some(compacted);
        self.is_list_logged = true;
        // Later records are only in the new file, so its name must be durable. If this sync fails, the next commit
        // repeats it.
        files.sync_map_folder()
    }

    /// Replaces the log by one record of the whole map, if that makes it much shorter.
    pub(in crate::store) fn compact_log(&mut self, files: &MapFiles, commits: &Commits) -> Result<()> {
        let Some(log) = self.log else { return Ok(()) };
        let whole_bytes = whole_map_bytes(commits.tiles.len());
        match log.bytes() < COMPACT_LOG_BYTES.max(2 * whole_bytes) {
            true => Ok(()),
            false => self.replace_log(files, commits),
        }
    }

    /// Replaces `metadata.json` atomically. The caller must sync the folder, and use the returned watch to find readers
    /// of the new file.
    pub(in crate::store) fn write_metadata(
        &mut self,
        files: &MapFiles,
        versions: &TileVersions,
    ) -> Result<Box<dyn ReaderWatch>> {
        let Commits { flush_number, scan_number, .. } = *versions.commits();
        self.metadata = self.fill_in(self.metadata.clone(), files, versions, [flush_number, scan_number]);
        let (disk, text) = (&**files.disk(), self.metadata.to_text());
        let watch = map_folder::replace(disk, &files.layout().metadata(), |next| {
            map_folder::write_text(disk, next, &text)?;
            // Watch the file before it is visible, so that no reader is missed.
            disk.watch(next)
        })?;
        self.written_flush = Some(flush_number);
        Ok(watch)
    }

    /// Commits a new list of snapshots and nothing else. This is a flush of its own in the log, so that recovery
    /// handles a crash like at any other flush.
    pub(in crate::store) fn append_snapshots(
        &mut self,
        files: &MapFiles,
        versions: &TileVersions,
        listed: SnapshotList,
    ) -> Result<u64> {
        let before = self.listed.replace(listed);
        let (number, scan_number) = (versions.commits().flush_number + 1, versions.commits().scan_number);
        let metadata = self.fill_in(self.metadata.clone(), files, versions, [number, scan_number]);
        let text = metadata.to_text();
        let changed = Default::default();
        let catalog = versions.commits().catalog;
        let metadata_text = Some(&*text);
        let flush = Flush { number, scan_number, changed: &changed, removed: &[], catalog, metadata_text };
        if let Err(error) = self.append(files, &flush, &metadata) {
            self.listed = before;
            return Err(error);
        }
        Ok(number)
    }
}
