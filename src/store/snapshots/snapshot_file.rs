//! Files in `snapshots/`. Each is a commit log with one record: the whole map as of a flush.

use super::snapshot_list::SnapshotList;
use super::snapshot_name::SnapshotName;
use crate::error::{Error, FormatError, Result};
use crate::store::commit::commit_log::CommitLog;
use crate::store::commit::commits::Commits;
use crate::store::commit::metadata::Metadata;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use crate::store::tile_store::hex;
use std::io;
use std::path::Path;

/// Content of a snapshot: all tiles and the metadata as of a flush.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Name of the snapshot.
    pub name: SnapshotName,
    /// Id of its map.
    pub map_id: [u8; 16],
    /// Metadata as of the flush.
    pub metadata: Metadata,
    /// Flush, scan and tiles.
    pub commits: Commits,
    /// Length of the file in bytes.
    pub bytes: u64,
}

impl Snapshot {
    /// Lists the names in the folder of snapshots, in order. Invalid names are omitted.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn list(disk: &dyn Disk, layout: &Layout) -> Result<Vec<SnapshotName>> {
        if !Self::has_folder(disk, layout)? {
            return Ok(Vec::new());
        }
        let folder = layout.snapshots();
        let names = disk.list(&folder).map_err(|error| Error::io(&folder, "list", error))?;
        let mut names: Vec<_> = names.into_iter().filter_map(|name| SnapshotName::new(name).ok()).collect();
        names.sort_unstable();
        Ok(names)
    }

    /// Returns whether a map has a folder for snapshots. A symbolic link is an error because it could lead out of the
    /// map.
    ///
    /// # Errors
    ///
    /// An entry with the folder's name that is not a folder, or an I/O error.
    pub(in crate::store) fn has_folder(disk: &dyn Disk, layout: &Layout) -> Result<bool> {
        let folder = layout.snapshots();
        match disk.kind_at(&folder)? {
            Some(EntryKind::Folder) => Ok(true),
            None => Ok(false),
            Some(_) => {
                let reason = "not a folder, although it has the name of the folder of snapshots";
                Err(FormatError::at_offset(0, reason).in_map(&folder, None))
            }
        }
    }

    /// Reads a snapshot of the map with this id. If `listed` is given, it must contain the snapshot, and the flush must
    /// match.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is no snapshot of this name; damage, including a missing file and a file of
    /// another snapshot; or an I/O error.
    pub fn read(
        disk: &dyn Disk,
        layout: &Layout,
        name: &SnapshotName,
        map_id: [u8; 16],
        listed: Option<&SnapshotList>,
    ) -> Result<Self> {
        let map = layout.folder().display();
        let unknown = |reason: String| Err(Error::argument("snapshot", reason));
        if listed.is_some_and(|listed| !listed.contains(name)) {
            return unknown(format!("{map} has no snapshot {name}; `voxtile snapshots {map}` lists them"));
        }
        Self::has_folder(disk, layout)?;
        let path = layout.snapshot(name);
        let read = match Self::read_file(disk, &path, name, map_id)? {
            Some(snapshot) => Some(snapshot),
            // Committed, but not renamed yet.
            None if listed.is_some() => Self::read_file(disk, &layout.snapshot_next(), name, map_id)
                .ok()
                .flatten()
                .filter(Self::has_own_name),
            None => None,
        };
        let damaged = |reason: String| Err(FormatError::at_offset(0, reason).in_map(&path, None));
        let Some(snapshot) = read else {
            return match listed {
                Some(_) => damaged(format!(
                    "the file of this snapshot is missing; restore it, or delete the snapshot with `voxtile \
                     snapshot {map} {name} --delete`"
                )),
                None => {
                    unknown(format!("{map} has no snapshot {name}; `voxtile snapshots {map}` lists them"))
                }
            };
        };
        if let Some(own) = snapshot.name_inside().filter(|own| *own != name) {
            return damaged(format!("the file belongs to the snapshot {own}; rename it back"));
        }
        if let Some(flush_number) = listed.and_then(|listed| listed.flush_of(name))
            && flush_number != snapshot.commits.flush_number
        {
            let found = snapshot.commits.flush_number;
            return damaged(format!(
                "the file is from flush {found}, but the snapshot is of flush {flush_number}"
            ));
        }
        Ok(snapshot)
    }

    /// Reads a snapshot's file without checking its name; `None` if it does not exist.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub fn read_file(
        disk: &dyn Disk,
        path: &Path,
        name: &SnapshotName,
        map_id: [u8; 16],
    ) -> Result<Option<Self>> {
        let damaged = |at, reason: String| Err(FormatError::at_offset(at, reason).in_map(path, None));
        let input = match disk.open(path) {
            Ok(input) => input,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                return damaged(0, error.to_string());
            }
            Err(error) => return Err(Error::io(path, "open", error)),
        };
        let bytes = input.file_bytes();
        let (log, mut commits) = CommitLog::read(&mut io::BufReader::new(input), bytes)
            .map_err(|error| error.in_map(path, None))?;
        if let Some(torn) = commits.torn.take() {
            return Err(torn.in_map(path, None));
        }
        if log.map_id() != map_id {
            let (found, wanted) = (hex(&log.map_id()), hex(&map_id));
            return damaged(12, format!("the snapshot belongs to map {found}, not to {wanted}"));
        }
        let is_of_map =
            |metadata: &Metadata| metadata.ext.as_ref().is_some_and(|ext| ext.map_id == hex(&map_id));
        match commits.metadata.clone().filter(is_of_map) {
            Some(metadata) => Ok(Some(Self { name: name.clone(), map_id, metadata, commits, bytes })),
            None => damaged(bytes, "the snapshot has no metadata of the map".into()),
        }
    }

    /// Returns the name recorded in the file; `None` in files of versions that did not write it.
    pub fn name_inside(&self) -> Option<&SnapshotName> {
        self.metadata.ext.as_ref()?.snapshots.as_ref()?.names().next()
    }

    /// Returns whether the file's name matches the name recorded in it.
    pub(in crate::store) fn has_own_name(&self) -> bool {
        self.name_inside() == Some(&self.name)
    }
}
