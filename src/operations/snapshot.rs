use crate::error::{Error, Result};
use crate::mapper::{MapReader, OutOfCoreTileMapper};
use crate::space::TileIndex;
use crate::store::{MapPath, Snapshot, SnapshotName, TileStore};
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::collections::BTreeSet;
use std::collections::hash_map::Entry;

/// A snapshot of a map: the map as of a flush, under a name.
///
/// A snapshot is one small file that says which tiles the map had, and what a reader is that never leaves: the tables
/// that it sees stay when they are replaced. So it costs next to nothing when it is made, and from then on the bytes of
/// the tables that have changed since.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SnapshotInfo {
    /// Its name.
    pub name: String,
    /// Number of the flush that it keeps.
    pub flush_number: u64,
    /// Number of the last scan in it.
    pub scan_number: u64,
    /// Tiles in it.
    pub tiles: u64,
    /// Observed voxels in it.
    pub voxels: u64,
    /// Bytes of the tables that it sees.
    pub table_bytes: u64,
    /// Bytes that no other snapshot and not the present map names: at most so many are free when it is deleted. Fewer
    /// are where a revert has linked a table, so that it is there under two names.
    pub own_bytes: u64,
    /// Why it cannot be read, if it cannot; the numbers are 0 then.
    pub damage: Option<String>,
}

/// Keeps the last flush of the map in `folder` under a name. A map of the original format gets an id and checksums
/// first, as before any change. A snapshot of this name that keeps this very state is left as it is, so a call that was
/// killed can be repeated.
///
/// # Errors
///
/// [`Error::AlreadyExists`] if there is a snapshot of this name and of another state; no map there, another writer, a
/// disk that refuses: there is no such snapshot then.
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

/// Deletes a snapshot, and the tables that no other one and no reader sees. A call that was killed can be repeated: it
/// completes the deletion.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if there is none of this name; no map there, another writer, a disk that refuses.
pub fn delete_snapshot(folder: impl Into<MapPath>, name: &SnapshotName) -> Result<()> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    TileStore::open(disk, folder)?.snapshot_writer().delete(name)
}

/// The snapshots of a map, by flush and then by name, those that cannot be read first. Takes no lock; beside a writer
/// the bytes may be those of a moment.
///
/// # Errors
///
/// No map there, or a disk that refuses. Damage is part of the answer.
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
            // Deleted since they were listed.
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

/// A snapshot that was just made: nothing has changed since, and no other is looked at.
///
/// # Errors
///
/// No map there, none of this name, damage, or a disk that refuses.
pub fn new_snapshot(folder: impl Into<MapPath>, name: &SnapshotName) -> Result<SnapshotInfo> {
    let (disk, folder) = folder.into().into_parts();
    let store = TileStore::open_read_only(disk, &folder)?;
    Ok(SnapshotInfo::of(&store.snapshots().read(name)?))
}

/// Who sees each of the kept tables.
#[derive(Default)]
struct Owners {
    owners: FxHashMap<(TileIndex, u64), Owner>,
    /// The flushes as of which tables of a tile are kept: snapshots have many tiles in common.
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
                continue; // It is the present one, under whatever names.
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
