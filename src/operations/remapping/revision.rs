use super::change::{Change, Changes, rays_within, tiles_of_marks};
use super::completion::release;
use super::filtered_scan::FilteredScan;
use super::finished_parts::FinishedParts;
use super::replay::{Replay, Replayed};
use crate::config::{GUARD_REACH, MapConfig};
use crate::error::Result;
use crate::mapper::{KeptScan, KeptSummary, Remapper, TileFinder};
use crate::scan::ScanPoints;
use crate::space::{TileBox, TileIndex, TileSelection};
use crate::store::{CatalogEntry, Disk, KeptRecord, Layout, TileStore};
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

/// If more than one third of all updates belong to changed scans, all tiles are replayed: finding the affected tiles
/// would cost more than it saves.
const PART_FOR_ALL: u64 = 3;
/// Maximum number of points of a kept scan in memory. Larger scans are read again when needed.
const MAX_POINTS_IN_MEMORY: u64 = 1 << 18;

/// Change of scans, and its effects.
pub(super) struct Revision {
    disk: Arc<dyn Disk>,
    how: Replay,
    pub(super) changes: Changes,
    /// Segments of the archive that contain points to remove. Their other points are copied to new segments.
    segments: BTreeSet<u64>,
    /// Updates of the changed scans.
    changed_updates: u64,
    pub(super) counts: Replayed,
}

/// Tiles to replay.
pub(super) struct Touched {
    pub(super) config: MapConfig,
    /// `None` for all.
    pub(super) tiles: Option<FxHashSet<TileIndex>>,
}

impl Touched {
    pub(super) fn has(&self, tile: TileIndex) -> bool {
        self.tiles.as_ref().is_none_or(|tiles| tiles.contains(&tile))
    }

    fn has_any_of(&self, record: &KeptRecord) -> bool {
        record.tiles.iter().any(|&tile| self.has(tile))
    }
}

impl Revision {
    /// # Errors
    ///
    /// A scan whose marks of moving points are lost, unless the changes remove or mark it.
    pub(super) fn new(scans: &KeptSummary, how: &Replay, changes: Changes) -> Result<Self> {
        let (mut counts, mut segments, mut changed_updates) = (Replayed::default(), BTreeSet::new(), 0_u64);
        let is_renewed = |scan| matches!(changes.get(&scan), Some(Change::Remove | Change::Mark(_)));
        scans.check_marks(is_renewed)?;
        for scan in scans.scans() {
            counts.scans += 1;
            counts.updates = counts.updates.saturating_add(scan.updates);
            if let Some(change) = changes.get(&scan.number) {
                counts.scans_changed += 1;
                // Other marks change few tiles, which are found without tracing.
                if !matches!(change, Change::Mark(_)) {
                    changed_updates = changed_updates.saturating_add(scan.updates);
                }
                if let Change::Remove | Change::Filter(_) = change {
                    segments.extend(scan.segments);
                }
            }
        }
        Ok(Self { disk: scans.place().0, how: how.clone(), changes, segments, changed_updates, counts })
    }

    pub(super) fn takes_points(&self) -> bool {
        !self.segments.is_empty()
    }

    /// Returns whether so many scans change that all tiles are replayed.
    pub(super) fn replays_all(&self) -> bool {
        self.changed_updates > self.counts.updates / PART_FOR_ALL
    }

    /// Finds the tiles that the change affects; with a region, those of the region.
    pub(super) fn look(&mut self, store: &TileStore, region: Option<TileBox>) -> Result<Touched> {
        let config = self.how.config_of(store)?;
        self.counts.tiles = store.tiles().count() as u64;
        let (began, mut looked_at) = (Instant::now(), 0);
        let tiles = match self.replays_all() {
            true => None,
            false => Some(self.tiles_of_changes(store, &config, region, &mut looked_at)?),
        };
        let touched = Touched { config, tiles };
        self.counts.tiles_mapped =
            touched.tiles.as_ref().map_or(self.counts.tiles, |tiles| tiles.len() as u64);
        if self.how.is_dry_run {
            self.estimate(store, &touched, began.elapsed().as_secs_f64(), looked_at)?;
        }
        Ok(touched)
    }

    /// Returns the tiles that finished parts replace as the affected ones; all if the change affects all.
    pub(super) fn touched_by(
        &mut self,
        store: &TileStore,
        replaced: FxHashSet<TileIndex>,
    ) -> Result<Touched> {
        self.counts.tiles = store.tiles().count() as u64;
        let tiles = (!self.replays_all()).then_some(replaced);
        Ok(Touched { config: self.how.config_of(store)?, tiles })
    }

