use super::finding::{Finding, Severity};
use super::kept_scans::{check_kept_scans, find_idle};
use super::rebuild::{self, Index};
use super::snapshots::{WholeTables, lost_tiles};
use super::tile_check::{check_tile, first_difference, write_octree};
use crate::config::MapConfig;
use crate::error::{Error, FormatError, Result};
use crate::persistence::config_from;
use crate::space::TileIndex;
use crate::store::{
    Commits, Disk, EntryKind, KEPT_SCANS, Layout, MapPath, QUARANTINE, SNAPSHOT_NEXT, SNAPSHOTS, Salvage,
    SnapshotList, SnapshotName, TileFile, TileStore, check_scans, read_log, tile_of_folder,
};
use rustc_hash::FxHashSet;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// What a look at every byte of a map gave.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Verification {
    /// Whether the map has the checksums that let damage be found; a map of the original format has none.
    pub verified: bool,
    /// Number of the flush that was looked at.
    pub flush_number: u64,
    /// Number of the last scan in it.
    pub scan_number: u64,
    /// Tiles that were looked at: those of the map, or of the scope.
    pub tiles: u64,
    /// Snapshots of the map.
    pub snapshots: u64,
    /// Observed voxels in the tiles that are whole.
    pub voxels: u64,
    /// Bytes of the tables that are whole.
    pub table_bytes: u64,
    /// Findings that are damage.
    pub damage: u64,
    /// Findings that are none.
    pub notes: u64,
    /// Those of them that are files which no flush needs: left behind by a process that was killed or that the disk
    /// refused, or of one at work. The next process that opens the map for writing removes them or gives them their
    /// names.
    pub leftovers: u64,
}

impl Verification {
    /// Whether nothing is damaged.
    pub fn is_whole(&self) -> bool {
        self.damage == 0
    }
}

/// Checks every file of a map, beside a writer too. Takes no lock and writes nothing.
///
/// `found` is told each finding, `progress` the tiles done and all. Memory: the list of tiles, where there is damage a
/// second one, and one tile.
///
/// # Errors
///
/// No map there, or a disk that refuses more than single files. Damage is a finding, and so is a file or folder that
/// the medium does not give back; the others are looked at all the same.
pub fn verify(
    folder: impl Into<MapPath>,
    found: impl FnMut(&Finding),
    progress: impl FnMut(u64, u64),
) -> Result<Verification> {
    verify_scope(folder, &VerifyScope::All, found, progress)
}

/// Which part of a map is checked: the scopes of several processes may add up to the whole.
#[derive(Clone, Debug, Default)]
pub enum VerifyScope {
    /// All of it.
    #[default]
    All,
    /// The files of these tiles as of the last flush; those that the map has not got are left out.
    Tiles(FxHashSet<TileIndex>),
    /// All but the files of tiles as of the last flush: lists, scans, snapshots, what lies around.
    AllButTiles,
}

impl VerifyScope {
    fn has_tile(&self, tile: TileIndex) -> bool {
        match self {
            Self::All => true,
            Self::Tiles(tiles) => tiles.contains(&tile),
            Self::AllButTiles => false,
        }
    }

    fn has_rest(&self) -> bool {
        !matches!(self, Self::Tiles(_))
    }
}

/// The same for a part of the map. What is wrong with the list of tiles itself is found in every part.
///
/// # Errors
///
/// As for [`verify`].
pub fn verify_scope(
    folder: impl Into<MapPath>,
    scope: &VerifyScope,
    found: impl FnMut(&Finding),
    progress: impl FnMut(u64, u64),
) -> Result<Verification> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let layout = Layout::new(folder);
    let mut verifier = Verifier {
        listed: None,
        disk: &*disk,
        layout,
        scope,
        found,
        progress,
        counts: Verification::default(),
        told: BTreeSet::new(),
        now: None,
    };
    let store = match TileStore::open_read_only(disk.clone(), folder) {
        Ok(store) => Some(store),
        Err(error) => {
            let finding = Finding::of(error)?;
            verifier.report(finding);
            verifier.index_from_remains(&disk)?
        }
    };
    if let Some(store) = store {
        verifier.layout = store.layout().clone();
        verifier.listed = store.snapshot_list().cloned();
        let path = store.layout().metadata();
        match config_from(store.metadata(), &path) {
            Ok(config) => verifier.verify_map(&disk, &store, &config)?,
            Err(error) => {
                let finding = Finding::of(error)?;
                verifier.report(finding);
            }
        }
    }
    Ok(verifier.counts)
}

