use super::commit::checkpoint::Checkpoint;
use super::commit::commit_log::CommitLog;
use super::commit::commits::Commits;
use super::commit::committer::Committer;
use super::commit::metadata::Metadata;
use super::disk::{Disk, DiskRead};
use super::layout::Layout;
use super::map_files::MapFiles;
use super::map_folder;
use super::place;
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

/// The tiles of a map on disk, and the one commit point that makes a flush whole.
///
/// A tile is written beside its committed version, as `*.next`. [`TileStore::commit`] makes all of them durable,
/// appends one synced record to the log (that is the commit), and renames them over the committed versions.
///
/// This file opens maps; `flush` writes and commits. Tables are read through [`Tables`], kept scans through
/// [`ScanArchive`], snapshots through [`Snapshots`](super::Snapshots).
#[derive(Debug)]
pub struct TileStore {
    pub(super) files: MapFiles,
    /// Which tiles there are, committed or written since.
    pub(super) versions: TileVersions,
    /// The log, the metadata and the lock.
    pub(super) committer: Committer,
    /// What the last commit left to do.
    pub(super) checkpoint: Checkpoint,
    /// Which scans are in the map.
    pub(super) scans: ScanList,
    /// The scans that the map keeps.
    pub(super) archive: ScanArchive,
    /// Replaced tables that readers and snapshots see; a writer's.
    pub(super) kept: KeptTables,
    /// How many files of an earlier writer opening has removed.
    pub(super) leftovers_removed: u64,
    /// The snapshots whose deletion by an earlier writer opening has completed.
    pub(super) snapshots_removed: Vec<SnapshotName>,
    /// Whether opening has brought `metadata.json` up to the log.
    has_replaced_metadata: bool,
    /// The snapshot that was opened in place of the map as it is.
    pub(super) opened_snapshot: Option<SnapshotName>,
    /// Held by a reader, so that a writer keeps what it sees.
    #[expect(dead_code, reason = "held for its drop")]
    shared_metadata: Option<SharedMetadata>,
}

