use crate::error::{Error, Result, is_of_medium};
use crate::space::{TileIndex, TileTable};
use crate::store::commit::commits::Commits;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::{Layout, OWN_NEXT, REPLACEMENT, SPILL, tile_of_folder};
use crate::store::map_folder;
use crate::store::snapshots::seen_tables::{KeptFlushes, SeenTables};
use crate::store::snapshots::snapshot_file::Snapshot;
use crate::store::snapshots::snapshot_list::SnapshotList;
use crate::store::snapshots::snapshot_name::SnapshotName;
use crate::store::tiles::file_checksum::{Checksumming, FileChecksum};
use crate::store::tiles::tile_version::TileVersion;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;

/// Files to keep after a crash, and the number of removed ones.
#[derive(Debug, Default)]
pub(in crate::store) struct Leftovers {
    /// Committed versions that still have their `*.next` names.
    pub unrenamed: TileTable<()>,
    /// Tiles of the last commit that are renamed, but perhaps not durably.
    pub renamed: TileTable<()>,
    /// Tile folders with files that the log does not name.
    pub orphans: FxHashSet<TileIndex>,
    /// Tables that the snapshots of the map use.
    pub snapshots: SeenTables,
    /// Number of removed files.
    pub removed: u64,
}

/// Searches the folders of a map for the remains of a terminated writer. Removes uncommitted versions and tables kept
/// for readers, and finds committed versions that are not renamed yet.
///
/// Can be repeated, and interrupted at any point.
///
/// Unreadable files and folders are left unchanged, and recovery continues. They are reported when their tile is read.
pub(in crate::store) fn recover(
    disk: &dyn Disk,
    layout: &Layout,
    commits: &Commits,
    map_id: [u8; 16],
    listed: Option<&SnapshotList>,
) -> Result<Leftovers> {
    let removed: FxHashSet<TileIndex> = commits.last_removed.iter().copied().collect();
    let mut leftovers = Leftovers::default();
    let (mut kept, mut empty_folders) = (KeptFlushes::default(), Vec::new());
    leftovers.removed += settle_own_files(disk, layout)?;
    for name in list(disk, layout.folder())? {
        let Some(tile) = tile_of_folder(&name) else { continue };
        let version = commits.tiles.get(tile);
        let is_of_last_commit = commits.last_changed.contains(tile);
        let (state, flushes) =
            look_at_tile(disk, layout, tile, version, is_of_last_commit, &mut leftovers.removed)?;
        if !flushes.is_empty() {
            kept.insert(tile, flushes);
        }
        match state {
            // The names may not be durable if the writer was killed before it synced them.
            State::Whole if is_of_last_commit => {
                leftovers.renamed.insert(tile, ());
            }
            State::Whole | State::Unreadable => {}
            State::Unrenamed => {
                leftovers.unrenamed.insert(tile, ());
            }
            // An empty folder is left of a tile that was never committed, or of a removed tile.
            State::Empty if version.is_none() => empty_folders.push(tile),
            State::Empty => {}
            // The checkpoint completes the removal of this tile.
            State::Orphan if removed.contains(&tile) => {}
            State::Orphan => {
                leftovers.orphans.insert(tile);
            }
        }
    }
    settle_snapshots(disk, layout, map_id, listed, &mut leftovers.removed)?;
    leftovers.snapshots = SeenTables::read_all(disk, layout, map_id, commits, listed, &kept)?;
    remove_unseen(disk, layout, &kept, &mut leftovers)?;
    for tile in empty_folders.into_iter().filter(|tile| !leftovers.snapshots.pinned().contains_key(tile)) {
        let path = layout.tile_folder(tile);
        tolerate(map_folder::remove_unless_used(disk, &path), &path, "remove")?;
    }
    Ok(leftovers)
}

/// Removes unused `*.next` files in the map's folder. If the damaged list of scans is in quarantine, its replacement is
/// renamed instead. Returns the number of removed files.
pub(in crate::store) fn settle_own_files(disk: &dyn Disk, layout: &Layout) -> Result<u64> {
    let mut removed = 0;
    for name in OWN_NEXT {
        remove(disk, &layout.folder().join(name), &mut removed)?;
    }
    let (scans, next) = (layout.scans(), layout.scans_next());
    match kind(disk, &scans)? {
        // The replacement was synced before the damaged file was moved.
        None if matches!(kind(disk, &next)?, Some(EntryKind::File(_))) => {
            tolerate(disk.rename(&next, &scans), &next, "rename")?;
            tolerate(disk.sync_folder(layout.folder()), layout.folder(), "sync")?;
        }
        _ => remove(disk, &next, &mut removed)?,
    }
    Ok(removed)
}

