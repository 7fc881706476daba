use crate::config::MapConfig;
use crate::error::{Error, FormatError, Result};
use crate::persistence::load::read_stored_table;
use crate::persistence::{TileSaver, check_points, config_from, read_marks};
use crate::space::TileIndex;
use crate::store::{
    KeptRecord, MapPath, Metadata, SnapshotName, TileFile, TileStore, TileVersion, check_segment,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Result of [`revert`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Reverted {
    /// Number of the last scan in the map before.
    pub scan_number_before: u64,
    /// Number of the last scan in the map now.
    pub scan_number: u64,
    /// Number of the flush of the revert.
    pub flush_number: u64,
    /// Number of tiles in the map now.
    pub tiles: u64,
    /// Number of tiles that had changed since the snapshot and were restored.
    pub tiles_restored: u64,
    /// Number of tiles that were added since the snapshot and removed.
    pub tiles_removed: u64,
    /// Whether nothing was done, because the map already equalled the snapshot and a snapshot `keep_as` existed. Either
    /// an earlier call has reverted the map, or the map has not changed since the snapshot.
    pub was_done: bool,
}

/// Resets the map in `folder` to a snapshot: tiles, scan number and inputs. The revert is one commit with a new flush
/// number. Snapshots and open readers are unaffected.
///
/// Changes since the snapshot are lost, unless `keep_as` names a new snapshot to keep them. A killed call can be
/// repeated. If the snapshot `keep_as` already has the current state, it is reused. If the map already equals `name`
/// and the name `keep_as` is taken, nothing is done.
///
/// `progress` receives the number of tiles done and in total. Memory: the lists of tiles of the map and of the
/// snapshot, and one tile.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if there is no such snapshot, [`Error::AlreadyExists`] if the snapshot `keep_as` exists
/// with another state; no map, another writer, a damaged table, damaged kept scans of the snapshot, or an I/O error.
/// The map is unchanged then. A snapshot `keep_as` may have been created, unless kept scans are damaged.
pub fn revert(
    folder: impl Into<MapPath>,
    name: &SnapshotName,
    keep_as: Option<&SnapshotName>,
    progress: impl FnMut(u64, u64),
) -> Result<Reverted> {
    let (disk, folder) = folder.into().into_parts();
    let folder = &*folder;
    let mut store = TileStore::open(disk.clone(), folder)?;
    let past = TileStore::open_snapshot(disk.clone(), folder, name)?;
    check_is_of_map(&store, &past)?;
    if past.archive().is_on() {
        check_kept_scans(&store, &past)?;
    }
    if let Some(keep_as) = keep_as {
        if store.snapshots().names()?.contains(keep_as) && store.is_as(&past)? {
            let (scan_number, tiles) = (store.commits().scan_number, store.tiles().count() as u64);
            let flush_number = store.commits().flush_number;
            let (scan_number_before, was_done) = (scan_number, true);
            let reverted = Reverted {
                scan_number_before,
                scan_number,
                flush_number,
                tiles,
                was_done,
                ..Reverted::default()
            };
            return Ok(reverted);
        }
        store.snapshot_writer().create(keep_as)?;
    }
    let outcome = revert_to(&mut store, &past, progress);
    if outcome.is_ok()
        && let Err(error) = store.release_scans()
    {
        log::warn!("{}: unneeded kept scans remain: {error:#}", folder.display());
    }
    drop(store);
    // Opening the map removes the uncommitted files.
    if outcome.is_err()
        && let Err(error) = TileStore::open(disk, folder)
    {
        log::warn!("{}: the cleanup after an error failed: {error:#}", folder.display());
    }
    outcome
}

fn revert_to(
    store: &mut TileStore,
    past: &TileStore,
    mut progress: impl FnMut(u64, u64),
) -> Result<Reverted> {
    let mut reverted = Reverted { scan_number_before: store.commits().scan_number, ..Reverted::default() };
    let mut reverter = Reverter::new(store, past)?;
    let mut tiles: Vec<_> = past.tiles().iter().collect();
    tiles.sort_unstable();
    for (done, &tile) in (1..).zip(&tiles) {
        reverted.tiles_restored += u64::from(reverter.restore(tile)?);
        progress(done, tiles.len() as u64);
    }
    for tile in store.tiles().iter().collect::<Vec<_>>() {
        if past.tiles().version(tile).is_none() {
            store.remove(tile)?;
            reverted.tiles_removed += 1;
        }
    }
    store.note_rewind(past)?;
    store.commit(past.metadata().clone(), past.commits().scan_number)?;
    reverted.scan_number = store.commits().scan_number;
    reverted.flush_number = store.commits().flush_number;
    reverted.tiles = tiles.len() as u64;
    Ok(reverted)
}

/// Checks that a map can be reverted to a snapshot.
fn check_is_of_map(store: &TileStore, past: &TileStore) -> Result<()> {
    let lengths = |metadata: &Metadata| [metadata.resolution_m, metadata.tile_size_m].map(f64::to_bits);
    if lengths(store.metadata()) != lengths(past.metadata())
        || store.metadata().storage() != past.metadata().storage()
    {
        let reason = "the snapshot has another resolution, tile size or storage than its map";
        let path = past.opened_snapshot().map(|name| past.layout().snapshot(name)).unwrap_or_default();
        return Err(FormatError::at_offset(0, reason).in_map(&path, None));
    }
    for tile in store.tiles().orphans() {
        if past.tiles().version(tile).is_some() {
            let hint = "it is not part of the map; `voxtile repair` moves it to quarantine";
            return Err(Error::AlreadyExists { path: store.layout().tile_folder(tile), hint });
        }
    }
    Ok(())
}

/// Checks that the scans of a snapshot exist. Scans that the map keeps too are not read, because the revert does not
/// affect them.
fn check_kept_scans(store: &TileStore, past: &TileStore) -> Result<()> {
    let (disk, layout) = (&**past.disk(), past.layout());
    let mut own = store.archive().is_on().then(|| store.archive().records().ok()).flatten();
    let mut next_own: Option<KeptRecord> = None;
    let mut ends = BTreeMap::new();
    let mut records = past.archive().records()?;
    while let Some(scan) = records.next_kept()? {
        while let Some(some) = &mut own
            && next_own.as_ref().is_none_or(|known| known.number < scan.number)
        {
            match some.next_kept() {
                Ok(Some(known)) => next_own = Some(known),
                // An error is ignored: the revert replaces the damaged part of the map's catalog.
                Ok(None) | Err(_) => own = None,
            }
        }
        let is_same = |known: &KeptRecord| {
            known.place == scan.place && known.points == scan.points && known.moving == scan.moving
        };
        if next_own.as_ref().is_some_and(is_same) {
            for place in scan.places() {
                let end = ends.entry(place.segment).or_insert(0);
                *end = place.offset.saturating_add(place.bytes).max(*end);
            }
        } else {
            check_points(disk, layout, &scan)?;
            read_marks(disk, layout, &scan)?;
        }
    }
    ends.into_iter().try_for_each(|(segment, end)| check_segment(disk, layout, segment, end))
}

struct Reverter<'a> {
    store: &'a mut TileStore,
    past: &'a TileStore,
    config: MapConfig,
    saver: TileSaver,
}

impl<'a> Reverter<'a> {
    fn new(store: &'a mut TileStore, past: &'a TileStore) -> Result<Self> {
        let config = config_from(past.metadata(), past.folder())?;
        let saver = TileSaver::new(&config);
        Ok(Self { store, past, config, saver })
    }

    /// Restores the snapshot's version of a tile with the next commit. Returns `false` if the map already has this
    /// version.
    fn restore(&mut self, tile: TileIndex) -> Result<bool> {
        let Some(version) = self
            .past
            .tiles()
            .version(tile)
            .filter(|_| self.past.tiles().version(tile) != self.store.tiles().version(tile))
        else {
            return Ok(false);
        };
        let stored = self.past.tables().open(tile)?.ok_or_else(|| self.missing(tile))?;
        let path = stored.path.clone();
        // Verified against the snapshot, before anything is changed.
        let read = read_stored_table(&self.config.grid, tile, stored)?;
        if self.has_octree_of(tile, &read.table, version)? {
            self.store.link_next(tile, &path)?;
            self.store.tiles_mut().note_next(tile, version);
        } else {
            // Another version of the program built the octree that the table names, so both are written again.
            let scan_number = read.trailer.map_or(version.scan_number, |trailer| trailer.scan_number);
            let version = self.saver.write(&self.store.writer()?, tile, &read.table, scan_number)?;
            self.store.tiles_mut().note_next(tile, version);
        }
        Ok(true)
    }

    /// Builds the octree, and returns whether its version is that of the snapshot.
    fn has_octree_of(
        &mut self,
        tile: TileIndex,
        table: &crate::tile::Table,
        version: TileVersion,
    ) -> Result<bool> {
        if !self.store.layout().files().contains(&TileFile::Octree) {
            return Ok(true);
        }
        let (resolution_m, threshold) = (self.config.grid.resolution_m(), self.config.occupied_log_odds());
        let octree = self.store.write_next(tile, TileFile::Octree, |mut out| {
            table.write_bt(resolution_m, threshold as f32, &mut out)
        })?;
        Ok(octree == version.octree)
    }

    fn missing(&self, tile: TileIndex) -> Error {
        let path = self.past.layout().current(tile, TileFile::Table);
        FormatError::at_offset(0, "the snapshot does not contain this tile").in_map(&path, Some(tile))
    }
}
