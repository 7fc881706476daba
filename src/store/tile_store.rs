use super::commit_log::{CommitLog, Commits};
use super::disk::{Disk, DiskRead, DiskWrite};
use super::layout::{Layout, TileFile};
use super::metadata::{Bounds, Metadata};
use super::recovery::recover;
use super::tile_stamp::{FileStamp, Stamping, TileStamp};
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::space::TileIndex;
use rustc_hash::{FxHashMap, FxHashSet};
use std::any::Any;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The tiles of a map on disk, and the one commit point that makes a flush whole.
///
/// A tile is written beside its committed version, as `*.next`. [`TileStore::commit`] makes all of them durable,
/// appends one synced record to the log (that is the commit), and renames them over the committed versions.
#[derive(Debug)]
pub struct TileStore {
    disk: Arc<dyn Disk>,
    layout: Layout,
    metadata: Metadata,
    /// `None` for a map of the seed's format, and for nothing else.
    log: Option<CommitLog>,
    commits: Commits,
    /// Versions written since the last commit.
    next: FxHashMap<TileIndex, TileStamp>,
    /// Committed versions that still have their `*.next` names.
    unrenamed: FxHashSet<TileIndex>,
    /// Tile folders that the log does not know: never read, never overwritten.
    strays: FxHashSet<TileIndex>,
    /// Tiles of a map of the seed's format, which has no log.
    foreign: FxHashSet<TileIndex>,
    /// Held while the store may write.
    lock: Option<Lock>,
}

