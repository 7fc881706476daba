use super::kept_points::KeptLocations;
use crate::space::TileIndex;
use crate::store::{Disk, EntryKind, Layout, SegmentPlace};
use std::collections::{BTreeMap, BTreeSet};

/// Part of a map that may be damaged and is checked again.
pub(super) enum Recheck {
    /// The list of scans.
    List,
    /// A snapshot, or a table that only snapshots see.
    Snapshots,
    /// A catalog of kept scans.
    Catalog,
    /// The points of a kept scan.
    Points(SegmentPlace),
    /// A tile of the map, and whether its table is intact and counted.
    Tile(TileIndex, bool),
    /// The folder of a tile that is not in the map.
    Folder(TileIndex),
}

#[derive(Debug, Default)]
pub(super) struct Rechecks {
    pub(super) list: bool,
    pub(super) snapshots: bool,
    pub(super) catalogs: bool,
    pub(super) points: KeptLocations,
    pub(super) tiles: BTreeMap<TileIndex, bool>,
    pub(super) folders: BTreeSet<TileIndex>,
}

impl Rechecks {
    pub(super) fn add(&mut self, part: Recheck) {
        match part {
            Recheck::List => self.list = true,
            Recheck::Snapshots => self.snapshots = true,
            Recheck::Catalog => self.catalogs = true,
            Recheck::Points(place) => self.points.insert(place),
            Recheck::Tile(tile, is_counted) => drop(self.tiles.insert(tile, is_counted)),
            Recheck::Folder(tile) => drop(self.folders.insert(tile)),
        }
    }

    pub(super) fn len(&self) -> u64 {
        let some = [self.list, self.snapshots, self.catalogs].into_iter().filter(|&is_one| is_one).count();
        (some + self.points.len() + self.tiles.len() + self.folders.len()) as u64
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Length of a log and its last bytes. They include the checksum of the last record, so they identify the state of the
/// log.
pub(super) type LogEnd = (u64, Vec<u8>);

/// Number of bytes compared at the end of the log.
const LOG_END_BYTES: usize = 64;

/// Returns the current end of the log; `None` if there is no readable log.
pub(super) fn log_end(disk: &dyn Disk, layout: &Layout) -> Option<LogEnd> {
    let path = layout.commit_log();
    let Ok(Some(EntryKind::File(bytes))) = disk.kind(&path) else { return None };
    let offset = bytes.saturating_sub(LOG_END_BYTES as u64);
    Some((bytes, disk.read_at(&path, offset, LOG_END_BYTES).ok()?))
}

/// Returns the beginning of `metadata.json`; `None` if it is unreadable.
pub(super) fn metadata_text(disk: &dyn Disk, layout: &Layout) -> Option<Vec<u8>> {
    disk.read_at(&layout.metadata(), 0, METADATA_BYTES).ok()
}

/// Number of bytes of `metadata.json` that are compared. The flush number is near its beginning.
const METADATA_BYTES: usize = 1 << 16;
