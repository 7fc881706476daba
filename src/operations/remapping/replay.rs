use super::change::Changes;
use super::completion::{complete, remove_second_map};
use super::finished_parts::FinishedParts;
use super::replay_part::ReplayPart;
use super::revision::Revision;
use crate::config::{MapConfig, MemoryLimit};
use crate::error::{Error, Result};
use crate::mapper::KeptSummary;
use crate::persistence::config_from;
use crate::scan::Stop;
use crate::store::{Disk, MapPath, SnapshotName, TileStore};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Options of a replay.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
#[must_use]
pub struct Replay {
    /// Memory limit.
    pub memory: MemoryLimit,
    /// Name of a new snapshot of the map before the change. Default: none.
    pub keep_as: Option<SnapshotName>,
    /// Whether the replay is only estimated and the map is unchanged. Default: no.
    pub is_dry_run: bool,
    /// Request to stop. After a stop the map is unchanged.
    pub stop: Stop,
    /// Finished parts of all columns ([`replay_part`](super::replay_part())), each with its shard if there is one.
    /// They are committed; the shards are unchanged. Default: this process replays the affected tiles.
    pub parts: Option<Vec<(Option<MapPath>, ReplayPart)>>,
}

impl Replay {
    /// Sets the memory limit.
    pub fn with_memory(self, memory: MemoryLimit) -> Self {
        Self { memory, ..self }
    }

    /// Sets the name of a new snapshot of the map before the change.
    pub fn with_keep_as(self, keep_as: impl Into<Option<SnapshotName>>) -> Self {
        Self { keep_as: keep_as.into(), ..self }
    }

    /// Sets whether the replay is only estimated.
    pub fn with_dry_run(self, is_dry_run: bool) -> Self {
        Self { is_dry_run, ..self }
    }

    /// Sets the request to stop.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }

    /// Sets finished parts, which the operation then commits: with the same change, the result is that of one process.
    pub fn with_parts(self, parts: impl Into<Option<Vec<(Option<MapPath>, ReplayPart)>>>) -> Self {
        Self { parts: parts.into(), ..self }
    }

    /// Checks what a replay needs, whatever the changes. Call this before a long search for changes.
    ///
    /// # Errors
    ///
    /// A map that keeps no scans or has other scans too; too little memory; another writer; [`Error::Changed`] if one
    /// has flushed since `scans` was read; an existing snapshot `keep_as`; damage; an I/O error.
    pub fn check(&self, scans: &KeptSummary) -> Result<()> {
        scans.check_keeps_all()?;
        let mut store = open(scans)?;
        self.config_of(&store)?;
        if let (Some(name), false) = (&self.keep_as, self.is_dry_run) {
            store.snapshot_writer().check_name(name)?;
        }
        Ok(())
    }

    /// Returns the configuration of a map, with the memory limit of the replay.
    ///
    /// # Errors
    ///
    /// Damage, or too little memory.
    pub(super) fn config_of(&self, store: &TileStore) -> Result<MapConfig> {
        let config = config_from(store.metadata(), &store.layout().metadata())?;
        MapConfig { memory: self.memory, ..config }.validated()
    }
}

/// Counts of a replay, or of its dry run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Replayed {
    /// Number of scans that the map keeps.
    pub scans: u64,
    /// Number of changed scans: moved, removed, or without some of their points.
    pub scans_changed: u64,
    /// Number of scans that were replayed, in whole or in part.
    pub scans_mapped: u64,
    /// Number of tiles in the map before.
    pub tiles: u64,
    /// Number of tiles that were cleared and replayed.
    pub tiles_mapped: u64,
    /// Number of voxel updates of all kept scans.
    pub updates: u64,
    /// Number of replayed voxel updates; estimated in a dry run.
    pub updates_mapped: u64,
    /// Estimated duration of the replay in seconds; only in a dry run.
    pub estimated_s: Option<f64>,
}

/// Replays the tiles that changed scans touch. The changes must be based on `scans`: a flush of the map since then is
/// an error. `progress` receives the number of scans done and in total.
pub(super) fn replay(
    scans: &KeptSummary,
    changes: Changes,
    how: &Replay,
    mut progress: impl FnMut(u64, u64),
) -> Result<Replayed> {
    let (disk, folder) = scans.place();
    let mut store = open(scans)?;
    let mut revision = Revision::new(scans, how, changes)?;
    let takes_points = revision.takes_points();
    if takes_points {
        // Checked before the search for affected tiles, which can take long.
        store.snapshots().check_catalogs()?;
    }
    let (touched, parts) = match &how.parts {
        Some(_) if how.is_dry_run => {
            return Err(Error::argument("parts", "a dry run replays nothing, so it has no parts"));
        }
        Some(_) if revision.counts.scans_changed == 0 => {
            revision.counts.tiles = store.tiles().count() as u64;
            return Ok(revision.counts);
        }
        Some(parts) => {
            let (parts, touched) = FinishedParts::of(parts, &store, &mut revision)?;
            (touched, Some(parts))
        }
        None => (revision.look(&store, None)?, None),
    };
    if how.is_dry_run || revision.counts.scans_changed == 0 {
        return Ok(revision.counts);
    }
    create_snapshot(&mut store, how)?;
    let mapped = revision.map(store, touched, parts, &mut progress);
    let (counts, released) = clean_up_after_error(disk.clone(), folder, mapped)?;
    let second = if takes_points { remove_second_map(disk.clone(), folder) } else { Ok(()) };
    match released {
        // The removed points must not remain in files: `complete` opens the map again and retries.
        Err(_) if takes_points => complete(disk, folder)?,
        Err(error) => log::warn!("{}: committed, but the cleanup failed: {error:#}", folder.display()),
        Ok(()) => {}
    }
    second?;
    Ok(counts)
}

/// Opens the map for writing, as of the flush of the summary.
pub(super) fn open(scans: &KeptSummary) -> Result<TileStore> {
    let (disk, folder) = scans.place();
    let store = TileStore::open(disk, folder)?;
    match store.commits().flush_number == scans.flush_number() {
        true => Ok(store),
        false => Err(Error::Changed { path: folder.to_owned() }),
    }
}

/// Creates the snapshot `keep_as` of the current map, if requested. An existing one of this state is reused.
pub(super) fn create_snapshot(store: &mut TileStore, how: &Replay) -> Result<()> {
    let Some(name) = &how.keep_as else { return Ok(()) };
    store.snapshot_writer().create(name)
}

pub(super) fn clean_up_after_error<T>(disk: Arc<dyn Disk>, folder: &Path, outcome: Result<T>) -> Result<T> {
    if outcome.is_err()
        && let Err(error) = TileStore::open(disk, folder)
    {
        log::warn!("{}: the cleanup after an error failed: {error:#}", folder.display());
    }
    outcome
}