    /// Returns the tiles of a region that changed scans touch before and after. Adds to `looked_at` the updates of the
    /// scans that are traced to find these tiles.
    fn tiles_of_changes(
        &self,
        store: &TileStore,
        config: &MapConfig,
        region: Option<TileBox>,
        looked_at: &mut u64,
    ) -> Result<FxHashSet<TileIndex>> {
        let changes_hits =
            self.changes.values().any(|change| matches!(change, Change::Filter(_) | Change::Mark(_)));
        // With guarded clearing, a hit makes nearby misses weak, also in tiles that its ray did not pass.
        let is_guarded = changes_hits && config.rays.clearing().guard().is_some();
        let reach = if is_guarded { config.grid.tiles_within(GUARD_REACH) } else { 0 };
        let around = region.map(|region| region.grown(reach));
        let mut tiles = FxHashSet::default();
        let mut finder = TileFinder::new(config, self.disk.clone(), self.how.stop.clone());
        let mut records = store.archive().records()?;
        while let Some(record) = records.next_kept()? {
            self.how.stop.check()?;
            let Some(change) = self.changes.get(&record.number) else { continue };
            if let Change::Move(_) | Change::Remove = change {
                tiles.extend(record.tiles.iter().copied());
            }
            let Some(rays) = rays_within(&record.rays, around) else { continue };
            if matches!(change, Change::Remove) || !change.may_reach(&record, &config.grid, around)? {
                continue;
            }
            let scan = self.open(store.layout(), record)?;
            let updates = scan.record().updates;
            tiles.extend(match change {
                Change::Move(pose) => {
                    finder.tiles_of(&scan.with_pose(pose.clone()), &rays, store.folder())?
                }
                Change::Filter(region) => {
                    let lost = FilteredScan::new(&scan, *region, true)?;
                    finder.tiles_of(&lost, &rays, store.folder())?
                }
                Change::Mark(marks) => {
                    tiles.extend(scan.record().tiles.iter().filter(|_| scan.record().has_lost_marks()));
                    tiles.extend(tiles_of_marks(&config.grid, &scan, &marks.of(&scan)?)?);
                    // No ray is traced.
                    continue;
                }
                Change::Remove => Vec::new(),
            });
            *looked_at += updates;
        }
        if is_guarded {
            let changed: Vec<_> = tiles.iter().copied().collect();
            for tile in changed {
                let near = TileBox::new(tile, tile).grown(reach).tiles();
                tiles.extend(near.filter(|tile| store.tiles().contains(*tile)));
            }
        }
        tiles.retain(|tile| region.is_none_or(|region| region.contains(*tile)));
        Ok(tiles)
    }

    /// Estimates the work without doing it.
    fn estimate(&mut self, store: &TileStore, touched: &Touched, took_s: f64, looked_at: u64) -> Result<()> {
        let mut records = store.archive().records()?;
        let (mut updates, mut scans) = (0.0, 0);
        while let Some(record) = records.next_kept()? {
            let change = self.changes.get(&record.number);
            let hit = record.tiles.iter().filter(|tile| touched.has(**tile)).count();
            if (change.is_some() || hit > 0) && !matches!(change, Some(Change::Remove)) {
                scans += 1;
                let share =
                    if change.is_some() { 1.0 } else { hit as f64 / record.tiles.len().max(1) as f64 };
                updates += record.updates as f64 * share;
            }
        }
        (self.counts.scans_mapped, self.counts.updates_mapped) = (scans, updates as u64);
        // Without a measurement, assume 20 million updates per second. Applying and writing the updates adds half of
        // the time.
        let rate = if looked_at > 0 { looked_at as f64 / took_s.max(1e-6) } else { 20e6 };
        self.counts.estimated_s = Some(1.5 * updates / rate);
        Ok(())
    }

    pub(super) fn open(&self, layout: &Layout, record: KeptRecord) -> Result<KeptScan> {
        KeptScan::open(&self.disk, layout, record, MAX_POINTS_IN_MEMORY)
    }

    /// # Errors
    ///
    /// A request to stop.
    pub(super) fn check_stop(&self) -> Result<()> {
        self.how.stop.check()
    }

    /// Applies the change of a scan with `map`, which inserts its points into a selection of tiles or into all, and
    /// returns the number of updates and the changed tiles. Returns its new entry. The changes may contain new poses only, no removals.
    pub(super) fn apply_change(
        &mut self,
        layout: &Layout,
        record: KeptRecord,
        touched: &Touched,
        map: impl FnOnce(&KeptScan, Option<&TileSelection>) -> Result<(u64, Vec<TileIndex>)>,
    ) -> Result<KeptRecord> {
        let pose = match self.changes.get(&record.number) {
            Some(Change::Move(pose)) => Some(pose.clone()),
            _ => None,
        };
        if pose.is_none() && !touched.has_any_of(&record) {
            return Ok(record);
        }
        let scan = self.open(layout, record)?;
        let is_moved = pose.is_some();
        let scan = match pose {
            Some(pose) => scan.with_pose(pose),
            None => scan,
        };
        self.map_points(scan.record().clone(), touched, is_moved, |selection| map(&scan, selection))
    }