struct SharedMetadata(#[expect(dead_code, reason = "held for its drop")] Mutex<Box<dyn DiskRead>>);

/// How often a reader begins to open a map again because a flush came in between.
const OPEN_ATTEMPTS: usize = 100;

impl TileStore {
    /// Makes an empty map in a folder that is missing, empty, or holds what an interrupted creation left.
    pub fn create(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata, map_id: [u8; 16]) -> Result<Self> {
        let layout = Layout::new(folder);
        place::check_place(&*disk, folder)?;
        map_folder::create_folders(&*disk, folder)?;
        // Before the lock, which leaves a file behind, and after it, when nobody else can begin a map here.
        map_folder::check_is_free(&*disk, folder)?;
        let lock = WriterLock::take(&*disk, &layout)?;
        map_folder::check_is_free(&*disk, folder)?;
        let mut metadata = metadata;
        if let Some(ext) = &mut metadata.ext {
            // Of another map, perhaps.
            (ext.snapshots, ext.scan_records, ext.catalog) = (None, None, None);
        }
        let commits = Commits::default();
        let log_path = layout.commit_log();
        let log = CommitLog::write_whole(&*disk, &log_path, map_id, &commits, &metadata.to_text())
            .map_err(|error| Error::io(&log_path, "write", error))?;
        let mut store = Self::new(disk, layout, metadata, Some(log), commits);
        store.committer.begin_writing(lock, false);
        store.write_metadata()?;
        Ok(store)
    }

    /// Opens a map for writing: takes the lock, then brings the files to the state of the last commit.
    pub fn open(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        // Before the lock, so that a folder without a map is left as it is.
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
            // Of a creation that was killed no name may be durable yet.
            store.files.sync_map_folder()?;
        }
        if store.map_id().is_some() {
            if store.is_metadata_behind() {
                // The last record may be one that a killed writer wrote and could not sync, and syncing the same bytes
                // again proves nothing: written anew, it is durable before it is acted upon.
                store.committer.replace_log(&store.files, store.versions.commits())?;
            }
            store.recover()?;
            if store.is_metadata_behind() {
                // Readers would wait for it. Those that the map has may see the last commit.
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

    /// Brings the files to the state of the last commit.
    fn recover(&mut self) -> Result<()> {
        let map_id = self.map_id().unwrap_or_default();
        let listed = self.committer.snapshots();
        let found = recover(&**self.disk(), self.layout(), self.commits(), map_id, listed)?;
        if listed.is_none() && !found.snapshots.found().is_empty() {
            // Of a version that did not list them: the next commit does.
            self.committer.adopt_snapshots(found.snapshots.found().clone());
        }
        self.kept.set_snapshots(found.snapshots);
        self.versions.set_orphans(found.orphans);
        self.leftovers_removed = found.removed;
        let removed = &self.versions.commits().last_removed;
        self.checkpoint = Checkpoint::of_leftovers(found.unrenamed, found.renamed, removed);
        self.run_checkpoint()?;
        if let Err(error) = self.release_scans() {
            // The files of deleted snapshots remain: as long as one does, deleting it again completes its deletion.
            log::warn!("kept scans that nothing needs remain: {error:#}");
            return Ok(());
        }
        let listed = self.committer.snapshots();
        self.snapshots_removed = remove_deleted_snapshots(&**self.disk(), self.layout(), map_id, listed)?;
        self.leftovers_removed += self.snapshots_removed.len() as u64;
        Ok(())
    }

    /// Opens a map for reading beside a writer: takes no lock and writes nothing. The store sees the last flush, and
    /// goes on seeing it while the writer flushes again.
    pub fn open_read_only(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        for attempt in 0..OPEN_ATTEMPTS {
            let (metadata, shared) = map_folder::read_metadata_shared(&*disk, &layout)?;
            let store = Self::read(disk.clone(), layout.clone(), metadata)?;
            // Only if it still is the present one has the writer seen, at its next flush, that it is read.
            let now = map_folder::read_metadata(&*disk, &layout)?;
            // If the log is newer, the writer cannot tell which flush is read. Wait until it replaces metadata.json,
            // unless it was killed.
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

    /// The tiles of a map whose own two files cannot be read, by what else is known of it; for reading only.
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
            // The upgrade was committed, but metadata.json was not replaced.
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
        // The log is the truth; the file may be older, if a crash came between the two.
        let metadata = match &commits.metadata {
            // What it says of tiles and numbers is as of the record that has it, which may be older than the last.
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
        let keeps_scans = metadata.ext.as_ref().is_some_and(|ext| ext.keeps_scans);
        Self {
            archive: ScanArchive::new(files.clone(), keeps_scans, KeptAsOf::last_of(&commits)),
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

    /// Where the map's files are kept.
    pub fn disk(&self) -> &Arc<dyn Disk> {
        self.files.disk()
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.files.folder()
    }

    /// Where the map's files are.
    pub fn layout(&self) -> &Layout {
        self.files.layout()
    }

    /// The metadata as last read or written.
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

    /// Which tiles there are on disk.
    pub fn tiles(&self) -> &TileVersions {
        &self.versions
    }

    /// The same, to note what is written.
    pub fn tiles_mut(&mut self) -> &mut TileVersions {
        &mut self.versions
    }

    /// Their tables, to be read.
    pub fn tables(&self) -> Tables<'_> {
        Tables::of(self)
    }

    /// The scans that the map keeps.
    pub fn archive(&self) -> &ScanArchive {
        &self.archive
    }

    /// The same, to keep more.
    pub fn archive_mut(&mut self) -> &mut ScanArchive {
        &mut self.archive
    }

    /// Whether `metadata.json` is older than the log: a crash came between the two.
    pub fn is_metadata_behind(&self) -> bool {
        self.committer.is_metadata_behind(self.commits().flush_number)
    }

    /// Whether a map that was of the original format when it was opened has a log now: a writer has begun to change it.
    pub fn is_upgraded_meanwhile(&self) -> Result<bool> {
        if self.map_id().is_some() {
            return Ok(false);
        }
        Ok(self.files.kind(&self.layout().commit_log())?.is_some())
    }

    /// How many files that an earlier writer left behind were removed when the store was opened.
    pub fn leftovers_removed(&self) -> u64 {
        self.leftovers_removed
    }

    /// Whether `metadata.json` was older than the log and was replaced when the store was opened.
    pub fn has_replaced_metadata(&self) -> bool {
        self.has_replaced_metadata
    }

    /// Bytes of memory of what is known of the tiles without reading them: some thirty a tile, and as many more for one
    /// with a version that is not committed.
    pub fn index_bytes(&self) -> usize {
        self.versions.bytes() + self.kept.bytes()
    }

    /// Bytes of memory that the next commit takes beside the index.
    pub fn commit_bytes(&self) -> usize {
        self.versions.commit_bytes() + self.scans.bytes() + self.archive.bytes()
    }
}

impl std::fmt::Debug for SharedMetadata {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SharedMetadata")
    }
}

/// An id's bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An id from its hexadecimal digits.
pub(crate) fn id_from_hex(digits: &str) -> Option<[u8; 16]> {
    let byte = |at: usize| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..16).map(byte).collect();
    bytes?.try_into().ok().filter(|_| digits.len() == 32)
}