/// Renames the file of a snapshot that the log names, and removes one that it does not name.
fn settle_snapshots(
    disk: &dyn Disk,
    layout: &Layout,
    map_id: [u8; 16],
    listed: Option<&SnapshotList>,
    removed: &mut u64,
) -> Result<()> {
    let folder = layout.snapshots();
    if kind(disk, &folder)? != Some(EntryKind::Folder) {
        return Ok(());
    }
    let next = layout.snapshot_next();
    if matches!(kind(disk, &next)?, Some(EntryKind::File(_))) {
        let mut names = listed.into_iter().flat_map(SnapshotList::names);
        let is_due = |name: &&SnapshotName| {
            matches!(disk.kind(&layout.snapshot(name)), Ok(None))
                && Snapshot::read(disk, layout, name, map_id, listed).is_ok()
        };
        match names.find(is_due) {
            Some(name) => tolerate(disk.rename(&next, &layout.snapshot(name)), &next, "rename")?,
            None => remove(disk, &next, removed)?,
        }
    }
    // Without a list of snapshots, a deletion that a killed writer did not sync could be undone by a power failure, and
    // the snapshot would lack its tables.
    tolerate(disk.sync_folder(&folder), &folder, "sync")
}

/// Returns whether a file in the folder of snapshots is left over from an interrupted deletion: it contains its own name,
/// and the log does not list it. Foreign files are kept.
fn is_deleted_snapshot(
    disk: &dyn Disk,
    layout: &Layout,
    map_id: [u8; 16],
    listed: &SnapshotList,
    name: &SnapshotName,
) -> bool {
    let file = || Snapshot::read_file(disk, &layout.snapshot(name), name, map_id);
    !listed.contains(name) && file().is_ok_and(|file| file.is_some_and(|file| file.has_own_name()))
}

/// Removes the files of deleted snapshots, after everything that was kept for them. As long as the file exists, the
/// deletion can be resumed. Returns the names.
pub(in crate::store) fn remove_deleted_snapshots(
    disk: &dyn Disk,
    layout: &Layout,
    map_id: [u8; 16],
    listed: Option<&SnapshotList>,
) -> Result<Vec<SnapshotName>> {
    let folder = layout.snapshots();
    let Some(listed) = listed.filter(|_| matches!(disk.kind(&folder), Ok(Some(EntryKind::Folder)))) else {
        return Ok(Vec::new());
    };
    let mut names = Snapshot::list(disk, layout).unwrap_or_default();
    names.retain(|name| is_deleted_snapshot(disk, layout, map_id, listed, name));
    for name in &names {
        remove(disk, &layout.snapshot(name), &mut 0)?;
    }
    if !names.is_empty() {
        tolerate(disk.sync_folder(&folder), &folder, "sync")?;
    }
    Ok(names)
}

/// Removes the remains of an interrupted upgrade of tiles of the original format. Returns the number of removed files.
pub(in crate::store) fn remove_uncommitted(
    disk: &dyn Disk,
    layout: &Layout,
    tiles: &FxHashSet<TileIndex>,
) -> Result<u64> {
    let mut removed = 0;
    for &tile in tiles {
        let folder = layout.tile_folder(tile);
        if kind(disk, &folder)? != Some(EntryKind::Folder) {
            continue;
        }
        for file in layout.files() {
            remove(disk, &layout.next(tile, *file), &mut removed)?;
        }
    }
    Ok(removed)
}

/// Removes kept tables that no snapshot uses: they were kept for readers or for a deleted snapshot.
fn remove_unseen(
    disk: &dyn Disk,
    layout: &Layout,
    kept: &KeptFlushes,
    leftovers: &mut Leftovers,
) -> Result<()> {
    for (&tile, flushes) in kept {
        for &flush_number in flushes.iter().filter(|&&n| !leftovers.snapshots.sees_kept(tile, n)) {
            remove(disk, &layout.kept(tile, flush_number), &mut leftovers.removed)?;
        }
    }
    Ok(())
}

enum State {
    Whole,
    Unreadable,
    Unrenamed,
    Empty,
    Orphan,
}

