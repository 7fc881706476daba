use super::commit_log::{CommitLog, Commits};
use super::disk::{Disk, DiskRead};
use super::layout::{Layout, TileFile};
use super::map_folder::{self, Lock};
use super::metadata::Metadata;
use super::place;
use super::readers::Readers;
use super::recovery::{recover, remove_uncommitted};
use super::snapshot_list::SnapshotList;
use super::snapshot_name::SnapshotName;
use super::snapshots::{Snapshots, seen_by};
use super::tile_location::{StoredTile, TileLocation};
use super::tile_stamp::TileStamp;
use crate::error::{Error, FormatError, Result};
use crate::space::{TileIndex, TileTable};
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The tiles of a map on disk, and the one commit point that makes a flush whole.
///
/// A tile is written beside its committed version, as `*.next`. [`TileStore::commit`] makes all of them durable,
/// appends one synced record to the log (that is the commit), and renames them over the committed versions.
#[derive(Debug)]
pub struct TileStore {
    pub(super) disk: Arc<dyn Disk>,
    pub(super) layout: Layout,
    pub(super) metadata: Metadata,
    /// `None` for a map of the seed's format, and for nothing else.
    pub(super) log: Option<CommitLog>,
    pub(super) commits: Commits,
    /// Whether the log ends with its last commit. After a failed append its end is unknown.
    pub(super) is_log_settled: bool,
    /// Flush number in the `metadata.json` on disk; `None` in the seed's format. A crash can leave it behind the log.
    pub(super) written_flush: Option<u64>,
    /// Versions written since the last commit.
    pub(super) next: TileTable<TileStamp>,
    /// Versions of which a sync failed: the medium may hold anything, whatever later syncs say.
    pub(super) suspect: FxHashSet<TileIndex>,
    /// Tiles that the next commit takes out of the map.
    pub(super) removed: FxHashSet<TileIndex>,
    /// Committed versions that still have their `*.next` names.
    pub(super) unrenamed: TileTable<()>,
    /// Tiles whose versions have their names, but perhaps not on the medium.
    pub(super) renamed: TileTable<()>,
    /// Tiles that a commit took out of the map, with files that are still there or whose absence may not be durable.
    pub(super) unremoved: BTreeSet<TileIndex>,
    /// Tile folders that the log does not know: never read, never overwritten.
    pub(super) strays: FxHashSet<TileIndex>,
    /// How many files of an earlier writer opening has removed.
    leftovers_removed: u64,
    /// Tiles of a map of the seed's format, which has no log.
    pub(super) foreign: FxHashSet<TileIndex>,
    /// A writer's.
    pub(super) readers: Readers,
    /// A writer's.
    pub(super) snapshots: Snapshots,
    /// The map's snapshots; `None` where nothing says which there are.
    pub(super) listed: Option<SnapshotList>,
    /// Whether the log says so too.
    pub(super) is_list_logged: bool,
    /// A snapshot that is committed and may not have its name yet.
    pub(super) unnamed_snapshot: Option<SnapshotName>,
    /// A snapshot whose deletion is committed and whose file may be there still.
    pub(super) deleted_snapshot: Option<SnapshotName>,
    /// The snapshot that was opened in place of the map as it is.
    pub(super) snapshot: Option<SnapshotName>,
    /// Held while the store may write.
    pub(super) lock: Option<Lock>,
    /// Held by a reader, so that a writer keeps what it sees.
    #[expect(dead_code, reason = "held for its drop")]
    shared_metadata: Option<SharedMetadata>,
}

