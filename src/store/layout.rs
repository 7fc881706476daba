use super::snapshots::snapshot_name::SnapshotName;
use crate::config::Storage;
use crate::space::TileIndex;
use std::path::{Path, PathBuf};

/// Paths of the files of a map.
#[derive(Clone, Debug)]
pub struct Layout {
    folder: PathBuf,
    storage: Storage,
}

/// File of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileFile {
    /// Table of exact evidence: `iwlo_meta.bin`, or `tile.vxt` with compact storage.
    Table,
    /// Octree in OctoMap's format: `octree.bt`. Absent with compact storage.
    Octree,
}

impl TileFile {
    /// Returns the files of a tile in the order in which they are written and renamed. The table is last because it
    /// contains the checksum of the octree.
    pub const fn all(storage: Storage) -> &'static [Self] {
        match storage {
            Storage::OctoMap => &[Self::Octree, Self::Table],
            Storage::Compact => &[Self::Table],
        }
    }

    /// Returns the name of the file.
    pub const fn name(self, storage: Storage) -> &'static str {
        match (self, storage) {
            (Self::Table, Storage::OctoMap) => "iwlo_meta.bin",
            (Self::Table, Storage::Compact) => "tile.vxt",
            (Self::Octree, _) => "octree.bt",
        }
    }

    /// Returns the name of the version to be committed next.
    pub const fn next_name(self, storage: Storage) -> &'static str {
        match (self, storage) {
            (Self::Table, Storage::OctoMap) => "iwlo_meta.bin.next",
            (Self::Table, Storage::Compact) => "tile.vxt.next",
            (Self::Octree, _) => "octree.bt.next",
        }
    }
}

impl Layout {
    /// Returns the layout of the map in `folder` with [`Storage::OctoMap`].
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), storage: Storage::OctoMap }
    }

    /// Returns the layout with this storage of tiles.
    pub fn with_storage(self, storage: Storage) -> Self {
        Self { storage, ..self }
    }

    /// Storage of the tiles.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// Files of each tile, in the order in which they are written and renamed.
    pub fn files(&self) -> &'static [TileFile] {
        TileFile::all(self.storage)
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path of `metadata.json`.
    pub fn metadata(&self) -> PathBuf {
        self.folder.join("metadata.json")
    }

    /// Path of `commits.log`.
    pub fn commit_log(&self) -> PathBuf {
        self.folder.join("commits.log")
    }

    /// Path of `scans.bin`, the list of scans.
    pub fn scans(&self) -> PathBuf {
        self.folder.join("scans.bin")
    }

    /// Path of the replacement of a damaged `scans.bin`, before it is renamed.
    pub(super) fn scans_next(&self) -> PathBuf {
        self.folder.join(SCANS_NEXT)
    }

    /// Path of the folder of kept scans.
    pub fn kept_scans(&self) -> PathBuf {
        self.folder.join(KEPT_SCANS)
    }

    /// Path of a catalog of kept scans. `generation` is the number of the flush that created it.
    pub(super) fn catalog(&self, generation: u64) -> PathBuf {
        self.kept_scans().join(format!("{CATALOG_PREFIX}{generation}"))
    }

    /// Parses the generation in a catalog's name; `None` for another name.
    pub(super) fn generation_of(name: &str) -> Option<u64> {
        number_behind(CATALOG_PREFIX, name)
    }

    /// Path of a file with the points of some kept scans.
    pub(super) fn segment(&self, segment: u64) -> PathBuf {
        self.kept_scans().join(format!("{SEGMENT_PREFIX}{segment}"))
    }

    /// Parses the number in a segment's name; `None` for another name.
    pub fn segment_of(name: &str) -> Option<u64> {
        number_behind(SEGMENT_PREFIX, name)
    }

    /// Returns whether the name is that of a catalog or a segment.
    pub fn is_of_kept_scans(name: &str) -> bool {
        Self::generation_of(name).is_some() || Self::segment_of(name).is_some()
    }

    /// Path of the lock file of the writer.
    pub fn lock(&self) -> PathBuf {
        self.folder.join("writer.lock")
    }

    /// Path of the folder of a tile.
    pub fn tile_folder(&self, tile: TileIndex) -> PathBuf {
        self.folder.join(folder_name(tile))
    }

    /// Path of the committed version of a tile's file.
    pub fn current(&self, tile: TileIndex, file: TileFile) -> PathBuf {
        self.tile_folder(tile).join(file.name(self.storage))
    }

    /// Path of the table of a tile as of a flush. It is kept for readers that opened the map then and for snapshots.
    pub fn kept(&self, tile: TileIndex, flush_number: u64) -> PathBuf {
        let table = TileFile::Table.name(self.storage);
        self.tile_folder(tile).join(format!("{table}{KEPT_SUFFIX}{flush_number}"))
    }

    /// Parses the flush number in a kept table's name; `None` for another name.
    pub fn flush_of_kept(&self, name: &str) -> Option<u64> {
        number_behind(KEPT_SUFFIX, name.strip_prefix(TileFile::Table.name(self.storage))?)
    }

    /// Path of the spilled updates of a tile, which exist only while the map is written.
    pub fn spill(&self, tile: TileIndex) -> PathBuf {
        self.tile_folder(tile).join(SPILL)
    }

    /// Path of a replacement of a tile's next version, while it is incomplete.
    pub(super) fn replacement(&self, tile: TileIndex) -> PathBuf {
        self.tile_folder(tile).join(REPLACEMENT)
    }

    /// Path of the folder of snapshots.
    pub fn snapshots(&self) -> PathBuf {
        self.folder.join(SNAPSHOTS)
    }

    /// Path of the file of a snapshot.
    pub fn snapshot(&self, name: &SnapshotName) -> PathBuf {
        self.snapshots().join(name.as_str())
    }

    /// Path of a snapshot that is being written. No snapshot has this name.
    pub(super) fn snapshot_next(&self) -> PathBuf {
        self.snapshots().join(SNAPSHOT_NEXT)
    }

    /// Path of the folder for files that repair removes from the map.
    pub fn quarantine(&self) -> PathBuf {
        self.folder.join(QUARANTINE)
    }

    /// Returns whether the name is that of a temporary file in the map's folder, which is renamed or discarded.
    pub fn is_next_of_map(name: &str) -> bool {
        OWN_NEXT.contains(&name) || name == SCANS_NEXT
    }

    /// Returns whether the name is that of a temporary file in a tile's folder, which is renamed or discarded.
    pub fn is_next_of_tile(&self, name: &str) -> bool {
        let is_version = self.files().iter().any(|file| file.next_name(self.storage) == name);
        is_version || name == SPILL || name == REPLACEMENT
    }

    /// Path of the version of a tile's file to be committed next.
    pub fn next(&self, tile: TileIndex, file: TileFile) -> PathBuf {
        self.tile_folder(tile).join(file.next_name(self.storage))
    }
}