struct Lock(#[expect(dead_code, reason = "held for its drop")] Box<dyn Any + Send + Sync>);

/// A tile's table as it is stored, ready to be read.
pub struct StoredTile {
    /// Where it is.
    pub path: PathBuf,
    /// The bytes; stamped as they pass.
    pub input: Stamping<Box<dyn DiskRead>>,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// What the log says of the tile; `None` in a map of the seed's format.
    pub stamp: Option<TileStamp>,
}

/// A log longer than this many bytes, and than four times what one record of the whole map takes, is compacted.
const COMPACT_LOG_BYTES: u64 = 1 << 20;

impl TileStore {
    /// Makes an empty map in a folder that is missing, empty, or holds what an interrupted creation left.
    pub fn create(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata, map_id: [u8; 16]) -> Result<Self> {
        let layout = Layout::new(folder);
        create_folders(&*disk, folder)?;
        // Before the lock, which leaves a file behind, and after it, when nobody else can begin a map here.
        check_is_free(&*disk, folder)?;
        let lock = lock(&*disk, &layout)?;
        check_is_free(&*disk, folder)?;
        let commits = Commits::default();
        let log_path = layout.commit_log();
        let log = CommitLog::write_whole(&*disk, &log_path, map_id, &commits)
            .map_err(|error| Error::io(&log_path, "write", error))?;
        let mut store = Self::new(disk, layout, metadata, Some(log), commits, Some(lock));
        store.write_metadata()?;
        Ok(store)
    }

    /// Opens a map for writing: takes the lock, then brings the files to the state of the last commit.
    pub fn open(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        // Before the lock, so that a folder without a map is left as it is.
        read_metadata(&*disk, &layout)?;
        let lock = lock(&*disk, &layout)?;
        let mut store = Self::read(disk, layout, Some(lock))?;
        if store.log.is_some() {
            store.strays = recover(&*store.disk, &store.layout, &store.commits)?;
        }
        Ok(store)
    }

    /// Opens a map for reading beside a writer: takes no lock and writes nothing.
    pub fn open_read_only(disk: Arc<dyn Disk>, folder: &Path) -> Result<Self> {
        Self::read(disk, Layout::new(folder), None)
    }

    fn read(disk: Arc<dyn Disk>, layout: Layout, lock: Option<Lock>) -> Result<Self> {
        let metadata = read_metadata(&*disk, &layout)?;
        let Some(ext) = &metadata.ext else {
            let foreign = list_foreign_tiles(&*disk, &layout)?;
            let mut store = Self::new(disk, layout, metadata, None, Commits::default(), lock);
            store.foreign = foreign;
            return Ok(store);
        };
        let path = layout.commit_log();
        let mut input = disk.open(&path).map_err(|error| Error::io(&path, "open", error))?;
        let bytes = input.file_bytes();
        let (log, commits) = CommitLog::read(&mut input, bytes).map_err(|error| error.in_map(&path, None))?;
        let damaged = |reason: String| Err(FormatError::at_offset(log.bytes(), reason).in_map(&path, None));
        if hex(&log.map_id()) != ext.map_id {
            return damaged(format!("the log belongs to map {}, not to {}", hex(&log.map_id()), ext.map_id));
        }
        if commits.flush_number < ext.flush_number {
            let (log, metadata) = (commits.flush_number, ext.flush_number);
            return damaged(format!("the log ends at flush {log}, metadata.json at flush {metadata}"));
        }
        Ok(Self::new(disk, layout, metadata, Some(log), commits, lock))
    }

    fn new(
        disk: Arc<dyn Disk>,
        layout: Layout,
        metadata: Metadata,
        log: Option<CommitLog>,
        commits: Commits,
        lock: Option<Lock>,
    ) -> Self {
        let (next, unrenamed, strays, foreign) = Default::default();
        Self { disk, layout, metadata, log, commits, next, unrenamed, strays, foreign, lock }
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

    /// Whether the tile has a version on disk, committed or not.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.next.contains_key(&tile)
            || self.commits.tiles.contains_key(&tile)
            || self.foreign.contains(&tile)
            || self.strays.contains(&tile)
    }

    /// The tiles that have a version on disk, in no particular order.
    pub fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        let uncommitted = self.next.keys().filter(|tile| !self.commits.tiles.contains_key(tile));
        self.commits.tiles.keys().chain(&self.foreign).chain(uncommitted).copied()
    }

    /// What is known of the latest version of a tile on disk without reading it.
    pub fn stamp(&self, tile: TileIndex) -> Option<TileStamp> {
        self.next.get(&tile).or_else(|| self.commits.tiles.get(&tile)).copied()
    }

    /// Whether this store reads beside a writer that may be in the middle of a flush: a committed version may then
    /// still have its `*.next` name.
    pub fn is_read_only(&self) -> bool {
        self.lock.is_none()
    }

    /// Opens the latest version of a tile's table; `None` if the tile has none.
    ///
    /// # Errors
    ///
    /// A file that the log names and that is missing, and a tile folder that the log does not name.
    pub fn open_table(&self, tile: TileIndex) -> Result<Option<StoredTile>> {
        let is_next = self.next.contains_key(&tile) || self.unrenamed.contains(&tile);
        self.open_version(tile, is_next)
    }

    /// Opens the `*.next` version of a tile's table, which a reader beside a writer tries after the other.
    ///
    /// # Errors
    ///
    /// As for [`TileStore::open_table`].
    pub fn open_next_table(&self, tile: TileIndex) -> Result<Option<StoredTile>> {
        self.open_version(tile, true)
    }

    fn open_version(&self, tile: TileIndex, is_next: bool) -> Result<Option<StoredTile>> {
        if self.strays.contains(&tile) {
            let path = self.layout.current(tile, TileFile::Table);
            let reason = "commits.log does not name this tile; move its folder away or repair the map";
            return Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)));
        }
        let stamp = self.stamp(tile);
        if stamp.is_none() && !self.foreign.contains(&tile) {
            return Ok(None);
        }
        let path = if is_next {
            self.layout.next(tile, TileFile::Table)
        } else {
            self.layout.current(tile, TileFile::Table)
        };
        match self.disk.open(&path) {
            Ok(input) => {
                let bytes = input.file_bytes();
                Ok(Some(StoredTile { path, input: Stamping::new(input), bytes, stamp }))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let reason = "the file is missing, and the map holds this tile";
                Err(FormatError::at_offset(0, reason).in_map(&path, Some(tile)))
            }
            Err(error) => Err(Error::io(&path, "open", error)),
        }
    }

    /// Writes the next version of one of a tile's files; the committed version stays as it is.
    pub fn write_next(
        &mut self,
        tile: TileIndex,
        file: TileFile,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<FileStamp> {
        // A committed version under its `*.next` name is the only one: give it its name before writing there.
        self.finish_renames()?;
        let folder = self.layout.tile_folder(tile);
        if self.disk.kind(&folder).map_err(|error| Error::io(&folder, "look at", error))?.is_none() {
            self.disk.create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
        }
        let path = self.layout.next(tile, file);
        let stamp_file = || {
            let mut out = Stamping::new(BufWriter::with_capacity(1 << 16, self.disk.create(&path)?));
            write(&mut out)?;
            out.flush()?;
            Ok(out.finish().0)
        };
        stamp_file().map_err(|error| Error::io(&path, "write", error))
    }

    /// Notes that the next version of a tile is written, both files.
    pub fn note_next(&mut self, tile: TileIndex, stamp: TileStamp) {
        self.next.insert(tile, stamp);
    }

    /// Commits every version written since the last commit. When this returns they are durable, and only they.
    ///
    /// `metadata` gives the map's parameters; bounds and flush number are filled in here. After an error the
    /// flush has happened or not, as a whole; calling again finishes it.
    pub fn commit(&mut self, metadata: Metadata, scan_number: u64) -> Result<()> {
        self.finish_renames()?;
        let log_path = self.layout.commit_log();
        let mut log = match self.log {
            Some(log) => log,
            None => return Err(Error::argument("map", "a map of the seed's format must be adopted first")),
        };
        let mut changed: Vec<_> = self.next.iter().map(|(&tile, &stamp)| (tile, stamp)).collect();
        changed.sort_unstable_by_key(|&(tile, _)| tile);
        if !changed.is_empty() || scan_number != self.commits.scan_number {
            self.sync_next(&changed)?;
            let flush_number = self.commits.flush_number + 1;
            log.append(&*self.disk, &log_path, flush_number, scan_number, &changed)
                .map_err(|error| Error::io(&log_path, "append to", error))?;
            // Committed. What follows only tidies up, and opening the map would do it too.
            self.log = Some(log);
            self.next.clear();
            self.commits.flush_number = flush_number;
            self.commits.scan_number = scan_number;
            self.foreign.clear();
            self.unrenamed.extend(changed.iter().map(|&(tile, _)| tile));
            self.commits.tiles.extend(changed);
            self.finish_renames()?;
        }
        self.metadata = metadata;
        self.write_metadata()?;
        self.compact_log()
    }

    fn sync_next(&self, changed: &[(TileIndex, TileStamp)]) -> Result<()> {
        let sync =
            |path: &Path, result: io::Result<()>| result.map_err(|error| Error::io(path, "sync", error));
        for &(tile, _) in changed {
            for file in TileFile::IN_ORDER {
                let path = self.layout.next(tile, file);
                sync(&path, self.disk.sync_file(&path))?;
            }
            let folder = self.layout.tile_folder(tile);
            sync(&folder, self.disk.sync_folder(&folder))?;
        }
        // New tile folders.
        sync(self.layout.folder(), self.disk.sync_folder(self.layout.folder()))
    }

    /// Gives committed versions their names.
    fn finish_renames(&mut self) -> Result<()> {
        let mut tiles: Vec<TileIndex> = self.unrenamed.iter().copied().collect();
        tiles.sort_unstable();
        for tile in tiles {
            for file in TileFile::IN_ORDER {
                let (next, current) = (self.layout.next(tile, file), self.layout.current(tile, file));
                match self.disk.rename(&next, &current) {
                    Err(error) if error.kind() == io::ErrorKind::NotFound => {} // Done by an earlier attempt.
                    result => result.map_err(|error| Error::io(&next, "rename", error))?,
                }
            }
            let folder = self.layout.tile_folder(tile);
            self.disk.sync_folder(&folder).map_err(|error| Error::io(&folder, "sync", error))?;
            self.unrenamed.remove(&tile);
        }
        Ok(())
    }

    /// Gives a map of the seed's format an id and a log, so that it can be written to. Its tiles count as unread
    /// until they have been written again.
    pub fn adopt(&mut self, map_id: [u8; 16]) -> Result<()> {
        if self.log.is_none() {
            let path = self.layout.commit_log();
            let log = CommitLog::write_whole(&*self.disk, &path, map_id, &self.commits)
                .map_err(|error| Error::io(&path, "write", error))?;
            self.log = Some(log);
        }
        Ok(())
    }

    fn write_metadata(&mut self) -> Result<()> {
        self.metadata.bounds = Bounds::of(self.tiles());
        if let Some(ext) = &mut self.metadata.ext {
            ext.empty = self.metadata.bounds.is_none();
            ext.flush_number = self.commits.flush_number;
            ext.scan_number = self.commits.scan_number;
        }
        let text = self.metadata.to_text();
        self.replace(&self.layout.metadata(), |out| out.write_all(text.as_bytes()))
    }

    fn compact_log(&mut self) -> Result<()> {
        let Some(log) = self.log else { return Ok(()) };
        let whole_bytes = (self.commits.tiles.len() * (12 + TileStamp::BYTES)) as u64;
        if log.bytes() < COMPACT_LOG_BYTES.max(4 * whole_bytes) {
            return Ok(());
        }
        let path = self.layout.commit_log();
        let next = next_of(&path);
        let compacted = CommitLog::write_whole(&*self.disk, &next, log.map_id(), &self.commits)
            .map_err(|error| Error::io(&next, "write", error))?;
        self.disk.rename(&next, &path).map_err(|error| Error::io(&next, "rename", error))?;
        self.log = Some(compacted);
        self.disk.sync_folder(self.folder()).map_err(|error| Error::io(self.folder(), "sync", error))
    }

    /// Replaces a file of the map's own folder as a whole: written beside, synced, renamed, the folder synced.
    fn replace(&self, path: &Path, write: impl FnOnce(&mut dyn DiskWrite) -> io::Result<()>) -> Result<()> {
        let next = next_of(path);
        let replaced = || {
            let mut out = self.disk.create(&next)?;
            write(&mut *out)?;
            out.sync()?;
            drop(out);
            self.disk.rename(&next, path)?;
            self.disk.sync_folder(self.layout.folder())
        };
        replaced().map_err(|error| Error::io(path, "replace", error))
    }
}

