use super::kept_points::KeptPlaces;
use crate::space::TileIndex;
use crate::store::{Disk, EntryKind, Layout, SegmentPlace};
use std::collections::{BTreeMap, BTreeSet};

/// What seemed damaged.
pub(super) enum Suspect {
    /// The list of scans.
    List,
    /// A snapshot, or a table that only snapshots see.
    Snapshots,
    /// A catalog of kept scans.
    Catalog,
    /// The points of a kept scan.
    Points(SegmentPlace),
    /// A tile of the map, and whether its table is whole and counted.
    Tile(TileIndex, bool),
    /// The folder of a tile that the map has not got.
    Folder(TileIndex),
}

/// Several of them.
#[derive(Debug, Default)]
pub(super) struct Suspects {
    pub(super) list: bool,
    pub(super) snapshots: bool,
    pub(super) catalogs: bool,
    pub(super) points: KeptPlaces,
    pub(super) tiles: BTreeMap<TileIndex, bool>,
    pub(super) folders: BTreeSet<TileIndex>,
}

impl Suspects {
    pub(super) fn add(&mut self, suspect: Suspect) {
        match suspect {
            Suspect::List => self.list = true,
            Suspect::Snapshots => self.snapshots = true,
            Suspect::Catalog => self.catalogs = true,
            Suspect::Points(place) => self.points.insert(place),
            Suspect::Tile(tile, is_counted) => drop(self.tiles.insert(tile, is_counted)),
            Suspect::Folder(tile) => drop(self.folders.insert(tile)),
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> u64 {
        let some = [self.list, self.snapshots, self.catalogs].into_iter().filter(|&is_one| is_one).count();
        (some + self.points.len() + self.tiles.len() + self.folders.len()) as u64
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Length of a log, and its last bytes. The checksum of the last record is among them, so that no two states of a log
/// have the same.
pub(super) type LogEnd = (u64, Vec<u8>);

/// How many bytes of its end tell that a log is the same.
const LOG_END_BYTES: usize = 64;

/// The current end of the log; `None` if there is no log or it cannot be read.
pub(super) fn log_end(disk: &dyn Disk, layout: &Layout) -> Option<LogEnd> {
    let path = layout.commit_log();
    let Ok(Some(EntryKind::File(bytes))) = disk.kind(&path) else { return None };
    let offset = bytes.saturating_sub(LOG_END_BYTES as u64);
    Some((bytes, disk.read_at(&path, offset, LOG_END_BYTES).ok()?))
}

/// The beginning of `metadata.json`; `None` where it cannot be read.
pub(super) fn metadata_text(disk: &dyn Disk, layout: &Layout) -> Option<Vec<u8>> {
    disk.read_at(&layout.metadata(), 0, METADATA_BYTES).ok()
}

/// How many bytes of `metadata.json` are compared: its numbers are at its beginning.
const METADATA_BYTES: usize = 1 << 16;