    /// Replays the affected tiles, or takes them from finished parts, and commits. Also returns the result of removing
    /// files that are no longer needed.
    pub(super) fn map(
        mut self,
        store: TileStore,
        touched: Touched,
        mut parts: Option<FinishedParts>,
        progress: &mut impl FnMut(u64, u64),
    ) -> Result<(Replayed, Result<()>)> {
        let layout = store.layout().clone();
        let mut records = store.archive().records()?;
        let tiles: Vec<_> = store.tiles().iter().filter(|&tile| touched.has(tile)).collect();
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
            let (number, change) = (record.number, self.changes.get(&record.number).cloned());
            if let (Some(parts), Some(change)) = (&mut parts, &change) {
                parts.check_has_all(&record, change, &touched.config.grid)?;
            }
            if matches!(change, Some(Change::Remove)) {
                remapper.put(&CatalogEntry::Removed(number, number))?;
                continue;
            }
            have_poses_changed |= matches!(change, Some(Change::Move(_)));
            let mut record = *record;
            if change.is_some() || parts.is_none() && touched.has_any_of(&record) {
                // Points that a part has mapped are only read to be written.
                let most = if parts.is_some() { 0 } else { MAX_POINTS_IN_MEMORY };
                let scan = KeptScan::open(&self.disk, &layout, record, most)?;
                record = self.map_scan(&mut remapper, scan, change, &touched, parts.as_ref())?;
            } else {
                self.copy_out(&mut remapper, &mut record)?;
                if let (Some(parts), None) = (&parts, &touched.tiles) {
                    record.updates = parts.of_scan(number).0;
                }
            }
            remapper.put(&CatalogEntry::Kept(Box::new(record)))?;
        }
        progress(done, self.counts.scans);
        if let Some(parts) = parts {
            parts.link_into(&mut remapper)?;
            parts.put_counts(&mut self.counts);
        }
        let released = remapper.finish(have_poses_changed, release)?;
        Ok((self.counts, released))
    }

    /// Copies the points and marks of a scan out of segments that are going to be removed.
    fn copy_out(&self, remapper: &mut Remapper, record: &mut KeptRecord) -> Result<()> {
        for place in record.places_mut() {
            if self.segments.contains(&place.segment) {
                *place = remapper.copy(*place)?;
            }
        }
        Ok(())
    }

    /// Inserts a scan into the affected tiles, unless a part has done so. Returns its new record.
    fn map_scan(
        &mut self,
        remapper: &mut Remapper,
        scan: KeptScan,
        change: Option<Change>,
        touched: &Touched,
        parts: Option<&FinishedParts>,
    ) -> Result<KeptRecord> {
        let is_moved = matches!(change, Some(Change::Move(_)));
        let (mut record, mut scan) = (scan.record().clone(), scan);
        let rest;
        let points: &dyn ScanPoints = match change {
            Some(Change::Filter(region)) => {
                rest = FilteredScan::new(&scan, region, false)?;
                remapper.write_points(&rest, &mut record)?;
                &rest
            }
            change => {
                self.copy_out(remapper, &mut record)?;
                match change {
                    Some(Change::Move(pose)) => {
                        pose.put_in(&mut record);
                        scan = scan.with_pose(pose);
                    }
                    Some(Change::Mark(marks)) => {
                        let marks = marks.of(&scan)?;
                        if parts.is_none() {
                            // Hits that return may be in tiles that the scan did not touch without them.
                            record.tiles.extend(tiles_of_marks(&touched.config.grid, &scan, &marks)?);
                            record.tiles.sort_unstable();
                            record.tiles.dedup();
                        }
                        record.moving = remapper.write_marks(&marks)?;
                        scan = scan.with_moving(marks);
                    }
                    _ => {}
                }
                &scan
            }
        };
        let (number, rays) = (record.number, record.rays);
        let map = |selection: Option<&TileSelection>| match parts {
            Some(parts) => Ok(parts.of_scan(number)),
            None => remapper.map(number, points, &rays, selection),
        };
        self.map_points(record, touched, is_moved, map)
    }

    /// Inserts the points of a scan into those of its tiles that are affected, and updates its record.
    fn map_points(
        &mut self,
        mut record: KeptRecord,
        touched: &Touched,
        is_moved: bool,
        map: impl FnOnce(Option<&TileSelection>) -> Result<(u64, Vec<TileIndex>)>,
    ) -> Result<KeptRecord> {
        // All tiles of a moved scan are affected.
        let selection = touched.tiles.as_ref().filter(|_| !is_moved).map(|tiles| {
            record.tiles.iter().copied().filter(|tile| tiles.contains(tile)).collect::<TileSelection>()
        });
        let (updates, tiles) = map(selection.as_ref())?;
        self.counts.scans_mapped += 1;
        self.counts.updates_mapped += updates;
        if selection.is_none() {
            record.updates = updates;
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
