//! Lists the files that make up a map as of a flush, so that they can be copied elsewhere.

use super::commit::commit_log::CommitLog;
use super::disk::EntryKind;
use super::layout::TileFile;
use super::snapshots::seen_tables::seen_by;
use super::snapshots::snapshot_file::Snapshot;
use super::tile_store::TileStore;
use super::tiles::file_checksum::FileChecksum;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A file of a map as of a flush.
#[derive(Clone, Debug)]
pub struct CommittedFile {
    /// Path in the map's folder, with `/` between names.
    pub path: String,
    /// Content, or where to read it.
    pub content: CommittedContent,
}

/// Source of the content of a [`CommittedFile`].
#[derive(Clone, Debug)]
pub enum CommittedContent {
    /// The content itself, for files that are generated as of the flush.
    Bytes(Vec<u8>),
    /// The first of these files that has this checksum. A concurrent writer may have replaced or removed all of them.
    Stored {
        /// Candidate paths, in the order to try.
        places: Vec<PathBuf>,
        /// Identifies the right file; `None` if no log records its checksum.
        version: Option<FileVersion>,
    },
}

/// Identity of a version of a tile's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileVersion {
    /// Length and checksum.
    pub checksum: FileChecksum,
    /// Number of the last scan in the map when the file was written.
    pub scan_number: u64,
}

impl TileStore {
    /// Returns the files of the map that belong to no tile. `metadata.json` is last, so that a reader that finds it in
    /// a copy finds all other files too.
    ///
    /// # Errors
    ///
    /// A damaged or missing catalog of kept scans, a missing or truncated segment (also if a writer removed it after
    /// the map was opened), or an I/O error.
    pub fn committed_files(&self, snapshots: &[Snapshot]) -> Result<Vec<CommittedFile>> {
        let mut files = Vec::new();
        for snapshot in snapshots {
            files.push(self.stored(self.layout().snapshot(&snapshot.name), None));
        }
        // Removed scans are not copied.
        files.extend(self.needed_scan_files(snapshots)?.into_iter().map(|path| self.stored(path, None)));
        let scans = self.layout().scans();
        if let Some(EntryKind::File(_)) = self.disk().kind_at(&scans)? {
            files.push(self.stored(scans, None));
        }
        let text = self.metadata().to_text();
        if let Some(map_id) = self.map_id() {
            let log = CommitLog::to_bytes(map_id, self.commits(), &text)
                .map_err(|error| Error::io(&self.layout().commit_log(), "copy", error))?;
            files.push(self.made(&self.layout().commit_log(), log));
        }
        files.push(self.made(&self.layout().metadata(), text.into_bytes()));
        Ok(files)
    }

    /// Returns the files of a tile that the map or one of its snapshots uses.
    ///
    /// # Errors
    ///
    /// [`Error::Changed`] if a writer has replaced the files meanwhile, or a folder that cannot be listed.
    pub fn committed_files_of(&self, tile: TileIndex, snapshots: &[Snapshot]) -> Result<Vec<CommittedFile>> {
        let mut files = Vec::new();
        let version = self.tiles().version(tile);
        match version {
            Some(version) => {
                let table = self.layout().current(tile, TileFile::Table);
                let table = self.stored(table, Some((version.table, version.scan_number)));
                files.push(self.at_places(table, self.tables().other_places(tile)?));
                if self.layout().files().contains(&TileFile::Octree) {
                    let octree = self.layout().current(tile, TileFile::Octree);
                    let octree = self.stored(octree, Some((version.octree, version.scan_number)));
                    files.push(self.at_places(octree, vec![self.layout().next(tile, TileFile::Octree)]));
                }
            }
            // A map of the original format has no log and no versions.
            None if self.tiles().contains(tile) => {
                for file in self.layout().files() {
                    let path = self.layout().current(tile, *file);
                    if let Some(EntryKind::File(_)) = self.disk().kind_at(&path)? {
                        files.push(self.stored(path, None));
                    }
                }
            }
            None => {}
        }
        let mut seen_kept = BTreeSet::new();
        for snapshot in snapshots {
            let Some(seen) = snapshot.commits.tiles.get(tile) else { continue };
            if Some(seen) == version {
                continue;
            }
            let kept = self.tables().kept(tile)?;
            let Some(flush_number) = seen_by(Some(&kept), snapshot.commits.flush_number) else {
                // The snapshot needs a kept table, so a writer has removed it since the snapshot was read.
                return Err(Error::Changed { path: self.folder().to_owned() });
            };
            if seen_kept.insert(flush_number) {
                let path = self.layout().kept(tile, flush_number);
                files.push(self.stored(path, Some((seen.table, seen.scan_number))));
            }
        }
        Ok(files)
    }

    fn stored(&self, path: PathBuf, version: Option<(FileChecksum, u64)>) -> CommittedFile {
        let version = version.map(|(checksum, scan_number)| FileVersion { checksum, scan_number });
        let name = self.path_in_map(&path);
        CommittedFile { path: name, content: CommittedContent::Stored { places: vec![path], version } }
    }

    fn at_places(&self, mut file: CommittedFile, others: Vec<PathBuf>) -> CommittedFile {
        if let CommittedContent::Stored { places, .. } = &mut file.content {
            places.extend(others);
        }
        file
    }

    fn made(&self, path: &Path, bytes: Vec<u8>) -> CommittedFile {
        CommittedFile { path: self.path_in_map(path), content: CommittedContent::Bytes(bytes) }
    }

    fn path_in_map(&self, path: &Path) -> String {
        let names = path.strip_prefix(self.folder()).unwrap_or(path).iter();
        names.map(|name| name.to_string_lossy()).collect::<Vec<_>>().join("/")
    }
}
