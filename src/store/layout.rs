use super::snapshots::snapshot_name::SnapshotName;
use crate::config::Storage;
use crate::space::TileIndex;
use std::path::{Path, PathBuf};

/// Where the files of a map are.
#[derive(Clone, Debug)]
pub struct Layout {
    folder: PathBuf,
    storage: Storage,
}

/// One of the files of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileFile {
    /// `iwlo_meta.bin`, or with compact storage `tile.vxt`: the exact table.
    Table,
    /// `octree.bt`: the octree as OctoMap writes it; not with compact storage.
    Octree,
}

impl TileFile {
    /// The files that a tile has, in the order in which they are written and renamed: the table, which names the
    /// octree's checksum, comes last.
    pub const fn all(storage: Storage) -> &'static [Self] {
        match storage {
            Storage::OctoMap => &[Self::Octree, Self::Table],
            Storage::Compact => &[Self::Table],
        }
    }

    /// The file's name.
    pub const fn name(self, storage: Storage) -> &'static str {
        match (self, storage) {
            (Self::Table, Storage::OctoMap) => "iwlo_meta.bin",
            (Self::Table, Storage::Compact) => "tile.vxt",
            (Self::Octree, _) => "octree.bt",
        }
    }

    /// The name of the version that waits for the next commit.
    pub const fn next_name(self, storage: Storage) -> &'static str {
        match (self, storage) {
            (Self::Table, Storage::OctoMap) => "iwlo_meta.bin.next",
            (Self::Table, Storage::Compact) => "tile.vxt.next",
            (Self::Octree, _) => "octree.bt.next",
        }
    }
}

impl Layout {
    /// The layout of the map in `folder`, if its tiles are the original files.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), storage: Storage::OctoMap }
    }

    /// The same with tiles stored in this way.
    pub fn with_storage(self, storage: Storage) -> Self {
        Self { storage, ..self }
    }

    /// How the tiles are stored.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// The files that each tile has, in the order in which they are written and renamed.
    pub fn files(&self) -> &'static [TileFile] {
        TileFile::all(self.storage)
    }

    /// The map's own folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// `metadata.json`.
    pub fn metadata(&self) -> PathBuf {
        self.folder.join("metadata.json")
    }

    /// `commits.log`.
    pub fn commit_log(&self) -> PathBuf {
        self.folder.join("commits.log")
    }

    /// `scans.bin`.
    pub fn scans(&self) -> PathBuf {
        self.folder.join("scans.bin")
    }

    /// What is to take the place of a damaged `scans.bin`.
    pub(super) fn scans_next(&self) -> PathBuf {
        self.folder.join(SCANS_NEXT)
    }

    /// The folder of the scans that the map keeps.
    pub fn kept_scans(&self) -> PathBuf {
        self.folder.join(KEPT_SCANS)
    }

    /// A catalog of these scans: which there are from a flush on.
    pub(super) fn catalog(&self, generation: u64) -> PathBuf {
        self.kept_scans().join(format!("{CATALOG_PREFIX}{generation}"))
    }

    /// The generation of a catalog's name; `None` for another name.
    pub(super) fn generation_of(name: &str) -> Option<u64> {
        number_behind(CATALOG_PREFIX, name)
    }

    /// A file with the points of some of them.
    pub(super) fn segment(&self, segment: u64) -> PathBuf {
        self.kept_scans().join(format!("{SEGMENT_PREFIX}{segment}"))
    }

    /// The number of a segment's name; `None` for another name.
    pub(super) fn segment_of(name: &str) -> Option<u64> {
        number_behind(SEGMENT_PREFIX, name)
    }

    /// Whether a file of the folder of kept scans has this name.
    pub fn is_of_kept_scans(name: &str) -> bool {
        Self::generation_of(name).is_some() || Self::segment_of(name).is_some()
    }

    /// The file that a writer holds locked.
    pub fn lock(&self) -> PathBuf {
        self.folder.join("writer.lock")
    }

    /// The folder of a tile.
    pub fn tile_folder(&self, tile: TileIndex) -> PathBuf {
        self.folder.join(folder_name(tile))
    }

    /// The committed version of a tile's file.
    pub fn current(&self, tile: TileIndex, file: TileFile) -> PathBuf {
        self.tile_folder(tile).join(file.name(self.storage))
    }

    /// The table of a tile as of a flush, kept beside newer ones for readers that opened the map then and for
    /// snapshots.
    pub fn kept(&self, tile: TileIndex, flush_number: u64) -> PathBuf {
        let table = TileFile::Table.name(self.storage);
        self.tile_folder(tile).join(format!("{table}{KEPT_SUFFIX}{flush_number}"))
    }

    /// The flush number of a kept table's name; `None` for another name.
    pub fn flush_of_kept(&self, name: &str) -> Option<u64> {
        number_behind(KEPT_SUFFIX, name.strip_prefix(TileFile::Table.name(self.storage))?)
    }

    /// Spilled updates of a tile, while the map is written to.
    pub fn spill(&self, tile: TileIndex) -> PathBuf {
        self.tile_folder(tile).join(SPILL)
    }

    /// A file that is to take the place of a tile's next version, until it is whole.
    pub(super) fn replacement(&self, tile: TileIndex) -> PathBuf {
        self.tile_folder(tile).join(REPLACEMENT)
    }

    /// The folder of snapshots.
    pub fn snapshots(&self) -> PathBuf {
        self.folder.join(SNAPSHOTS)
    }

    /// A snapshot.
    pub fn snapshot(&self, name: &SnapshotName) -> PathBuf {
        self.snapshots().join(name.as_str())
    }

    /// A snapshot that is being written; no snapshot has such a name.
    pub(super) fn snapshot_next(&self) -> PathBuf {
        self.snapshots().join(SNAPSHOT_NEXT)
    }

    /// Where repair puts what it takes out of the map.
    pub fn quarantine(&self) -> PathBuf {
        self.folder.join(QUARANTINE)
    }

    /// Whether a file of the map's own folder has this name until it takes the place of another, or is given up.
    pub fn is_next_of_map(name: &str) -> bool {
        OWN_NEXT.contains(&name) || name == SCANS_NEXT
    }

    /// The same of a file in the folder of a tile.
    pub fn is_next_of_tile(&self, name: &str) -> bool {
        let is_version = self.files().iter().any(|file| file.next_name(self.storage) == name);
        is_version || name == SPILL || name == REPLACEMENT
    }

    /// The version of a tile's file that waits for the next commit.
    pub fn next(&self, tile: TileIndex, file: TileFile) -> PathBuf {
        self.tile_folder(tile).join(file.next_name(self.storage))
    }
}

