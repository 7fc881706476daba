use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::{EntryKind, MapPath, TileStore, tile_of_folder};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Replaced tables on disk that readers or snapshots still use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct KeptBytes {
    /// Number of tables that only readers use. They are removed by the first flush after these readers end, or when the
    /// map is next opened for writing.
    pub reader_tables: u64,
    /// Bytes of these tables.
    pub reader_bytes: u64,
    /// Number of tables that snapshots use.
    pub snapshot_tables: u64,
    /// Bytes of these tables.
    pub snapshot_bytes: u64,
}

/// Counts the replaced tables in `folder` that are kept. Lists the folder of every tile. Takes no lock, so the numbers
/// can be inconsistent while a writer is active.
///
/// # Errors
///
/// No map, a damaged index, or an I/O error.
pub fn kept_bytes(folder: impl Into<MapPath>) -> Result<KeptBytes> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let store = TileStore::open_read_only(disk.clone(), folder)?;
    let mut kept: BTreeMap<TileIndex, BTreeSet<u64>> = BTreeMap::new();
    for name in disk.list(folder).map_err(|error| Error::io(folder, "list", error))? {
        let Some(tile) = tile_of_folder(&name) else { continue };
        let flushes = store.tables().kept(tile)?;
        if !flushes.is_empty() {
            kept.insert(tile, flushes);
        }
    }
    let seen = seen_by_snapshots(&store, &kept)?;
    let mut counts = KeptBytes::default();
    for (tile, flush_number) in kept.iter().flat_map(|(tile, flushes)| flushes.iter().map(|n| (*tile, *n))) {
        let path = store.layout().kept(tile, flush_number);
        // Skip a table that was removed after it was listed, or that cannot be read.
        let Ok(Some(EntryKind::File(bytes))) = disk.kind(&path) else { continue };
        let (tables, all_bytes) = match seen.contains(&(tile, flush_number)) {
            true => (&mut counts.snapshot_tables, &mut counts.snapshot_bytes),
            false => (&mut counts.reader_tables, &mut counts.reader_bytes),
        };
        *tables += 1;
        *all_bytes += bytes;
    }
    Ok(counts)
}

/// Returns the kept tables that snapshots use. An unreadable snapshot is assumed to use all tables as of its flush.
fn seen_by_snapshots(
    store: &TileStore,
    kept: &BTreeMap<TileIndex, BTreeSet<u64>>,
) -> Result<BTreeSet<(TileIndex, u64)>> {
    let mut seen = BTreeSet::new();
    for name in store.snapshots().names()? {
        let snapshot = store.snapshots().read(&name).ok();
        let listed = store.snapshots().list().and_then(|listed| listed.flush_of(&name));
        let as_of_flush = snapshot.as_ref().map(|snapshot| snapshot.commits.flush_number).or(listed);
        for (&tile, flushes) in kept {
            match as_of_flush {
                _ if snapshot.as_ref().is_some_and(|of| !of.commits.tiles.contains(tile)) => {}
                Some(as_of_flush) => seen.extend(flushes.range(as_of_flush..).next().map(|&n| (tile, n))),
                None => seen.extend(flushes.iter().map(|&n| (tile, n))),
            }
        }
    }
    Ok(seen)
}