fn look_at_tile(
    disk: &dyn Disk,
    layout: &Layout,
    tile: TileIndex,
    version: Option<TileVersion>,
    is_of_last_commit: bool,
    removed: &mut u64,
) -> Result<(State, BTreeSet<u64>)> {
    let folder = layout.tile_folder(tile);
    if kind(disk, &folder)? != Some(EntryKind::Folder) {
        // A file or a link with a tile's name. If the log names the tile, reading it reports the error.
        return Ok((State::Orphan, BTreeSet::new()));
    }
    let mut names = match disk.list(&folder) {
        Err(error) if is_of_medium(&error) => {
            log::warn!("{}: cannot list: {error}; the tile cannot be read", folder.display());
            return Ok((
                look_without_names(disk, layout, tile, version, is_of_last_commit)?,
                BTreeSet::new(),
            ));
        }
        names => names.map_err(|error| Error::io(&folder, "list", error))?,
    };
    let mut unrenamed = false;
    for &file in layout.files() {
        let next_name = file.next_name(layout.storage());
        let Some(at) = names.iter().position(|name| name == next_name) else { continue };
        let next = layout.next(tile, file);
        if let Some(committed) = version.map(|version| version.of(file)) {
            let waits = content_of(disk, &next, committed)?;
            if waits == Content::Committed || is_of_last_commit {
                let in_place = content_of(disk, &layout.current(tile, file), committed)?;
                if in_place != Content::Committed {
                    // If neither is the committed version, the tile is damaged. Keep both files: reading the tile
                    // reports the damage.
                    unrenamed |= waits.is_only_committed(in_place);
                    continue;
                }
            }
        }
        // Not committed, even if its bytes equal the current file: octrees often do not change with the evidence, and
        // these bytes may not be durable.
        remove(disk, &next, removed)?;
        names.swap_remove(at);
    }
    for name in names.extract_if(.., |name| name == SPILL || name == REPLACEMENT) {
        remove(disk, &folder.join(name), removed)?;
    }
    let is_kept = |name: &mut String| layout.flush_of_kept(name).is_some();
    let kept = names.extract_if(.., is_kept).filter_map(|name| layout.flush_of_kept(&name)).collect();
    // Foreign files do not make a tile: a file that a file manager leaves in a folder must not block the tile.
    let is_of_tile = |name: &String| {
        let storage = layout.storage();
        layout.files().iter().any(|file| [file.name(storage), file.next_name(storage)].contains(&&**name))
    };
    let state = match version {
        _ if !names.iter().any(is_of_tile) => State::Empty,
        None => State::Orphan,
        Some(_) if unrenamed => State::Unrenamed,
        Some(_) => State::Whole,
    };
    Ok((state, kept))
}

/// Returns the state of a tile whose folder cannot be listed. Its last committed version may still be unrenamed.
fn look_without_names(
    disk: &dyn Disk,
    layout: &Layout,
    tile: TileIndex,
    version: Option<TileVersion>,
    is_of_last_commit: bool,
) -> Result<State> {
    let Some(version) = version else { return Ok(State::Orphan) };
    for &file in layout.files().iter().filter(|_| is_of_last_commit) {
        let committed = version.of(file);
        let waits = content_of(disk, &layout.next(tile, file), committed)?;
        let in_place = content_of(disk, &layout.current(tile, file), committed)?;
        if in_place != Content::Committed && waits.is_only_committed(in_place) {
            return Ok(State::Unrenamed);
        }
    }
    Ok(State::Unreadable)
}

/// Returns the kind of a directory entry; `Other` if it cannot be read.
fn kind(disk: &dyn Disk, path: &Path) -> Result<Option<EntryKind>> {
    match disk.kind(path) {
        Err(error) if is_of_medium(&error) => Ok(Some(EntryKind::Other)),
        kind => kind.map_err(|error| Error::io(path, "access", error)),
    }
}

/// Logs a media error of a step and ignores it, because the next opening repeats the step.
fn tolerate(result: io::Result<()>, path: &Path, action: &'static str) -> Result<()> {
    match result {
        Err(error) if is_of_medium(&error) => {
            log::warn!("{}: cannot {action}: {error}", path.display());
            Ok(())
        }
        result => result.map_err(|error| Error::io(path, action, error)),
    }
}

fn list(disk: &dyn Disk, folder: &Path) -> Result<Vec<String>> {
    disk.list(folder).map_err(|error| Error::io(folder, "list", error))
}

/// Removes a file. Anything but a regular file is foreign and is kept.
fn remove(disk: &dyn Disk, path: &Path, removed: &mut u64) -> Result<()> {
    if !matches!(kind(disk, path)?, Some(EntryKind::File(_))) {
        return Ok(());
    }
    *removed += 1;
    tolerate(disk.remove_file(path), path, "remove")
}

/// Content of a file compared with the log.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    /// The version that the log names.
    Committed,
    /// Another version, or no file.
    Other,
    /// Unknown: the file cannot be read.
    Unreadable,
}

impl Content {
    /// Returns whether a `*.next` file is the committed version and the current file is not. An unreadable `*.next`
    /// file counts if the current file is another version, because no other file can be the committed version.
    fn is_only_committed(self, in_place: Self) -> bool {
        self == Self::Committed || self == Self::Unreadable && in_place == Self::Other
    }
}

fn content_of(disk: &dyn Disk, path: &Path, checksum: FileChecksum) -> Result<Content> {
    let is_none =
        |error: &io::Error| matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::InvalidInput);
    let input = match disk.open(path) {
        Ok(input) if input.file_bytes() != checksum.bytes => return Ok(Content::Other),
        Ok(input) => input,
        Err(error) if is_none(&error) => return Ok(Content::Other),
        Err(error) if is_of_medium(&error) => return Ok(Content::Unreadable),
        Err(error) => return Err(Error::io(path, "open", error)),
    };
    let mut input = Checksumming::new(input);
    match io::copy(&mut input, &mut io::sink()) {
        Err(error) if is_of_medium(&error) => Ok(Content::Unreadable),
        Err(error) => Err(Error::io(path, "read", error)),
        Ok(_) => Ok(if input.finish().0 == checksum { Content::Committed } else { Content::Other }),
    }
}