struct Verifier<'a, F, P> {
    disk: &'a dyn Disk,
    layout: Layout,
    scope: &'a VerifyScope,
    found: F,
    progress: P,
    counts: Verification,
    /// The snapshots that the log names; `None` if it names none.
    listed: Option<SnapshotList>,
    /// Tiles that are no longer in the list of tiles because they are damaged, which has been told.
    told: BTreeSet<TileIndex>,
    /// What the log said when it was last read beside the store, if it could be, and how it ended then.
    now: Option<(LogEnd, Option<Commits>)>,
}

/// Of a file that waits to take the place of another.
const LEFT: &str = "left behind by a process that was killed or that the disk refused, or being written";

/// Of points and lists of scans that no flush needs.
const IDLE_SCANS: &str = "points or a list of scans that neither the map nor a snapshot uses. A killed process left \
                          them, or a writer is about to commit them. They may hold removed scans.";

/// Of `MAP.remapping`.
const SECOND_MAP: &str = "the second map of an online remap that is running or was killed. The next online remap \
                          removes it, and so do `remove-scans` and `remove-points`.";

/// Of `MAP.unfinished`.
const UNFINISHED_MAP: &str = "a map that `voxtile pull --replace` is making, or the old map that it replaced. The \
                              next `voxtile pull --replace` removes it.";

/// Length of a log, and its last bytes. The checksum of the last record is among them, so that no two states of a log
/// have the same.
type LogEnd = (u64, Vec<u8>);

/// How many bytes of its end tell that a log is the same.
const LOG_END_BYTES: usize = 64;

