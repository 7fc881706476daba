use crate::error::{Error, Result};
use crate::mapper::{MapReader, OutOfCoreTileMapper};
use crate::space::TileIndex;
use crate::store::{MapPath, Snapshot, SnapshotName, TileStore};
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::collections::BTreeSet;
use std::collections::hash_map::Entry;

/// Snapshot of a map: its state as of a flush, with a name.
///
/// A snapshot is one small file with the list of tiles. It acts like a permanent reader: its tables are kept when they
/// are replaced. So it initially needs almost no disk space, and later that of the replaced tables.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SnapshotInfo {
    /// Name of the snapshot.
    pub name: String,
    /// Number of its flush.
    pub flush_number: u64,
    /// Number of its last scan.
    pub scan_number: u64,
    /// Number of its tiles.
    pub tiles: u64,
    /// Number of its observed voxels.
    pub voxels: u64,
    /// Bytes of its tables.
    pub table_bytes: u64,
    /// Bytes of tables that only this snapshot uses: upper bound of the disk space freed by its deletion. Less is freed
    /// if a revert has made the map use such a table again, by a hard link.
    pub own_bytes: u64,
    /// Error if the snapshot is unreadable; all numbers are 0 then.
    pub damage: Option<String>,
}

/// Keeps the last flush of the map in `folder` under a name. A map of the original format is upgraded first. An
/// existing snapshot of this name and this state is kept, so a killed call can be repeated.
///
/// # Errors
///
/// [`Error::AlreadyExists`] if a snapshot of this name and another state exists; no map, another writer, or an I/O
/// error. There is no new snapshot then.
pub fn snapshot(folder: impl Into<MapPath>, name: &SnapshotName) -> Result<()> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let mut store = TileStore::open(disk.clone(), folder)?;
    if store.metadata().ext.is_some() {
        return store.snapshot_writer().create(name);
    }
    drop(store);
    let config = MapReader::config_of(MapPath::on(disk.clone(), folder))?;
    OutOfCoreTileMapper::open(MapPath::on(disk, folder), config)?.snapshot(name)
}

/// Deletes a snapshot, and the tables that no other snapshot and no reader uses. A killed call can be repeated.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if there is no snapshot of this name; no map, another writer, or an I/O error.
pub fn delete_snapshot(folder: impl Into<MapPath>, name: &SnapshotName) -> Result<()> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    TileStore::open(disk, folder)?.snapshot_writer().delete(name)
}

/// Lists the snapshots of a map, by flush and then by name, unreadable ones first. Takes no lock, so the numbers of
/// bytes can be inconsistent while a writer is active.
///
/// # Errors
///
/// No map, or an I/O error. Damage is part of the result.
pub fn snapshots(folder: impl Into<MapPath>) -> Result<Vec<SnapshotInfo>> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let store = TileStore::open_read_only(disk, folder)?;
    let (mut infos, mut owners) = (Vec::new(), Owners::default());
    for name in store.snapshots().names()? {
        match store.snapshots().read(&name) {
            Ok(snapshot) => {
                owners.count(&store, infos.len(), &snapshot)?;
                infos.push(SnapshotInfo::of(&snapshot));
            }
            Err(error @ (Error::Damaged { .. } | Error::Io { .. })) => {
                infos.push(SnapshotInfo::damaged(&name, &error));
            }
            // The snapshot was deleted after it was listed.
            Err(Error::InvalidArgument { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    for (_, owner) in owners.owners {
        if let Owner::One { snapshot, bytes } = owner {
            infos[snapshot].own_bytes += bytes;
        }
    }
    infos.sort_by(|a, b| (a.flush_number, &a.name).cmp(&(b.flush_number, &b.name)));
    Ok(infos)
}

/// Returns the information of a snapshot that was just created. Unlike [`snapshots`], this counts no tables for
/// [`SnapshotInfo::own_bytes`]: the map still has all of them.
///
/// # Errors
///
/// No map, no snapshot of this name, damage, or an I/O error.
pub fn new_snapshot(folder: impl Into<MapPath>, name: &SnapshotName) -> Result<SnapshotInfo> {
    let (disk, folder) = folder.into().into_parts();
    let store = TileStore::open_read_only(disk, &folder)?;
    Ok(SnapshotInfo::of(&store.snapshots().read(name)?))
}

/// For each kept table, the snapshots that use it.
#[derive(Default)]
struct Owners {
    owners: FxHashMap<(TileIndex, u64), Owner>,
    /// For each tile, the flush numbers of its kept tables. A cache, because most snapshots have the same tiles.
    kept: FxHashMap<TileIndex, BTreeSet<u64>>,
}

enum Owner {
    One { snapshot: usize, bytes: u64 },
    Several,
}

impl Owners {
    fn count(&mut self, store: &TileStore, number: usize, snapshot: &Snapshot) -> Result<()> {
        for (tile, version) in snapshot.commits.tiles.iter() {
            if store.tiles().version(tile) == Some(version) {
                continue; // The current version of the tile.
            }
            let kept = match self.kept.entry(tile) {
                Entry::Occupied(kept) => kept.into_mut(),
                Entry::Vacant(none) => none.insert(store.tables().kept(tile)?),
            };
            let Some(&flush_number) = kept.range(snapshot.commits.flush_number..).next() else { continue };
            let one = Owner::One { snapshot: number, bytes: version.table.bytes };
            self.owners
                .entry((tile, flush_number))
                .and_modify(|owner| *owner = Owner::Several)
                .or_insert(one);
        }
        Ok(())
    }
}

impl SnapshotInfo {
    fn of(snapshot: &Snapshot) -> Self {
        let versions = || snapshot.commits.tiles.values();
        Self {
            name: snapshot.name.to_string(),
            flush_number: snapshot.commits.flush_number,
            scan_number: snapshot.commits.scan_number,
            tiles: snapshot.commits.tiles.len() as u64,
            voxels: versions().map(|version| version.voxels).sum(),
            table_bytes: versions().map(|version| version.table.bytes).sum(),
            own_bytes: snapshot.bytes,
            damage: None,
        }
    }

    fn damaged(name: &SnapshotName, error: &Error) -> Self {
        let (flush_number, scan_number, tiles, voxels, table_bytes, own_bytes) = Default::default();
        let (name, damage) = (name.to_string(), Some(format!("{error:#}")));
        Self { name, flush_number, scan_number, tiles, voxels, table_bytes, own_bytes, damage }
    }
}
