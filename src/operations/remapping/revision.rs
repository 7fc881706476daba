use super::filtered_scan::FilteredScan;
use crate::config::{MapConfig, MemoryLimit};
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, Remapper, TileFinder, check_keeps_all};
use crate::persistence::config_from;
use crate::scan::{Pose, ScanPoints, ScanReport, Stop};
use crate::space::{Aabb, TileIndex, TileSelection};
use crate::store::{
    CatalogEntry, Disk, EntryKind, KeptFrame, KeptRecord, Layout, MapPath, Metadata, Salvage, SideFolder,
    SnapshotName, TileStore, id_from_hex,
};
use rustc_hash::FxHashSet;
use serde::Serialize;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// How a map is mapped again.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct Rework {
    /// Most bytes of memory of all that grows with the map. Default: 512 MiB.
    pub memory_bytes: usize,
    /// Name of a snapshot that keeps the map as it was. Default: none.
    pub keep_as: Option<SnapshotName>,
    /// Tells what would be done, and does nothing. Default: no.
    pub is_dry_run: bool,
    /// Ends the work when it is set; the map is as it was then.
    pub stop: Stop,
}

impl Default for Rework {
    fn default() -> Self {
        Self { memory_bytes: 512 << 20, keep_as: None, is_dry_run: false, stop: Stop::default() }
    }
}

