use crate::space::TileIndex;
use std::path::{Path, PathBuf};

/// Where the files of a map are.
#[derive(Clone, Debug)]
pub struct Layout {
    folder: PathBuf,
}

/// One of the two files of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TileFile {
    /// `iwlo_meta.bin`: the exact table.
    Table,
    /// `octree.bt`: the octree as OctoMap writes it.
    Octree,
}

impl TileFile {
    /// Both files, in the order in which they are written and renamed: the table, which names the octree's
    /// checksum, comes last.
    pub const IN_ORDER: [Self; 2] = [Self::Octree, Self::Table];

    /// The file's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Table => "iwlo_meta.bin",
            Self::Octree => "octree.bt",
        }
    }

    /// The name of the version that waits for the next commit.
    pub const fn next_name(self) -> &'static str {
        match self {
            Self::Table => "iwlo_meta.bin.next",
            Self::Octree => "octree.bt.next",
        }
    }
}

impl Layout {
    /// The layout of the map in `folder`.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
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
        self.tile_folder(tile).join(file.name())
    }

    /// The table of a tile as of a flush, kept beside newer ones for readers that opened the map then.
    pub fn kept(&self, tile: TileIndex, flush_number: u64) -> PathBuf {
        self.tile_folder(tile).join(format!("{KEPT_PREFIX}{flush_number}"))
    }

    /// Updates that wait for a tile while the map is written to.
    pub fn waiting(&self, tile: TileIndex) -> PathBuf {
        self.tile_folder(tile).join(WAITING)
    }

    /// Where repair puts what it takes out of the map.
    pub fn quarantine(&self) -> PathBuf {
        self.folder.join(QUARANTINE)
    }

    /// The version of a tile's file that waits for the next commit.
    pub fn next(&self, tile: TileIndex, file: TileFile) -> PathBuf {
        self.tile_folder(tile).join(file.next_name())
    }
}

/// The name of the file of updates that wait for a tile. Like all that no commit names, it ends with `.next`.
pub(super) const WAITING: &str = "updates.next";

/// The name of the folder for what repair takes out of the map.
pub const QUARANTINE: &str = "quarantine";

const KEPT_PREFIX: &str = "iwlo_meta.bin.flush";

/// The flush number of a kept table's name; `None` for another name.
pub fn flush_of_kept(name: &str) -> Option<u64> {
    name.strip_prefix(KEPT_PREFIX)?.parse().ok()
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
