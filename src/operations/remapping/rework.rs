use super::completion::{complete, remove_second_map};
use super::revision::{Changes, Revision};
use crate::config::MemoryLimit;
use crate::error::{Error, Result};
use crate::mapper::KeptSummary;
use crate::scan::Stop;
use crate::store::{Disk, SnapshotName, TileStore};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// How a map is mapped again.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
#[must_use]
pub struct Rework {
    /// How much memory it may use.
    pub memory: MemoryLimit,
    /// Name of a snapshot that keeps the map as it was. Default: none.
    pub keep_as: Option<SnapshotName>,
    /// Tells what would be done, and does nothing. Default: no.
    pub is_dry_run: bool,
    /// Ends the work when it is set; the map is as it was then.
    pub stop: Stop,
}

impl Rework {
    /// The same with another limit of memory.
    pub fn with_memory(self, memory: MemoryLimit) -> Self {
        Self { memory, ..self }
    }

    /// The same with a snapshot that keeps the map as it was.
    pub fn with_keep_as(self, keep_as: impl Into<Option<SnapshotName>>) -> Self {
        Self { keep_as: keep_as.into(), ..self }
    }

    /// The same, only telling what would be done.
    pub fn with_dry_run(self, is_dry_run: bool) -> Self {
        Self { is_dry_run, ..self }
    }

    /// The same with a request to stop.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }
}

/// What was mapped again, or would be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MappedAgain {
    /// Scans that the map keeps.
    pub scans: u64,
    /// Scans that differ from what they were: moved, removed, or without some of their points.
    pub scans_changed: u64,
    /// Scans that were mapped again, in whole or in part.
    pub scans_mapped: u64,
    /// Tiles that the map had.
    pub tiles: u64,
    /// Tiles that were emptied and mapped again.
    pub tiles_mapped: u64,
    /// Updates of voxels of all scans that the map kept.
    pub updates: u64,
    /// Updates of voxels that were done again; of a dry run an estimate.
    pub updates_mapped: u64,
    /// Of a dry run: about how many seconds the rest takes.
    pub estimated_s: Option<f64>,
}

/// Maps again what scans touch that change. The changes were decided by `scans`: the map must not have been flushed
/// since. `progress` is told the scans done and all.
pub(super) fn rework(
    scans: &KeptSummary,
    changes: Changes,
    how: &Rework,
    mut progress: impl FnMut(u64, u64),
) -> Result<MappedAgain> {
    let (disk, folder) = scans.place();
    let mut store = TileStore::open(disk.clone(), folder)?;
    if store.commits().flush_number != scans.flush_number() {
        return Err(Error::Changed { path: folder.to_owned() });
    }
    let mut revision = Revision::new(scans, how, changes);
    let takes_points = revision.takes_points();
    if takes_points {
        // Before the look, which may take long.
        store.snapshots().check_catalogs()?;
    }
    let touched = revision.look(&store)?;
    if how.is_dry_run || revision.counts.scans_changed == 0 {
        return Ok(revision.counts);
    }
    keep_as_it_is(&mut store, how)?;
    let (counts, released) = tidied(disk.clone(), folder, revision.map(store, touched, &mut progress))?;
    let second = if takes_points { remove_second_map(disk.clone(), folder) } else { Ok(()) };
    match released {
        // Points that are to be gone must not remain: once more, by another opening of the map.
        Err(_) if takes_points => complete(disk, folder)?,
        Err(error) => log::warn!("{}: committed, but not tidied up: {error:#}", folder.display()),
        Ok(()) => {}
    }
    second?;
    Ok(counts)
}

/// Makes the snapshot of the map as it is, if there is to be one. One of this state that is there already counts.
pub(super) fn keep_as_it_is(store: &mut TileStore, how: &Rework) -> Result<()> {
    let Some(name) = &how.keep_as else { return Ok(()) };
    store.snapshot_writer().create(name)
}

/// Gives room back that was written to in vain.
pub(super) fn tidied<T>(disk: Arc<dyn Disk>, folder: &Path, outcome: Result<T>) -> Result<T> {
    if outcome.is_err()
        && let Err(error) = TileStore::open(disk, folder)
    {
        log::warn!("{}: not tidied up after an error: {error:#}", folder.display());
    }
    outcome
}