impl std::fmt::Debug for Lock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Lock")
    }
}

/// An id's bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn next_of(path: &Path) -> PathBuf {
    path.with_added_extension("next")
}

fn lock(disk: &dyn Disk, layout: &Layout) -> Result<Lock> {
    let path = layout.lock();
    match disk.lock(&path).map_err(|error| Error::io(&path, "lock", error))? {
        Some(lock) => Ok(Lock(lock)),
        None => Err(Error::Locked { path: layout.folder().to_owned() }),
    }
}

/// A folder for a new map holds nothing but what an interrupted creation may have left.
fn check_is_free(disk: &dyn Disk, folder: &Path) -> Result<()> {
    let names = disk.list(folder).map_err(|error| Error::io(folder, "list", error))?;
    let leftovers = ["writer.lock", "commits.log", "metadata.json.next"];
    if names.iter().all(|name| leftovers.contains(&name.as_str())) {
        return Ok(());
    }
    let hint = "open it, name --append to add scans to it, or choose an empty folder";
    Err(Error::AlreadyExists { path: folder.to_owned(), hint })
}

fn create_folders(disk: &dyn Disk, folder: &Path) -> Result<()> {
    if disk.kind(folder).is_ok_and(|kind| kind.is_some()) {
        return Ok(());
    }
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    create_folders(disk, parent)?;
    disk.create_folder(folder).map_err(|error| Error::io(folder, "create", error))?;
    // A map must not vanish with the name of its folder.
    disk.sync_folder(parent).map_err(|error| Error::io(parent, "sync", error))
}