impl<F: FnMut(&Finding), P: FnMut(u64, u64)> Verifier<'_, F, P> {
    fn report(&mut self, finding: Finding) {
        match finding.severity {
            Severity::Damage => self.counts.damage += 1,
            Severity::Note => self.counts.notes += 1,
        }
        (self.found)(&finding);
    }

    /// Reports a file that the next writer removes or renames; what has its name and is no file stays.
    fn leftover(&mut self, path: &Path, tile: Option<TileIndex>, reason: &str) {
        let reason = match self.disk.kind(path) {
            // Renamed or removed since the folder was listed.
            Ok(None) => return,
            Ok(Some(EntryKind::File(_))) => reason.to_owned(),
            Ok(Some(_)) => return self.report(Finding::note(path, tile, "no part of a map")),
            Err(error) => format!("{reason} ({error})"),
        };
        self.counts.leftovers += 1;
        self.report(Finding::note(path, tile, reason));
    }

    fn damage(&mut self, path: &Path, tile: Option<TileIndex>, reason: &str) {
        self.report(Finding::damage(path, tile, &FormatError::at_offset(0, reason)));
    }

    fn verify_map(&mut self, disk: &Arc<dyn Disk>, store: &TileStore, config: &MapConfig) -> Result<()> {
        self.counts.verified = store.map_id().is_some();
        self.counts.flush_number = store.commits().flush_number;
        self.counts.scan_number = store.commits().scan_number;
        if !self.counts.verified {
            let reason =
                "a map of the original format: no checksums, so only the form of its tables is checked";
            self.report(Finding::note(&self.layout.metadata(), None, reason));
        }
        if let Some(torn) = &store.commits().torn {
            let mut note = Finding::note(&self.layout.commit_log(), None, torn.reason.clone());
            (note.offset, note.reason) =
                (Some(torn.at), format!("a flush that never happened: {}", torn.reason));
            self.report(note);
        }
        if self.scope.has_rest() {
            self.verify_scans(disk, store)?;
        }
        let mut tiles: Vec<_> = store.tiles().collect();
        tiles.sort_unstable();
        let chosen: Vec<_> = tiles.iter().copied().filter(|&tile| self.scope.has_tile(tile)).collect();
        self.counts.tiles = chosen.len() as u64;
        for (done, tile) in (1..).zip(&chosen) {
            self.verify_tile(store, config, *tile)?;
            (self.progress)(done, chosen.len() as u64);
        }
        if !self.scope.has_rest() {
            return Ok(());
        }
        let seen = self.verify_snapshots(disk, store, config)?;
        for path in find_idle(disk, store)? {
            self.leftover(&path, None, IDLE_SCANS);
        }
        self.look_around(&seen, |tile| tiles.binary_search(&tile).is_ok())
    }

    fn verify_scans(&mut self, disk: &Arc<dyn Disk>, store: &TileStore) -> Result<()> {
        let records = store.listed_records();
        if let Err(error) = check_scans(self.disk, &self.layout, self.counts.flush_number, records) {
            let finding = Finding::of(error)?;
            self.report(finding);
        }
        if store.keeps_scans() {
            for error in check_kept_scans(disk, store)? {
                self.report(error);
            }
        }
        Ok(())
    }

    fn verify_tile(&mut self, store: &TileStore, config: &MapConfig, tile: TileIndex) -> Result<()> {
        let check = check_tile(self.disk, store, config, tile)?;
        let table = match check.table {
            Ok(table) => table,
            Err(_) if self.has_changed_since(store, tile) => {
                let folder = self.layout.tile_folder(tile);
                self.report(Finding::note(&folder, Some(tile), "flushed anew while the map was verified"));
                return Ok(());
            }
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report(finding.in_tile(tile));
                return Ok(());
            }
        };
        self.counts.voxels += table.table.len() as u64;
        self.counts.table_bytes += table.file.bytes;
        if let Some(Err(mut cause)) = check.octree
            && !self.has_changed_since(store, tile)
        {
            let path = self.layout.current(tile, TileFile::Octree);
            let mut expected = Vec::new();
            if write_octree(config, &table, &mut expected).is_ok() {
                cause.at = first_difference(self.disk, &path, &expected).unwrap_or(cause.at);
            }
            self.report(Finding::damage(&path, Some(tile), &cause));
        }
        Ok(())
    }

    /// Whether a writer has flushed a tile since the store was opened. It keeps tables for readers, not octrees; and a
    /// writer that was started since has not seen this reader.
    fn has_changed_since(&mut self, store: &TileStore, tile: TileIndex) -> bool {
        let now = self.commits_now().and_then(|now| now.tiles.get(tile));
        now.is_some() && now != store.version(tile)
    }

    /// Where metadata or log cannot be read, the tiles are checked against what else tells of them.
    fn index_from_remains(&mut self, disk: &Arc<dyn Disk>) -> Result<Option<TileStore>> {
        let remains = Salvage::read(self.disk, &self.layout)?;
        self.layout = remains.layout_of_tiles(self.disk, self.layout.folder());
        match rebuild::index_of(self.disk, &self.layout, &remains, &mut |_, _| ()) {
            Ok(Some(Index { map_id, metadata, commits, damaged, .. })) => {
                for (tile, error) in damaged {
                    self.told.insert(tile);
                    let finding = Finding::of(error)?;
                    self.report(finding.in_tile(tile));
                }
                let folder = self.layout.folder();
                Ok(Some(TileStore::of_commits(disk.clone(), folder, map_id, metadata, commits)))
            }
            Ok(None) => Ok(None),
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report(finding);
                Ok(None)
            }
        }
    }

    /// Looks at the snapshots, and at the tables that only they see. Returns those that are whole.
    fn verify_snapshots(
        &mut self,
        disk: &Arc<dyn Disk>,
        store: &TileStore,
        config: &MapConfig,
    ) -> Result<WholeTables> {
        let mut whole = WholeTables::new();
        let names = match store.snapshot_names() {
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report(finding);
                return Ok(whole);
            }
            Ok(names) => names,
        };
        for name in names {
            self.counts.snapshots += 1;
            let lost =
                store.snapshot(&name).and_then(|snapshot| lost_tiles(store, config, &snapshot, &mut whole));
            let errors = match lost {
                // Deleted meanwhile.
                Err(Error::InvalidArgument { .. }) => continue,
                Err(error) => vec![error],
                Ok(lost) => lost.into_iter().map(|(_, error)| error).collect(),
            };
            let is_deleted = |now: TileStore| now.snapshot_names().is_ok_and(|names| !names.contains(&name));
            if !errors.is_empty()
                && TileStore::open_read_only(disk.clone(), self.layout.folder()).is_ok_and(is_deleted)
            {
                continue;
            }
            for error in errors {
                let mut finding = Finding::of(error)?;
                finding.reason += &format!("; the snapshot {name} needs it");
                self.report(finding);
            }
        }
        Ok(whole)
    }

    fn look_into_snapshots(&mut self, folder: &Path) -> Result<()> {
        match self.kind(folder)? {
            Some(EntryKind::Folder) => {}
            Some(_) if self.listed.as_ref().is_some_and(SnapshotList::is_empty) => {
                self.damage(folder, None, "something else has the name of the folder of snapshots");
                return Ok(());
            }
            // Where the log lists snapshots, or nobody knows whether it does, that has been told.
            _ => return Ok(()),
        }
        for name in self.list(folder)? {
            let path = folder.join(&name);
            let reason = match SnapshotName::new(&*name) {
                Ok(name) if self.listed.as_ref().is_none_or(|listed| listed.contains(&name)) => continue,
                Ok(_) => "no snapshot of the map: commits.log does not name it",
                Err(_) if name == SNAPSHOT_NEXT => LEFT,
                Err(_) => {
                    self.report(Finding::note(&path, None, "no snapshot: it has no name of one"));
                    continue;
                }
            };
            self.leftover(&path, None, reason);
        }
        Ok(())
    }

    /// Looks for what is no part of the map.
    fn look_around(&mut self, seen: &WholeTables, is_known: impl Fn(TileIndex) -> bool) -> Result<()> {
        let folder = self.layout.folder().to_owned();
        for name in self.list(&folder)? {
            let path = folder.join(&name);
            match (&*name, tile_of_folder(&name)) {
                ("metadata.json" | "commits.log" | "scans.bin", _) => {}
                ("writer.lock", _) => {
                    if matches!(self.kind(&path)?, Some(EntryKind::Folder | EntryKind::Other)) {
                        self.damage(&path, None, "no regular file: nobody can lock the map to write to it");
                    }
                }
                // What was pushed or pulled (`bucket::known_states`).
                ("bucket_states", _) => {}
                (KEPT_SCANS, _) => self.look_into_kept_scans(&path)?,
                (SNAPSHOTS, _) => self.look_into_snapshots(&path)?,
                (QUARANTINE, _) => {
                    let reason = "moved here by a repair. It may hold scans that were removed later. Delete it when \
                                  you need nothing in it.";
                    self.report(Finding::note(&path, None, reason));
                }
                (_, Some(tile)) => {
                    let is_known = is_known(tile) || self.told.contains(&tile);
                    self.look_into(&path, tile, seen, is_known)?;
                }
                (name, None) if Layout::is_next_of_map(name) => self.leftover(&path, None, LEFT),
                ("bucket_states.next", None) => {
                    let reason =
                        "left behind by a push that was killed, or being written; the next push replaces it";
                    self.report(Finding::note(&path, None, reason));
                }
                _ => self.report(Finding::note(&path, None, "no part of a map")),
            }
        }
        self.look_beside(&folder);
        Ok(())
    }

    /// Looks for a second map that a change of this one makes beside it. Where that cannot be told there is none.
    fn look_beside(&mut self, folder: &Path) {
        let reasons = [("remapping", SECOND_MAP), ("unfinished", UNFINISHED_MAP)];
        for (extension, reason) in reasons.into_iter().filter(|_| folder.file_name().is_some()) {
            let path = folder.with_added_extension(extension);
            if let Ok(Some(EntryKind::Folder)) = self.disk.kind(&path) {
                self.report(Finding::note(&path, None, reason));
            }
        }
    }

    fn look_into_kept_scans(&mut self, folder: &Path) -> Result<()> {
        if self.kind(folder)? != Some(EntryKind::Folder) {
            return Ok(());
        }
        for name in self.list(folder)? {
            if !Layout::is_of_kept_scans(&name) {
                self.report(Finding::note(&folder.join(&name), None, "no part of a map"));
            }
        }
        Ok(())
    }

    fn look_into(
        &mut self,
        folder: &Path,
        tile: TileIndex,
        seen: &WholeTables,
        is_known: bool,
    ) -> Result<()> {
        let kind = self.kind(folder)?;
        if kind != Some(EntryKind::Folder) {
            if !is_known {
                self.damage(folder, Some(tile), "something with a tile's name that is no folder");
            }
            return Ok(());
        }
        let mut is_orphan = false;
        for name in self.list(folder)? {
            let path = folder.join(&name);
            let kept = self.layout.flush_of_kept(&name);
            if kept.is_some_and(|flush_number| seen.contains_key(&(tile, flush_number))) {
                continue;
            }
            if self.layout.is_next_of_tile(&name) {
                self.leftover(&path, Some(tile), LEFT);
            } else if kept.is_some() {
                self.leftover(&path, Some(tile), "replaced; kept for a reader, or left behind");
            } else if self.layout.files().iter().all(|file| file.name(self.layout.storage()) != name) {
                self.report(Finding::note(&path, Some(tile), "no part of a map"));
            } else {
                is_orphan |= !is_known;
            }
        }
        if !is_orphan {
            return Ok(());
        }
        // A writer may have added it, or begun to remove it, since the log was read.
        let now = self.commits_now();
        let is_named = now.is_some_and(|now| now.tiles.contains(tile));
        if now.is_some_and(|now| now.last_removed.contains(&tile)) {
            let reason = "taken out of the map; its files go when the map is next opened for writing";
            self.counts.leftovers += 1;
            self.report(Finding::note(folder, Some(tile), reason));
        } else if !is_named {
            let path = self.layout.current(tile, TileFile::Table);
            self.damage(&path, Some(tile), "commits.log does not name this tile");
        }
        Ok(())
    }

    /// What the log says now. It is read again only once it has changed: a map of many tiles may miss many.
    fn commits_now(&mut self) -> Option<&Commits> {
        let end = self.log_end()?;
        if self.now.as_ref().is_none_or(|(of, _)| *of != end) {
            // The end was looked at before, so what a writer appends meanwhile is seen as a change the next time.
            let commits = read_log(self.disk, &self.layout).ok().flatten().map(|(_, commits)| commits);
            self.now = Some((end, commits));
        }
        self.now.as_ref()?.1.as_ref()
    }

    /// How the log ends now; `None` if there is none or nobody can tell.
    fn log_end(&self) -> Option<LogEnd> {
        let path = self.layout.commit_log();
        let Ok(Some(EntryKind::File(bytes))) = self.disk.kind(&path) else { return None };
        let offset = bytes.saturating_sub(LOG_END_BYTES as u64);
        Some((bytes, self.disk.read_at(&path, offset, LOG_END_BYTES).ok()?))
    }

    /// What has a name; nothing, and a finding, where the medium does not tell.
    fn kind(&mut self, path: &Path) -> Result<Option<EntryKind>> {
        let kind = self.disk.kind_at(path);
        self.unless_unreadable(kind)
    }

    /// The names in a folder; none, and a finding, where it cannot be read.
    fn list(&mut self, folder: &Path) -> Result<Vec<String>> {
        let names = self.disk.list(folder).map_err(|error| Error::io(folder, "list", error));
        let mut names = self.unless_unreadable(names)?;
        names.sort_unstable();
        Ok(names)
    }

    fn unless_unreadable<T: Default>(&mut self, result: Result<T>) -> Result<T> {
        match result {
            Err(error) if error.is_of_medium() => {
                let finding = Finding::of(error)?;
                self.report(finding);
                Ok(T::default())
            }
            result => result,
        }
    }
}