/// What takes the place of `metadata.json` and of `commits.log`, until it is whole.
pub(super) const OWN_NEXT: [&str; 2] = ["metadata.json.next", "commits.log.next"];

/// What takes the place of a damaged `scans.bin`.
const SCANS_NEXT: &str = "scans.bin.next";

/// The name of the file of updates that wait for a tile. Like all that no commit names, it ends with `.next`.
pub(super) const SPILL: &str = "updates.next";

/// The name of a file that is to take the place of a next version, until it is whole.
pub(super) const REPLACEMENT: &str = "replacement.next";

/// The name of the folder for what repair takes out of the map.
pub const QUARANTINE: &str = "quarantine";

/// The name of the folder of snapshots.
pub const SNAPSHOTS: &str = "snapshots";

/// The name of the file in it that is being written.
pub const SNAPSHOT_NEXT: &str = ".next";

/// The name of the folder of the scans that a map keeps.
pub const KEPT_SCANS: &str = "kept_scans";

const CATALOG_PREFIX: &str = "catalog.";
const SEGMENT_PREFIX: &str = "segment.";
const KEPT_SUFFIX: &str = ".flush";

/// The number behind a prefix; `None` for another name.
fn number_behind(prefix: &str, name: &str) -> Option<u64> {
    let number = name.strip_prefix(prefix)?;
    // Only the canonical spelling: the store would look for 7, not for 007.
    number.parse().ok().filter(|parsed: &u64| parsed.to_string() == number)
}

/// The name of a tile's folder, such as `tile_0_1_-1`.
pub fn folder_name(tile: TileIndex) -> String {
    format!("tile_{}_{}_{}", tile.x, tile.y, tile.z)
}

/// The tile of a folder's name; `None` for any other spelling than [`folder_name`]'s.
pub fn tile_of_folder(name: &str) -> Option<TileIndex> {
    let mut numbers = name.strip_prefix("tile_")?.split('_').map(str::parse);
    let tile = TileIndex::new(numbers.next()?.ok()?, numbers.next()?.ok()?, numbers.next()?.ok()?);
    (folder_name(tile) == name).then_some(tile)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_table_is_known_by_its_name() {
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
    fn only_the_one_spelling_of_a_folder_is_a_tile() {
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
