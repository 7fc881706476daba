use super::finding::Finding;
use super::rechecks::Recheck;
use super::verify::Verifier;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::{
    EntryKind, KEPT_SCANS, Layout, QUARANTINE, SNAPSHOT_NEXT, SNAPSHOTS, SnapshotList, SnapshotName,
    TileFile, TileStore, tile_of_folder,
};
use std::io;
use std::path::Path;

/// Note on a file that will replace another.
const LEFT: &str = "left by a process that was killed or had an I/O error, or being written";

/// Note on points and lists of scans that no flush needs.
pub(super) const IDLE_SCANS: &str = "points or a list of scans that neither the map nor a snapshot uses. A killed \
                                     process left them, or a writer is about to commit them. They may contain \
                                     removed scans.";

const SECOND_MAP: &str = "the second map of an online remap that is running or was killed. The next online remap \
                          removes it, and so do `remove-scans` and `remove-points`.";

const UNFINISHED_MAP: &str = "a map that `voxtile pull --replace` is downloading, or the old map that it replaced. The \
                              next `voxtile pull --replace` removes it.";

/// Search for foreign and left-over files in the map's folder and next to it.
impl<F: FnMut(&Finding), P: FnMut(u64, u64)> Verifier<'_, F, P> {
    /// Reports a file that the next writer removes or renames. Anything but a regular file is reported as foreign.
    pub(super) fn leftover(&mut self, path: &Path, tile: Option<TileIndex>, reason: &str) {
        if self.is_again {
            return;
        }
        let reason = match self.disk.kind(path) {
            // Renamed or removed after the folder was listed.
            Ok(None) => return,
            Ok(Some(EntryKind::File(_))) => reason.to_owned(),
            Ok(Some(_)) => return self.report(Finding::note(path, tile, "not part of a map")),
            Err(error) => format!("{reason} ({error})"),
        };
        self.counts.leftovers += 1;
        self.report(Finding::note(path, tile, reason));
    }

    fn check_snapshots_folder(&mut self, folder: &Path) -> Result<()> {
        match self.kind(folder)? {
            Some(EntryKind::Folder) => {}
            Some(_) if self.listed.as_ref().is_some_and(SnapshotList::is_empty) => {
                self.damage(
                    folder,
                    None,
                    "not a folder, although it has the name of the folder of snapshots",
                );
                return Ok(());
            }
            // Otherwise the missing snapshots, or the unreadable log, were reported.
            _ => return Ok(()),
        }
        for name in self.list(folder)? {
            let path = folder.join(&name);
            let reason = match SnapshotName::new(&*name) {
                Ok(name) if self.listed.as_ref().is_none_or(|listed| listed.contains(&name)) => continue,
                Ok(_) => "not a snapshot of this map: commits.log does not list it",
                Err(_) if name == SNAPSHOT_NEXT => LEFT,
                Err(_) => {
                    self.report(Finding::note(&path, None, "not a snapshot: the name is not valid for one"));
                    continue;
                }
            };
            self.leftover(&path, None, reason);
        }
        Ok(())
    }

    /// Reports entries that are not part of the map.
    pub(super) fn check_map_folder(
        &mut self,
        store: &TileStore,
        is_known: impl Fn(TileIndex) -> bool,
    ) -> Result<()> {
        let folder = self.layout.folder().to_owned();
        for name in self.list(&folder)? {
            let path = folder.join(&name);
            match (&*name, tile_of_folder(&name)) {
                ("metadata.json" | "commits.log" | "scans.bin", _) => {}
                ("writer.lock", _) => {
                    if matches!(self.kind(&path)?, Some(EntryKind::Folder | EntryKind::Other)) {
                        self.damage(&path, None, "not a regular file: the map cannot be locked for writing");
                    }
                }
                // Pushed and pulled states (`bucket::known_states`).
                ("bucket_states", _) => {}
                (KEPT_SCANS, _) => self.check_kept_scans_folder(&path)?,
                (SNAPSHOTS, _) => self.check_snapshots_folder(&path)?,
                (QUARANTINE, _) => {
                    let reason = "moved here by a repair. It may contain scans that were removed later. Delete it when \
                                  you need nothing in it.";
                    self.report(Finding::note(&path, None, reason));
                }
                (_, Some(tile)) => {
                    let is_known = is_known(tile) || self.reported_tiles.contains(&tile);
                    self.check_tile_folder(store, &path, tile, is_known)?;
                }
                (name, None) if Layout::is_next_of_map(name) => self.leftover(&path, None, LEFT),
                ("bucket_states.next", None) => {
                    let reason = "left by a killed push, or being written; the next push replaces it";
                    self.report(Finding::note(&path, None, reason));
                }
                _ => self.report(Finding::note(&path, None, "not part of a map")),
            }
        }
        self.check_siblings(&folder);
        Ok(())
    }

    /// Reports a second map next to this one. I/O errors are ignored.
    fn check_siblings(&mut self, folder: &Path) {
        let reasons = [("remapping", SECOND_MAP), ("unfinished", UNFINISHED_MAP)];
        for (extension, reason) in reasons.into_iter().filter(|_| folder.file_name().is_some()) {
            let path = folder.with_added_extension(extension);
            if let Ok(Some(EntryKind::Folder)) = self.disk.kind(&path) {
                self.report(Finding::note(&path, None, reason));
            }
        }
    }

    fn check_kept_scans_folder(&mut self, folder: &Path) -> Result<()> {
        if self.kind(folder)? != Some(EntryKind::Folder) {
            return Ok(());
        }
        for name in self.list(folder)? {
            if !Layout::is_of_kept_scans(&name) {
                self.report(Finding::note(&folder.join(&name), None, "not part of a map"));
            }
        }
        Ok(())
    }

    /// Checks the entries in the folder of a tile.
    pub(super) fn check_tile_folder(
        &mut self,
        store: &TileStore,
        folder: &Path,
        tile: TileIndex,
        is_known: bool,
    ) -> Result<()> {
        let wrong =
            |path: &Path, reason: &str| Finding::damage(path, Some(tile), &FormatError::at_offset(0, reason));
        match self.kind(folder)? {
            Some(EntryKind::Folder) => {}
            Some(_) if !is_known => {
                let finding = wrong(folder, "not a folder, although it has the name of a tile");
                self.report_if_confirmed(finding, Recheck::Folder(tile));
                return Ok(());
            }
            // The check of the tile reports this.
            _ => return Ok(()),
        }
        let mut is_orphan = false;
        for name in self.list(folder)? {
            let path = folder.join(&name);
            let kept = self.layout.flush_of_kept(&name);
            if kept.is_some_and(|flush_number| self.whole.contains_key(&(tile, flush_number))) {
                continue;
            }
            if self.layout.is_next_of_tile(&name) {
                self.leftover(&path, Some(tile), LEFT);
            } else if kept.is_some() {
                self.leftover(&path, Some(tile), "replaced; kept for a reader, or left by a killed process");
            } else if self.layout.files().iter().all(|file| file.name(self.layout.storage()) != name) {
                self.report(Finding::note(&path, Some(tile), "not part of a map"));
            } else {
                is_orphan |= !is_known;
            }
        }
        if !is_orphan {
            return Ok(());
        }
        if store.commits().last_removed.contains(&tile) {
            if !self.is_again {
                let reason =
                    "removed from the map; its files are deleted when the map is next opened for writing";
                self.counts.leftovers += 1;
                self.report(Finding::note(folder, Some(tile), reason));
            }
            return Ok(());
        }
        let path = self.layout.current(tile, TileFile::Table);
        let finding = wrong(&path, "commits.log has no entry for this tile");
        self.report_if_confirmed(finding, Recheck::Folder(tile));
        Ok(())
    }

    /// Returns the kind of a directory entry. A media error is reported as a finding, and the result is `None`.
    fn kind(&mut self, path: &Path) -> Result<Option<EntryKind>> {
        let kind = self.disk.kind_at(path);
        self.unless_unreadable(kind)
    }

    /// Lists the names in a folder. A media error is reported as a finding, and the result is empty.
    fn list(&mut self, folder: &Path) -> Result<Vec<String>> {
        let names = match self.disk.list(folder) {
            // Removed after its parent was listed.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            names => names.map_err(|error| Error::io(folder, "list", error)),
        };
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