struct SharedMetadata(#[expect(dead_code, reason = "held for its drop")] Box<dyn DiskRead>);

/// What a commit takes for each tile that it changes, beside the index: its place among those that the last record names and
/// among those that wait for their names.
const COMMIT_BYTES_OF_TILE: usize = 30;

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
        let lock = Lock::take(&*disk, &layout)?;
        map_folder::check_is_free(&*disk, folder)?;
        let mut metadata = metadata;
        if let Some(ext) = &mut metadata.ext {
            // Of another map, perhaps.
            ext.snapshots = None;
        }
        let commits = Commits::default();
        let log_path = layout.commit_log();
        let log = CommitLog::write_whole(&*disk, &log_path, map_id, &commits, &metadata.to_text())
            .map_err(|error| Error::io(&log_path, "write", error))?;
        let mut store = Self::new(disk, layout, metadata, Some(log), commits);
        store.lock = Some(lock);
        store.write_metadata()?;
        Ok(store)
    }

    /// Opens a map for writing: takes the lock, then brings the files to the state of the last commit.
    pub fn open(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        // Before the lock, so that a folder without a map is left as it is.
        map_folder::read_metadata(&*disk, &layout)?;
        let lock = Lock::take(&*disk, &layout)?;
        let metadata = map_folder::read_metadata(&*disk, &layout)?;
        let mut store = Self::read(disk, layout, metadata)?;
        store.lock = Some(lock);
        let path = store.layout.metadata();
        let watch = store.disk.watch(&path).map_err(|error| Error::io(&path, "open", error))?;
        store.readers.watch(store.written_flush.unwrap_or_default(), watch);
        if store.commits.flush_number == 0 {
            // Of a creation that was killed no name may be durable yet.
            store.sync_folder(folder)?;
        }
        if store.log.is_some() {
            store.is_log_settled = store.commits.torn.is_none();
            if store.is_metadata_behind() {
                // The last record may be one that a killed writer wrote and could not sync, and syncing the same bytes
                // again proves nothing: written anew, it is durable before it is acted upon.
                store.replace_log()?;
            }
            let map_id = store.map_id().unwrap_or_default();
            let (disk, layout, listed) = (&*store.disk, &store.layout, store.listed.as_ref());
            let leftovers = recover(disk, layout, &store.commits, map_id, listed)?;
            store.snapshots = leftovers.snapshots;
            if store.listed.is_none() && !store.snapshots.found().is_empty() {
                // Of a version that did not list them: the next commit does.
                store.listed = Some(store.snapshots.found().clone());
                store.is_list_logged = false;
            }
            store.strays = leftovers.strays;
            store.leftovers_removed = leftovers.removed;
            store.unrenamed = leftovers.unrenamed;
            store.renamed = leftovers.renamed;
            store.unremoved = store.commits.last_removed.iter().copied().collect();
            store.put_in_place()?;
        } else {
            store.leftovers_removed = remove_uncommitted(&*store.disk, &store.layout, &store.foreign)?;
        }
        Ok(store)
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
            // Where the log is ahead of it, the writer does not know which flush is read: a moment later it does, unless it was
            // killed.
            let is_known = !store.is_metadata_behind() || attempt + 1 >= OPEN_ATTEMPTS / 2;
            if now.ext.map(|ext| ext.flush_number) == store.written_flush && is_known {
                return Ok(Self { shared_metadata: Some(SharedMetadata(shared)), ..store });
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
            // Adopted, and ended before the metadata was replaced.
            (None, Some((log, commits))) if commits.flush_number > 0 => (log, commits),
            (None, _) => {
                let foreign = map_folder::list_foreign_tiles(&*disk, &layout)?;
                return Ok(Self { foreign, ..Self::new(disk, layout, metadata, None, Commits::default()) });
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
        Ok(Self { written_flush, ..Self::new(disk, layout, metadata, Some(log), commits) })
    }

    pub(super) fn new(
        disk: Arc<dyn Disk>,
        layout: Layout,
        metadata: Metadata,
        log: Option<CommitLog>,
        commits: Commits,
    ) -> Self {
        let layout = layout.with_storage(metadata.storage());
        let (next, suspect, removed, unrenamed, renamed) = Default::default();
        let (unremoved, strays, foreign, readers, snapshots) = Default::default();
        let listed = metadata.ext.as_ref().and_then(|ext| ext.snapshots.clone());
        Self {
            disk,
            layout,
            metadata,
            log,
            commits,
            is_log_settled: true,
            written_flush: None,
            next,
            suspect,
            removed,
            unrenamed,
            renamed,
            unremoved,
            strays,
            leftovers_removed: 0,
            foreign,
            readers,
            snapshots,
            listed,
            is_list_logged: true,
            unnamed_snapshot: None,
            deleted_snapshot: None,
            snapshot: None,
            lock: None,
            shared_metadata: None,
        }
    }

    /// Where the map's files are kept.
    pub fn disk(&self) -> &Arc<dyn Disk> {
        &self.disk
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        self.layout.folder()
    }

    /// Where the map's files are.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The metadata as last read or written.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The map's id; `None` for a map of the seed's format.
    pub fn map_id(&self) -> Option<[u8; 16]> {
        self.log.map(|log| log.map_id())
    }

    /// The last commit.
    pub fn commits(&self) -> &Commits {
        &self.commits
    }

    /// Whether `metadata.json` is older than the log: a crash came between the two.
    pub fn is_metadata_behind(&self) -> bool {
        self.log.is_some() && self.written_flush != Some(self.commits.flush_number)
    }

    /// Whether a map that was of the seed's format when it was opened has a log now: a writer has begun to change it.
    pub fn is_adopted_meanwhile(&self) -> Result<bool> {
        if self.log.is_some() {
            return Ok(false);
        }
        let path = self.layout.commit_log();
        let kind = self.disk.kind(&path).map_err(|error| Error::io(&path, "look at", error))?;
        Ok(kind.is_some())
    }

    /// The tile folders that the log does not name, in order.
    pub fn strays(&self) -> Vec<TileIndex> {
        let mut strays: Vec<_> = self.strays.iter().copied().collect();
        strays.sort_unstable();
        strays
    }

    /// How many files that an earlier writer left behind were removed when the store was opened.
    pub fn leftovers_removed(&self) -> u64 {
        self.leftovers_removed
    }

    /// Whether the tile has a version on disk, committed or not.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.stamp(tile).is_some() || self.foreign.contains(&tile) || self.strays.contains(&tile)
    }

    /// The tiles that have a version on disk, in no particular order.
    pub fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        let uncommitted = self.next.tiles().filter(|tile| !self.commits.tiles.contains(*tile));
        let committed = self.commits.tiles.tiles().filter(|tile| !self.removed.contains(tile));
        committed.chain(self.foreign.iter().copied()).chain(uncommitted)
    }

    /// How many tiles have a version on disk.
    pub fn count_tiles(&self) -> usize {
        let uncommitted = self.next.tiles().filter(|tile| !self.commits.tiles.contains(*tile)).count();
        self.commits.tiles.len() - self.removed.len() + self.foreign.len() + uncommitted
    }

    /// What is known of the latest version of each tile, in no particular order.
    pub fn stamps(&self) -> impl Iterator<Item = TileStamp> {
        let is_latest = |tile: TileIndex| !self.removed.contains(&tile) && !self.next.contains(tile);
        let committed = self.commits.tiles.iter().filter(move |(tile, _)| is_latest(*tile));
        self.next.values().chain(committed.map(|(_, stamp)| stamp))
    }

    /// Bytes of memory of what is known of the tiles without reading them: some thirty a tile, and as many more for one with
    /// a version that is not committed.
    pub fn index_bytes(&self) -> usize {
        self.commits.tiles.bytes()
            + self.commits.last_changed.bytes()
            + self.next.bytes()
            + (self.foreign.capacity() + self.strays.capacity()) * 8 / 7 * (size_of::<TileIndex>() + 1)
            + self.snapshots.bytes()
    }

    /// Bytes of memory that the next commit takes beside the index.
    pub fn commit_bytes(&self) -> usize {
        self.next.len() * COMMIT_BYTES_OF_TILE
    }

    /// What is known of the latest version of a tile on disk without reading it.
    pub fn stamp(&self, tile: TileIndex) -> Option<TileStamp> {
        let committed = || self.commits.tiles.get(tile).filter(|_| !self.removed.contains(&tile));
        self.next.get(tile).or_else(committed)
    }

    /// Opens the latest version of a tile's table; `None` if the tile has none.
    ///
    /// # Errors
    ///
    /// A file that the log names and that is missing, and a tile folder that the log does not name.
    pub fn open_table(&self, tile: TileIndex) -> Result<Option<StoredTile>> {
        let path = match &self.snapshot {
            Some(_) => self.path_in_snapshot(tile)?,
            None => self.latest_path(tile),
        };
        self.open_version(tile, path)
    }

    /// Where a snapshot's version of a table is while no writer is at work.
    fn path_in_snapshot(&self, tile: TileIndex) -> Result<PathBuf> {
        let kept = self.kept_tables(tile)?;
        Ok(match seen_by(Some(&kept), self.commits.flush_number) {
            Some(flush_number) => self.layout.kept(tile, flush_number),
            None => self.layout.current(tile, TileFile::Table),
        })
    }

    /// The flushes as of which tables of a tile are kept beside the one in place.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn kept_tables(&self, tile: TileIndex) -> Result<BTreeSet<u64>> {
        let folder = self.layout.tile_folder(tile);
        match self.disk.list(&folder) {
            // It tells when the table is opened.
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                Ok(BTreeSet::new())
            }
            Err(error) => Err(Error::io(&folder, "list", error)),
            Ok(names) => Ok(names.iter().filter_map(|name| self.layout.flush_of_kept(name)).collect()),
        }
    }

    /// Other places where a reader beside a writer may find the version of a tile's table that it sees: committed and
    /// waiting for its name, or already replaced and kept for readers. Empty for a writer.
    ///
    /// # Errors
    ///
    /// A folder that cannot be listed.
    pub fn other_places(&self, tile: TileIndex) -> Result<Vec<PathBuf>> {
        if self.lock.is_some() {
            return Ok(Vec::new());
        }
        let kept = self.kept_tables(tile)?.split_off(&self.commits.flush_number);
        let kept = kept.into_iter().map(|flush_number| self.layout.kept(tile, flush_number));
        let places =
            kept.chain([self.layout.next(tile, TileFile::Table), self.layout.current(tile, TileFile::Table)]);
        Ok(places.collect())
    }

    /// Opens one of [`TileStore::other_places`].
    ///
    /// # Errors
    ///
    /// As for [`TileStore::open_table`].
    pub fn open_version(&self, tile: TileIndex, path: PathBuf) -> Result<Option<StoredTile>> {
        if self.strays.contains(&tile) {
            let reason = "commits.log does not name this tile";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        let stamp = self.stamp(tile);
        if stamp.is_none() && !self.foreign.contains(&tile) {
            return Ok(None);
        }
        self.location_at(tile, path, stamp).open().map(Some)
    }

    /// Where the latest version of a tile's table is that is known to be there, for another thread to open it before the
    /// next commit.
    pub fn location(&self, tile: TileIndex) -> Option<TileLocation> {
        let stamp = self.stamp(tile)?;
        Some(self.location_at(tile, self.latest_path(tile), Some(stamp)))
    }

    fn location_at(&self, tile: TileIndex, path: PathBuf, stamp: Option<TileStamp>) -> TileLocation {
        let map_id = stamp.and_then(|_| self.map_id());
        let folder = self.layout.tile_folder(tile);
        TileLocation {
            disk: self.disk.clone(),
            tile,
            folder,
            path,
            map_id,
            stamp,
            storage: self.layout.storage(),
        }
    }

    fn latest_path(&self, tile: TileIndex) -> PathBuf {
        match self.next.contains(tile) || self.unrenamed.contains(tile) {
            true => self.layout.next(tile, TileFile::Table),
            false => self.layout.current(tile, TileFile::Table),
        }
    }
}

impl std::fmt::Debug for SharedMetadata {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SharedMetadata")
    }
}

/// An id's bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An id from its hexadecimal digits.
pub(crate) fn id_from_hex(digits: &str) -> Option<[u8; 16]> {
    let byte = |at: usize| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..16).map(byte).collect();
    bytes?.try_into().ok().filter(|_| digits.len() == 32)
}