impl Rework {
    /// The same with another limit of memory.
    pub fn with_memory_bytes(self, memory_bytes: usize) -> Self {
        Self { memory_bytes, ..self }
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

/// What becomes of a scan.
pub(super) enum Fate {
    Stays,
    Moves(Box<Pose>),
    Goes,
    /// Its points in a box go.
    Loses(Aabb),
}

/// Where more than this part of all updates is of scans that changed, all is mapped again: looking for what they touch
/// would cost more than it spares.
const PART_FOR_ALL: u64 = 3;
/// Points of a kept scan that are read into memory; those of a larger one are read again when needed.
const MAX_POINTS_IN_MEMORY: u64 = 1 << 18;

/// Maps again what scans touch whose fate is not to stay. The fates were decided by what flush `seen` has; nothing may
/// have come since, whose fate nobody has looked at. `progress` is told the scans done and all.
pub(super) fn rework(
    map: MapPath,
    seen: u64,
    how: &Rework,
    fate: impl Fn(&KeptRecord) -> Fate,
    mut progress: impl FnMut(u64, u64),
) -> Result<MappedAgain> {
    let (disk, folder) = map.into_parts();
    let mut store = TileStore::open(disk.clone(), &folder)?;
    if store.commits().flush_number != seen {
        return Err(Error::Changed { path: folder });
    }
    let mut revision = Revision::new(disk.clone(), how, fate);
    // Before the look, which may take long.
    if revision.takes_points(&store)? {
        store.check_catalogs_of_snapshots()?;
    }
    let touched = revision.look(&store)?;
    if how.is_dry_run || revision.counts.scans_changed == 0 {
        return Ok(revision.counts);
    }
    let takes_points = !touched.segments.is_empty();
    keep_as_it_is(&mut store, how)?;
    let (counts, released) = tidied(disk.clone(), &folder, revision.map(store, touched, &mut progress))?;
    let second = if takes_points { remove_second_map(disk.clone(), &folder) } else { Ok(()) };
    match released {
        // Points that are to be gone must not remain: once more, by another opening of the map.
        Err(_) if takes_points => complete(disk, &folder)?,
        Err(error) => log::warn!("{}: committed, but not tidied up: {error:#}", folder.display()),
        Ok(()) => {}
    }
    second?;
    Ok(counts)
}

/// Does what a commit leaves to do, and removes what nothing needs any more of kept scans, durably.
fn release(store: &mut TileStore) -> Result<()> {
    store.checkpoint()?;
    store.release_scans()
}

/// Removes the second map that a remapping beside a mapper left when it was killed: it has the evidence of all scans.
/// Another map that has this name by chance has another id, and stays. A killed removal leaves a folder without the files
/// that have the id.
///
/// # Errors
///
/// A disk that refuses; a file in the second map that is of no map.
fn remove_second_map(disk: Arc<dyn Disk>, folder: &Path) -> Result<()> {
    let second = folder.with_added_extension("remapping");
    if !matches!(disk.kind(&second), Ok(Some(EntryKind::Folder))) {
        return Ok(());
    }
    let Some(id) = TileStore::open_read_only(disk.clone(), folder)?.map_id() else { return Ok(()) };
    let layout = Layout::new(&second);
    let has_id = disk.kind_at(&layout.metadata())?.is_some() || disk.kind_at(&layout.commit_log())?.is_some();
    if has_id {
        let remains = Salvage::read(&*disk, &layout)?;
        let id_in = |metadata: &Metadata| id_from_hex(&metadata.ext.as_ref()?.map_id);
        let written = remains.metadata.as_ref().ok().and_then(id_in);
        if remains.log_map_id.or(written) != Some(id) {
            return Ok(());
        }
    }
    match SideFolder::begin(disk, folder) {
        // At work, or a path without a name that none could be beside.
        Ok(_) | Err(Error::Locked { .. } | Error::InvalidArgument { .. }) => Ok(()),
        // A folder that has this name by chance: a removal begins only where all is of a map.
        Err(Error::AlreadyExists { .. }) if !has_id => Ok(()),
        Err(error) => Err(error),
    }
}

/// Completes what an earlier call may have left of a removal: what it took out of the map is in no file any more, except
/// for snapshots. Returns how many files with kept scans are gone by this. A map without such files need not be opened
/// for writing, so another writer is no error there.
///
/// # Errors
///
/// Damage, a disk that refuses; with files that are to be gone, another writer.
pub(super) fn complete_earlier(disk: Arc<dyn Disk>, folder: &Path) -> Result<u64> {
    let second = remove_second_map(disk.clone(), folder);
    let idle = TileStore::open_read_only(disk.clone(), folder)?.idle_scan_files()?.unwrap_or_default();
    match TileStore::open(disk.clone(), folder) {
        // The other writer has done it when it opened the map.
        Err(_) if idle.is_empty() => {}
        opened => opened.and_then(|mut store| release(&mut store)).map_err(with_hint)?,
    }
    second?;
    let mut removed = 0;
    for path in idle {
        removed += u64::from(disk.kind_at(&path)?.is_none());
    }
    Ok(removed)
}

/// Completes a removal that was committed and could not remove its files durably.
fn complete(disk: Arc<dyn Disk>, folder: &Path) -> Result<()> {
    TileStore::open(disk, folder).and_then(|mut store| release(&mut store)).map_err(with_hint)
}

/// The error of a removal that was not completed, with what to do.
fn with_hint(error: Error) -> Error {
    match error {
        Error::Io { path, action, cause } => {
            let hint = "points that were removed from the map are still in its files; run this again";
            Error::Io { path, action, cause: io::Error::new(cause.kind(), format!("{cause}; {hint}")) }
        }
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(
                "; points that were removed from the map are still in its files; repair the map, and run this again",
            );
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}

/// Makes the snapshot of the map as it is, if there is to be one. One of this state that is there already counts.
pub(super) fn keep_as_it_is(store: &mut TileStore, how: &Rework) -> Result<()> {
    let Some(name) = &how.keep_as else { return Ok(()) };
    store.create_snapshot(name)
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

/// A change of scans, and what it comes to.
pub(super) struct Revision<F> {
    disk: Arc<dyn Disk>,
    how: Rework,
    fate: F,
    pub(super) counts: MappedAgain,
}

/// What has to be mapped again.
pub(super) struct Touched {
    pub(super) config: MapConfig,
    /// `None` for all.
    tiles: Option<FxHashSet<TileIndex>>,
    /// Segments with points that go.
    segments: BTreeSet<u64>,
}

impl Touched {
    pub(super) fn has(&self, tile: TileIndex) -> bool {
        self.tiles.as_ref().is_none_or(|tiles| tiles.contains(&tile))
    }

    fn has_any_of(&self, record: &KeptRecord) -> bool {
        record.tiles.iter().any(|&tile| self.has(tile))
    }
}

impl<F: Fn(&KeptRecord) -> Fate> Revision<F> {
    pub(super) fn new(disk: Arc<dyn Disk>, how: &Rework, fate: F) -> Self {
        Self { disk, how: how.clone(), fate, counts: MappedAgain::default() }
    }

    /// Whether points are to be taken out of the map.
    fn takes_points(&self, store: &TileStore) -> Result<bool> {
        if !store.keeps_scans() {
            return Ok(false);
        }
        let mut records = store.kept_records()?;
        while let Some(record) = records.next_kept()? {
            if let Fate::Goes | Fate::Loses(_) = (self.fate)(&record) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Finds out what the change touches.
    pub(super) fn look(&mut self, store: &TileStore) -> Result<Touched> {
        let config = self.config_of(store)?;
        check_keeps_all(store.keeps_scans().then(|| store.kept_records()).transpose()?, store.folder())?;
        let changed_updates = self.count(store)?;
        self.counts.tiles = store.count_tiles() as u64;
        let mut touched = Touched { config, tiles: None, segments: BTreeSet::new() };
        let are_all = changed_updates > self.counts.updates / PART_FOR_ALL;
        let mut tiles = FxHashSet::default();
        let mut finder = TileFinder::new(&touched.config, self.disk.clone(), self.how.stop.clone());
        let (began, mut looked_at) = (Instant::now(), 0);
        let mut records = store.kept_records()?;
        while let Some(record) = records.next_kept()? {
            self.how.stop.check()?;
            let fate = (self.fate)(&record);
            if let Fate::Goes | Fate::Loses(_) = fate {
                touched.segments.insert(record.place.segment);
            }
            if are_all || matches!(fate, Fate::Stays) {
                continue;
            }
            if !matches!(fate, Fate::Loses(_)) {
                tiles.extend(record.tiles.iter().copied());
            }
            if matches!(fate, Fate::Goes) {
                continue;
            }
            let scan = self.open(store, record)?;
            let (rays, updates) = (*scan.rays(), scan.record().updates);
            tiles.extend(match fate {
                Fate::Moves(pose) => finder.tiles_of(&scan.with_pose(*pose), &rays, store.folder())?,
                Fate::Loses(region) => {
                    let lost = FilteredScan::new(&scan, region, true)?;
                    finder.tiles_of(&lost, &rays, store.folder())?
                }
                Fate::Stays | Fate::Goes => Vec::new(),
            });
            looked_at += updates;
        }
        touched.tiles = (!are_all).then_some(tiles);
        self.counts.tiles_mapped =
            touched.tiles.as_ref().map_or(self.counts.tiles, |tiles| tiles.len() as u64);
        if self.how.is_dry_run {
            self.estimate(store, &touched, began.elapsed().as_secs_f64(), looked_at)?;
        }
        Ok(touched)
    }

    /// Counts scans and updates; returns the updates of those that change.
    fn count(&mut self, store: &TileStore) -> Result<u64> {
        let mut changed = 0;
        let mut records = store.kept_records()?;
        while let Some(record) = records.next_kept()? {
            self.counts.scans += 1;
            self.counts.updates += record.updates;
            if !matches!((self.fate)(&record), Fate::Stays) {
                self.counts.scans_changed += 1;
                changed += record.updates;
            }
        }
        Ok(changed)
    }

    /// What is to be done, by what is known without doing it.
    fn estimate(&mut self, store: &TileStore, touched: &Touched, took_s: f64, looked_at: u64) -> Result<()> {
        let mut records = store.kept_records()?;
        let (mut updates, mut scans) = (0.0, 0);
        while let Some(record) = records.next_kept()? {
            let is_moved = !matches!((self.fate)(&record), Fate::Stays);
            let hit = record.tiles.iter().filter(|tile| touched.has(**tile)).count();
            if (is_moved || hit > 0) && !matches!((self.fate)(&record), Fate::Goes) {
                scans += 1;
                let share = if is_moved { 1.0 } else { hit as f64 / record.tiles.len().max(1) as f64 };
                updates += record.updates as f64 * share;
            }
        }
        (self.counts.scans_mapped, self.counts.updates_mapped) = (scans, updates as u64);
        // Some 20 million updates a second where nothing was timed; applying and writing take a half on top.
        let rate = if looked_at > 0 { looked_at as f64 / took_s.max(1e-6) } else { 20e6 };
        self.counts.estimated_s = Some(1.5 * updates / rate);
        Ok(())
    }

    fn config_of(&self, store: &TileStore) -> Result<MapConfig> {
        let config = config_from(store.metadata(), &store.layout().metadata())?;
        MapConfig { memory: MemoryLimit::Bytes(self.how.memory_bytes), ..config }.validated()
    }

    fn open(&self, store: &TileStore, record: KeptRecord) -> Result<KeptScan> {
        KeptScan::open(&self.disk, store.layout(), record, MAX_POINTS_IN_MEMORY)
    }

    /// # Errors
    ///
    /// A request to stop.
    pub(super) fn check_stop(&self) -> Result<()> {
        self.how.stop.check()
    }

    /// Does what happens to a scan by `map`, which maps its points in a selection of tiles or in all; returns its new
    /// entry. Nothing but poses may change.
    pub(super) fn map_beside(
        &mut self,
        layout: &Layout,
        record: KeptRecord,
        touched: &Touched,
        map: impl FnOnce(&KeptScan, Option<&TileSelection>) -> Result<(ScanReport, Vec<TileIndex>)>,
    ) -> Result<KeptRecord> {
        let pose = match (self.fate)(&record) {
            Fate::Moves(pose) => Some(*pose),
            Fate::Stays | Fate::Goes | Fate::Loses(_) => None,
        };
        if pose.is_none() && !touched.has_any_of(&record) {
            return Ok(record);
        }
        let scan = KeptScan::open(&self.disk, layout, record, MAX_POINTS_IN_MEMORY)?;
        let scan = pose.map_or(scan.clone(), |pose| scan.with_pose(pose));
        self.map_points(scan.record().clone(), touched, pose.is_some(), |selection| map(&scan, selection))
    }

    /// Maps the touched tiles again and commits. Returns what became of the files that nothing needs any more, too.
    fn map(
        mut self,
        store: TileStore,
        touched: Touched,
        progress: &mut impl FnMut(u64, u64),
    ) -> Result<(MappedAgain, Result<()>)> {
        let layout = store.layout().clone();
        let mut records = store.kept_records()?;
        let tiles: Vec<_> = store.tiles().filter(|&tile| touched.has(tile)).collect();
        self.counts.tiles_mapped = tiles.len() as u64;
        let mut remapper = Remapper::begin(store, touched.config.clone(), tiles, self.how.stop.clone())?;
        let (mut done, mut have_poses_changed) = (0, false);
        while let Some(entry) = records.next_entry()? {
            self.how.stop.check()?;
            let CatalogEntry::Kept(record) = entry else {
                remapper.put(&entry)?;
                continue;
            };
            progress(done, self.counts.scans);
            done += 1;
            let (number, fate) = (record.number, (self.fate)(&record));
            if matches!(fate, Fate::Goes) {
                remapper.put(&CatalogEntry::Removed(number, number))?;
                continue;
            }
            let is_changed = !matches!(fate, Fate::Stays);
            have_poses_changed |= matches!(fate, Fate::Moves(_));
            let is_touched = is_changed || touched.has_any_of(&record);
            let mut record = *record;
            if is_touched {
                let scan = KeptScan::open(&self.disk, &layout, record, MAX_POINTS_IN_MEMORY)?;
                record = self.map_scan(&mut remapper, scan, fate, &touched)?;
            } else if touched.segments.contains(&record.place.segment) {
                record.place = remapper.copy_points(record.place)?;
            }
            remapper.put(&CatalogEntry::Kept(Box::new(record)))?;
        }
        progress(done, self.counts.scans);
        let released = remapper.finish(have_poses_changed, release)?;
        Ok((self.counts, released))
    }

    /// Maps what a scan says about touched tiles; returns its new record.
    fn map_scan(
        &mut self,
        remapper: &mut Remapper,
        scan: KeptScan,
        fate: Fate,
        touched: &Touched,
    ) -> Result<KeptRecord> {
        let is_moved = matches!(fate, Fate::Moves(_));
        let scan = match &fate {
            Fate::Moves(pose) => scan.with_pose(**pose),
            Fate::Stays | Fate::Goes | Fate::Loses(_) => scan,
        };
        let mut record = scan.record().clone();
        let rest;
        let points: &dyn ScanPoints = match fate {
            Fate::Loses(region) => {
                rest = FilteredScan::new(&scan, region, false)?;
                record.place = remapper.write_points(&rest)?;
                record.points = rest.len() as u64;
                &rest
            }
            _ => {
                if touched.segments.contains(&record.place.segment) {
                    record.place = remapper.copy_points(record.place)?;
                }
                &scan
            }
        };
        let (number, rays) = (record.number, record.rays);
        let map = |selection: Option<&TileSelection>| remapper.map(number, points, &rays, selection);
        self.map_points(record, touched, is_moved, map)
    }

    /// Maps the points of a scan in the touched ones of its tiles, and brings its record up to date.
    fn map_points(
        &mut self,
        mut record: KeptRecord,
        touched: &Touched,
        is_moved: bool,
        map: impl FnOnce(Option<&TileSelection>) -> Result<(ScanReport, Vec<TileIndex>)>,
    ) -> Result<KeptRecord> {
        // All tiles of a scan that moved are touched.
        let selection = touched.tiles.as_ref().filter(|_| !is_moved).map(|tiles| {
            record.tiles.iter().copied().filter(|tile| tiles.contains(tile)).collect::<TileSelection>()
        });
        let (report, tiles) = map(selection.as_ref())?;
        self.counts.scans_mapped += 1;
        self.counts.updates_mapped += report.hits + report.misses;
        if selection.is_none() {
            record.updates = report.hits + report.misses;
        }
        record.tiles = match &touched.tiles {
            None => tiles,
            Some(touched) => {
                let mut all: Vec<_> = record
                    .tiles
                    .iter()
                    .copied()
                    .filter(|tile| !touched.contains(tile))
                    .chain(tiles)
                    .collect();
                all.sort_unstable();
                all.dedup();
                all
            }
        };
        Ok(record)
    }
}

/// Whether a scan is one that can be moved: its points are in the frame of its sensor.
pub(super) fn has_pose(record: &KeptRecord) -> bool {
    matches!(record.frame, KeptFrame::Sensor(_))
}

/// A box as an argument.
pub(super) fn check_region(region: &Aabb, map: &Path) -> Result<()> {
    let is_box = (0..3).all(|axis| region.min[axis] < region.max[axis]);
    if is_box {
        return Ok(());
    }
    let reason = format!("of {}: not a box; the lower corner comes first", map.display());
    Err(Error::argument("region", reason))
}