/// Replacements of `metadata.json` and `commits.log`, before they are renamed.
pub(super) const OWN_NEXT: [&str; 2] = ["metadata.json.next", "commits.log.next"];

const SCANS_NEXT: &str = "scans.bin.next";

/// File of spilled updates of a tile. The name ends with `.next` like those of all uncommitted files.
pub(super) const SPILL: &str = "updates.next";

pub(super) const REPLACEMENT: &str = "replacement.next";

/// Name of the folder for files that repair removes from the map.
pub const QUARANTINE: &str = "quarantine";

/// Name of the folder of snapshots.
pub const SNAPSHOTS: &str = "snapshots";

/// Name of a snapshot that is being written.
pub const SNAPSHOT_NEXT: &str = ".next";

/// Name of the folder of kept scans.
pub const KEPT_SCANS: &str = "kept_scans";

const CATALOG_PREFIX: &str = "catalog.";
const SEGMENT_PREFIX: &str = "segment.";
const KEPT_SUFFIX: &str = ".flush";

fn number_behind(prefix: &str, name: &str) -> Option<u64> {
    let number = name.strip_prefix(prefix)?;
    // Reject other spellings such as `007`: the store would look for `7`.
    number.parse().ok().filter(|parsed: &u64| parsed.to_string() == number)
}

/// Returns the name of a tile's folder, such as `tile_0_1_-1`.
pub fn folder_name(tile: TileIndex) -> String {
    format!("tile_{}_{}_{}", tile.x, tile.y, tile.z)
}

/// Parses the name of a tile's folder; `None` for any spelling other than [`folder_name`]'s.
pub fn tile_of_folder(name: &str) -> Option<TileIndex> {
    let mut numbers = name.strip_prefix("tile_")?.split('_').map(str::parse);
    let tile = TileIndex::new(numbers.next()?.ok()?, numbers.next()?.ok()?, numbers.next()?.ok()?);
    (folder_name(tile) == name).then_some(tile)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_tables_are_recognized_by_name() {
        let tile = TileIndex::new(0, 1, -1);
        for storage in [Storage::OctoMap, Storage::Compact] {
            let layout = Layout::new("map").with_storage(storage);
            let kept = layout.kept(tile, 12);
            let name = kept.file_name().unwrap().to_str().unwrap();
            assert_eq!(layout.flush_of_kept(name), Some(12));
            assert_eq!(layout.flush_of_kept(TileFile::Table.name(storage)), None);
        }
        assert_eq!(Layout::new("map").flush_of_kept("tile.vxt.flush12"), None);
    }

    #[test]
    fn only_canonical_folder_names_are_tiles() {
        let tile = TileIndex::new(0, 1, -1);
        assert_eq!(folder_name(tile), "tile_0_1_-1");
        assert_eq!(tile_of_folder("tile_0_1_-1"), Some(tile));
        for name in [
            "tile_0_1",
            "tile_0_1_-1_2",
            "tile_00_1_-1",
            "tile_+0_1_-1",
            "tile_0_1_-0",
            "tile_0_1_3000000000",
        ] {
            assert_eq!(tile_of_folder(name), None, "{name}");
        }
    }
}