fn read_metadata(disk: &dyn Disk, layout: &Layout) -> Result<Metadata> {
    let path = layout.metadata();
    let mut input = match disk.open(&path) {
        Ok(input) => input,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(Error::NoMap { path: layout.folder().to_owned() });
        }
        Err(error) => return Err(Error::io(&path, "open", error)),
    };
    // Ours has a few hundred bytes.
    const LIMIT: u64 = 1 << 20;
    if input.file_bytes() > LIMIT {
        return Err(FormatError::at_offset(LIMIT, "too long for a map's metadata").in_map(&path, None));
    }
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|error| Error::io(&path, "read", error))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        FormatError::at_offset(error.utf8_error().valid_up_to() as u64, "not UTF-8 text").in_map(&path, None)
    })?;
    let metadata =
        Metadata::from_text(&text).map_err(|error| DecodeError::from(error).in_map(&path, None))?;
    Ok(metadata)
}

fn list_foreign_tiles(disk: &dyn Disk, layout: &Layout) -> Result<FxHashSet<TileIndex>> {
    let names = disk.list(layout.folder()).map_err(|error| Error::io(layout.folder(), "list", error))?;
    let mut tiles = FxHashSet::default();
    for tile in names.iter().filter_map(|name| super::tile_of_folder(name)) {
        let path = layout.current(tile, TileFile::Table);
        if disk.kind(&path).map_err(|error| Error::io(&path, "look at", error))?.is_some() {
            tiles.insert(tile);
        }
    }
    Ok(tiles)
}
