use super::commit::checkpoint::Checkpoint;
use super::commit::commit_log::CommitLog;
use super::commit::commits::Commits;
use super::commit::committer::Committer;
use super::commit::metadata::Metadata;
use super::disk::{Disk, DiskRead};
use super::layout::Layout;
use super::map_files::MapFiles;
use super::map_folder;
use super::path_check;
use super::recovery::recover::{recover, remove_deleted_snapshots, remove_uncommitted, settle_own_files};
use super::scans::{KeptAsOf, ScanArchive, ScanList};
use super::snapshots::kept_tables::KeptTables;
use super::snapshots::snapshot_name::SnapshotName;
use super::tiles::tables::Tables;
use super::tiles::tile_versions::TileVersions;
use crate::error::{Error, FormatError, Result};
use crate::store::WriterLock;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Tiles of a map on disk, with one commit point for each flush.
///
/// A new version of a tile is written as `*.next`, next to the committed one. [`TileStore::commit`] makes all new
/// versions durable, appends one synced record to the log (the commit), and renames them over the committed versions.
///
/// This file opens maps; `flush` writes and commits. [`Tables`] reads tables, [`ScanArchive`] kept scans, and
/// [`Snapshots`](super::Snapshots) snapshots.
#[derive(Debug)]
pub struct TileStore {
    pub(super) files: MapFiles,
    /// Committed versions of tiles, and those written since.
    pub(super) versions: TileVersions,
    pub(super) committer: Committer,
    /// Work that the last commit left.
    pub(super) checkpoint: Checkpoint,
    pub(super) scans: ScanList,
    pub(super) archive: ScanArchive,
    /// Replaced tables that readers and snapshots use. Only a writer fills it.
    pub(super) kept: KeptTables,
    /// Number of files of an earlier writer that were removed on opening.
    pub(super) leftovers_removed: u64,
    /// Snapshots whose interrupted deletion was finished on opening.
    pub(super) snapshots_removed: Vec<SnapshotName>,
    /// Whether `metadata.json` was updated from the log on opening.
    has_replaced_metadata: bool,
    /// Opened snapshot; `None` for the current map.
    pub(super) opened_snapshot: Option<SnapshotName>,
    /// Marks the reader, so that a writer keeps the tables that it uses.
    #[expect(dead_code, reason = "held for its drop")]
    shared_metadata: Option<SharedMetadata>,
}

struct SharedMetadata(#[expect(dead_code, reason = "held for its drop")] Mutex<Box<dyn DiskRead>>);

/// Number of times that a reader reopens a map because a writer flushed meanwhile.
const OPEN_ATTEMPTS: usize = 100;

impl TileStore {
    /// Creates an empty map in a folder that is missing, empty, or has only the remains of an interrupted creation.
    pub fn create(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata, map_id: [u8; 16]) -> Result<Self> {
        let layout = Layout::new(folder);
        path_check::check_path(&*disk, folder)?;
        map_folder::create_folders(&*disk, folder)?;
        // Check before the lock is taken, because locking creates a file, and again with the lock, when no other
        // process can create a map here.
        map_folder::check_is_free(&*disk, folder)?;
        let lock = WriterLock::take(&*disk, &layout)?;
        map_folder::check_is_free(&*disk, folder)?;
        let mut metadata = metadata;
        if let Some(ext) = &mut metadata.ext {
            // Fields that belong to another map, if `metadata` was copied from one.
            (ext.snapshots, ext.scan_records, ext.catalog) = (None, None, None);
        }
        let commits = Commits::default();
        let log_path = layout.commit_log();
        let log = CommitLog::write_whole(&*disk, &log_path, map_id, &commits, &metadata.to_text())
            .map_err(|error| Error::io(&log_path, "write", error))?;
        let mut store = Self::new(disk, layout, metadata, Some(log), commits);
        store.committer.begin_writing(lock, false);
        // A folder with `metadata.json` is a map, and a map without a log is damaged.
        store.files.sync_map_folder()?;
        store.write_metadata()?;
        Ok(store)
    }

    /// Opens a map for writing: takes the lock, then restores the state of the last commit.
    pub fn open(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        // Read before the lock is taken, because locking would create a file in a folder without a map.
        map_folder::read_metadata(&*disk, &layout)?;
        let lock = WriterLock::take(&*disk, &layout)?;
        let metadata = map_folder::read_metadata(&*disk, &layout)?;
        let mut store = Self::read(disk, layout, metadata)?;
        let is_torn = store.committer.map_id().is_some() && store.commits().torn.is_some();
        store.committer.begin_writing(lock, is_torn);
        let path = store.layout().metadata();
        let watch = store.disk().watch(&path).map_err(|error| Error::io(&path, "open", error))?;
        store.kept.watch(store.committer.written_flush().unwrap_or_default(), watch);
        if store.commits().flush_number == 0 {
            // After an interrupted creation the names may not be durable.
            store.files.sync_map_folder()?;
        }
        if store.map_id().is_some() {
            if store.is_metadata_behind() {
                // A killed writer may have written the last record without a sync, and another sync of the same bytes
                // proves nothing. So the log is written again before its last record is used.
                store.committer.replace_log(&store.files, store.versions.commits())?;
            }
            store.recover()?;
            if store.is_metadata_behind() {
                // New readers wait until `metadata.json` is replaced. Existing readers may use the last commit.
                store.keep_for_late_readers();
                store.tidy_up();
                store.has_replaced_metadata = !store.is_metadata_behind();
            }
        } else {
            let (disk, layout, foreign) = (&**store.disk(), store.layout(), store.versions.foreign());
            store.leftovers_removed =
                settle_own_files(disk, layout)? + remove_uncommitted(disk, layout, foreign)?;
        }
        Ok(store)
    }

    /// Restores the state of the last commit.
    fn recover(&mut self) -> Result<()> {
        let map_id = self.map_id().unwrap_or_default();
        let listed = self.committer.snapshots();
        let found = recover(&**self.disk(), self.layout(), self.commits(), map_id, listed)?;
        if listed.is_none() && !found.snapshots.found().is_empty() {
            // A version without a list of snapshots wrote the map. The next commit adds it.
            self.committer.set_snapshots(found.snapshots.found().clone());
        }
        self.kept.set_snapshots(found.snapshots);
        self.versions.set_orphans(found.orphans);
        self.leftovers_removed = found.removed;
        let removed = &self.versions.commits().last_removed;
        self.checkpoint = Checkpoint::of_leftovers(found.unrenamed, found.renamed, removed);
        self.run_checkpoint()?;
        if let Err(error) = self.release_scans() {
            // Files of deleted snapshots remain until this succeeds, so the deletion is resumed at the next opening.
            log::warn!("unneeded kept scans remain: {error:#}");
            return Ok(());
        }
        let listed = self.committer.snapshots();
        self.snapshots_removed = remove_deleted_snapshots(&**self.disk(), self.layout(), map_id, listed)?;
        self.leftovers_removed += self.snapshots_removed.len() as u64;
        Ok(())
    }

    /// Opens a map for reading, without a lock and without writing. The store keeps showing the flush that it has
    /// opened when a writer flushes again.
    pub fn open_read_only(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        for attempt in 0..OPEN_ATTEMPTS {
            let (metadata, shared) = map_folder::read_metadata_shared(&*disk, &layout)?;
            let store = Self::read(disk.clone(), layout.clone(), metadata)?;
            // If the file changed, the writer may have missed our lock: retry.
            let now = map_folder::read_metadata(&*disk, &layout)?;
            // If the log is newer, the writer does not know which flush is read. Wait until it replaces
            // `metadata.json`; after half of the attempts, assume that it was killed.
            let is_known = !store.is_metadata_behind() || attempt + 1 >= OPEN_ATTEMPTS / 2;
            if now.ext.map(|ext| ext.flush_number) == store.committer.written_flush() && is_known {
                return Ok(Self { shared_metadata: Some(SharedMetadata(Mutex::new(shared))), ..store });
            }
            if !is_known {
                disk.pause();
            }
        }
        Err(Error::Changed { path: folder.to_owned() })
    }

    /// Returns a read-only store for a map whose `metadata.json` or `commits.log` cannot be read. The metadata and the
    /// list of tiles were recovered from other files.
    pub fn of_commits(
        disk: Arc<dyn Disk>,
        folder: &Path,
        map_id: [u8; 16],
        metadata: Metadata,
        commits: Commits,
    ) -> Self {
        Self::new(disk, Layout::new(folder), metadata, Some(CommitLog::of_map(map_id)), commits)
    }

    pub(super) fn read(disk: Arc<dyn Disk>, layout: Layout, metadata: Metadata) -> Result<Self> {
        let log = map_folder::read_log(&*disk, &layout)?;
        let log_path = layout.commit_log();
        let damaged = |at, reason: String| Err(FormatError::at_offset(at, reason).in_map(&log_path, None));
        let (log, commits) = match (&metadata.ext, log) {
            (Some(_), Some((log, commits))) => (log, commits),
            (Some(_), None) => {
                return damaged(0, "the file is missing".into());
            }
            // The upgrade was committed, but `metadata.json` was not replaced.
            (None, Some((log, commits))) if commits.flush_number > 0 => (log, commits),
            (None, _) => {
                let foreign = map_folder::list_foreign_tiles(&*disk, &layout)?;
                let store = Self::new(disk, layout, metadata, None, Commits::default());
                return Ok(Self { versions: TileVersions::of_foreign(foreign), ..store });
            }
        };
        let written = metadata.ext.as_ref();
        if let Some(ext) = written {
            if hex(&log.map_id()) != ext.map_id {
                let reason = format!("the log belongs to map {}, not to {}", hex(&log.map_id()), ext.map_id);
                return damaged(12, reason);
            }
            if commits.flush_number < ext.flush_number {
                let (found, wanted) = (commits.flush_number, ext.flush_number);
                let torn = commits.torn.as_ref().map_or(String::new(), |torn| format!("; {}", torn.reason));
                let reason = format!("the log ends at flush {found}, metadata.json at flush {wanted}{torn}");
                return damaged(log.bytes(), reason);
            }
        }
        let written_flush = written.map(|ext| ext.flush_number);
        // The log is authoritative. After a crash `metadata.json` may be older.
        let metadata = match &commits.metadata {
            // Bounds and numbers are those of the record with the metadata, which may not be the last one.
            Some(committed) if written_flush != Some(commits.flush_number) => committed.as_of(&commits),
            _ => metadata,
        };
        let committer = Committer::new(Some(log), metadata.clone(), written_flush);
        Ok(Self { committer, ..Self::new(disk, layout, metadata, Some(log), commits) })
    }

    pub(super) fn new(
        disk: Arc<dyn Disk>,
        layout: Layout,
        metadata: Metadata,
        log: Option<CommitLog>,
        commits: Commits,
    ) -> Self {
        let layout = layout.with_storage(metadata.storage());
        let files = MapFiles::new(disk, layout);
        let [keeps_scans, has_motion] =
            metadata.ext.as_ref().map_or([false; 2], |ext| [ext.keeps_scans, ext.keeps_motion]);
        Self {
            archive: ScanArchive::new(files.clone(), [keeps_scans, has_motion], KeptAsOf::last_of(&commits)),
            files,
            versions: TileVersions::new(commits),
            committer: Committer::new(log, metadata, None),
            checkpoint: Checkpoint::default(),
            scans: ScanList::default(),
            kept: KeptTables::default(),
            leftovers_removed: 0,
            snapshots_removed: Vec::new(),
            has_replaced_metadata: false,
            opened_snapshot: None,
            shared_metadata: None,
        }
    }

    /// Disk with the map's files.
    pub fn disk(&self) -> &Arc<dyn Disk> {
        self.files.disk()
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.files.folder()
    }

    /// Paths of the map's files.
    pub fn layout(&self) -> &Layout {
        self.files.layout()
    }

    /// Metadata as last read or written.
    pub fn metadata(&self) -> &Metadata {
        self.committer.metadata()
    }

    /// The map's id; `None` for a map of the original format.
    pub fn map_id(&self) -> Option<[u8; 16]> {
        self.committer.map_id()
    }

    /// The last commit.
    pub fn commits(&self) -> &Commits {
        self.versions.commits()
    }

    /// Tiles on disk.
    pub fn tiles(&self) -> &TileVersions {
        &self.versions
    }

    /// Tiles on disk, to record written versions.
    pub fn tiles_mut(&mut self) -> &mut TileVersions {
        &mut self.versions
    }

    /// Reader of tables.
    pub fn tables(&self) -> Tables<'_> {
        Tables::of(self)
    }

    /// Kept scans.
    pub fn archive(&self) -> &ScanArchive {
        &self.archive
    }

    /// Kept scans, to add scans.
    pub fn archive_mut(&mut self) -> &mut ScanArchive {
        &mut self.archive
    }

    /// Returns whether `metadata.json` is older than the log, as after a crash.
    pub fn is_metadata_behind(&self) -> bool {
        self.committer.is_metadata_behind(self.commits().flush_number)
    }

    /// Returns whether a writer has upgraded a map of the original format since it was opened: the map has a log now.
    pub fn is_upgraded_meanwhile(&self) -> Result<bool> {
        if self.map_id().is_some() {
            return Ok(false);
        }
        Ok(self.files.kind(&self.layout().commit_log())?.is_some())
    }

    /// Number of files of an earlier writer that were removed on opening.
    pub fn leftovers_removed(&self) -> u64 {
        self.leftovers_removed
    }

    /// Returns whether `metadata.json` was older than the log and was replaced on opening.
    pub fn has_replaced_metadata(&self) -> bool {
        self.has_replaced_metadata
    }

    /// Memory of the index of tiles in bytes: about 30 bytes per tile, and as much again for a tile with an uncommitted
    /// version.
    pub fn index_bytes(&self) -> usize {
        self.versions.bytes() + self.kept.bytes()
    }

    /// Additional memory of the next commit in bytes.
    pub fn commit_bytes(&self) -> usize {
        self.versions.commit_bytes() + self.scans.bytes() + self.archive.bytes()
    }
}

impl std::fmt::Debug for SharedMetadata {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SharedMetadata")
    }
}

/// Formats an id as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Parses an id from its hexadecimal digits.
pub(crate) fn id_from_hex(digits: &str) -> Option<[u8; 16]> {
    let byte = |at: usize| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..16).map(byte).collect();
    bytes?.try_into().ok().filter(|_| digits.len() == 32)
}
