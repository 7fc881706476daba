use super::finding::{Finding, Severity};
use super::kept_points::{KeptLocations, WholePoints};
use super::kept_scans::{check_kept_scans, find_idle};
use super::rebuild::{self, Index};
use super::rechecks::{LogEnd, Recheck, Rechecks, log_end, metadata_text};
use super::snapshots::{WholeTables, lost_tiles};
use super::surroundings::IDLE_SCANS;
use super::tile_check::{check_tile, first_difference, write_octree};
use crate::config::MapConfig;
use crate::error::{Error, FormatError, Result};
use crate::persistence::config_from;
use crate::space::TileIndex;
use crate::store::{Disk, Layout, MapPath, Salvage, SnapshotList, TileFile, TileStore, check_scans};
use rustc_hash::FxHashSet;
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Result of a verification.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Verification {
    /// Whether the map has checksums. A map of the original format has none.
    pub verified: bool,
    /// Number of the verified flush.
    pub flush_number: u64,
    /// Number of the last scan in the flush.
    pub scan_number: u64,
    /// Number of verified tiles: of the map, or of the scope.
    pub tiles: u64,
    /// Number of snapshots of the map.
    pub snapshots: u64,
    /// Number of observed voxels in the intact tiles.
    pub voxels: u64,
    /// Bytes of the intact tables.
    pub table_bytes: u64,
    /// Number of findings of damage. Each was confirmed for one flush.
    pub damage: u64,
    /// Number of other findings.
    pub notes: u64,
    /// Number of notes on files that no flush needs: remains of a process that was killed or had an I/O error, or
    /// temporary files of an active one. The next process that opens the map for writing removes or renames them.
    pub leftovers: u64,
    /// Number of possible faults that could not be confirmed, because other processes changed the map faster than it
    /// was checked. A note reports them.
    pub unsettled: u64,
}

impl Verification {
    /// Returns whether nothing is damaged, and no possible fault is undecided.
    pub fn is_whole(&self) -> bool {
        self.damage == 0 && self.unsettled == 0
    }
}

/// Checks every file of a map, without a lock and without writing. A writer may be active: possible damage is read a
/// second time, and reported if both reads find it for the same flush. If the map has changed meanwhile, the check is
/// repeated for the last flush.
///
/// `found` receives each finding, and `progress` the number of tiles done and in total. Memory: the list of tiles, a
/// second list if there is damage, and one tile.
///
/// # Errors
///
/// No map, or an I/O error that is not specific to one file. Damage and unreadable files are findings, and the check
/// continues.
pub fn verify(
    folder: impl Into<MapPath>,
    found: impl FnMut(&Finding),
    progress: impl FnMut(u64, u64),
) -> Result<Verification> {
    verify_scope(folder, &VerifyScope::All, found, progress)
}

/// Part of a map to check. Several processes can share the work.
#[derive(Clone, Debug, Default)]
pub enum VerifyScope {
    /// The whole map.
    #[default]
    All,
    /// The files of these tiles as of the last flush. Tiles that are not in the map are ignored.
    Tiles(FxHashSet<TileIndex>),
    /// Everything except the files of tiles as of the last flush: lists, scans, snapshots, and foreign files.
    AllButTiles,
}

impl VerifyScope {
    fn has_tile(&self, tile: TileIndex) -> bool {
        match self {
            Self::All => true,
            Self::Tiles(tiles) => tiles.contains(&tile),
            Self::AllButTiles => false,
        }
    }

    fn has_rest(&self) -> bool {
        !matches!(self, Self::Tiles(_))
    }
}

/// Like [`verify`], for a part of the map. Damage of the list of tiles is found in every part.
///
/// # Errors
///
/// As for [`verify`].
pub fn verify_scope(
    folder: impl Into<MapPath>,
    scope: &VerifyScope,
    found: impl FnMut(&Finding),
    progress: impl FnMut(u64, u64),
) -> Result<Verification> {
    let (disk, folder) = folder.into().into_parts();
    let mut verifier = Verifier {
        layout: Layout::new(&*folder),
        disk: disk.clone(),
        scope,
        found,
        progress,
        counts: Verification::default(),
        listed: None,
        reported_tiles: BTreeSet::new(),
        whole: WholeTables::new(),
        points: WholePoints::default(),
        opened: None,
        before: None,
        rechecks: Rechecks::default(),
        reported: FxHashSet::default(),
        is_again: false,
    };
    let Some(store) = verifier.open()? else { return Ok(verifier.counts) };
    if let Some(config) = verifier.config_of(&store)? {
        verifier.verify_map(&store, &config)?;
        let first = verifier.opened.clone();
        verifier.recheck()?;
        (verifier.opened, verifier.before, verifier.is_again) = (first, None, false);
        verifier.verify_surroundings(&store)?;
        verifier.recheck()?;
    }
    Ok(verifier.counts)
}

pub(super) struct Verifier<'a, F, P> {
    pub(super) disk: Arc<dyn Disk>,
    pub(super) layout: Layout,
    scope: &'a VerifyScope,
    found: F,
    progress: P,
    pub(super) counts: Verification,
    /// Snapshots in the log; `None` if the log has no list.
    pub(super) listed: Option<SnapshotList>,
    /// Damaged tiles that are missing in the rebuilt index and were reported already.
    pub(super) reported_tiles: BTreeSet<TileIndex>,
    /// Intact tables that only snapshots use.
    pub(super) whole: WholeTables,
    /// Points of kept scans that are intact as of the current flush.
    points: WholePoints,
    /// End of the log before the store was opened; `None` if it is unreadable, so that changes cannot be detected.
    opened: Option<LogEnd>,
    /// End of the log at the previous check.
    before: Option<LogEnd>,
    /// Parts that may be damaged, or were being changed when they were checked.
    rechecks: Rechecks,
    /// Damage that was reported by repeated checks.
    reported: FxHashSet<String>,
    /// Whether this is a repeated check. Notes were reported by the first one.
    pub(super) is_again: bool,
}

/// Maximum number of checks of possible damage. Each reads the affected files.
const MAX_CHECKS: usize = 30;

/// Maximum number of pauses before a repeated check.
const MAX_PAUSES: usize = 10;

impl<F: FnMut(&Finding), P: FnMut(u64, u64)> Verifier<'_, F, P> {
    /// Opens the map. If metadata or log is unreadable, rebuilds them from the remains.
    fn open(&mut self) -> Result<Option<TileStore>> {
        let store = match self.open_unchanged() {
            Ok((store, end)) => {
                self.opened = end;
                store
            }
            Err(error) => {
                let finding = Finding::of(error)?;
                self.opened = None;
                self.report(finding);
                match self.index_from_remains()? {
                    Some(store) => store,
                    None => return Ok(None),
                }
            }
        };
        self.layout = store.layout().clone();
        self.listed = store.snapshots().list().cloned();
        Ok(Some(store))
    }

    /// Opens the map, and returns the end of its log from before. Errors are returned only if the map did not change
    /// meanwhile: while a pull replaces the map, metadata and log may be read from different folders.
    ///
    /// # Errors
    ///
    /// As for [`TileStore::open_read_only`].
    fn open_unchanged(&self) -> Result<(TileStore, Option<LogEnd>)> {
        let state = || (log_end(&*self.disk, &self.layout), metadata_text(&*self.disk, &self.layout));
        let mut before = state();
        for _ in 1..MAX_CHECKS {
            let error = match TileStore::open_read_only(self.disk.clone(), self.layout.folder()) {
                Ok(store) => return Ok((store, before.0)),
                Err(error) => error,
            };
            let now = state();
            if now == before {
                return Err(error);
            }
            before = now;
            self.disk.pause();
        }
        let opened = TileStore::open_read_only(self.disk.clone(), self.layout.folder());
        opened.map(|store| (store, before.0))
    }

    fn config_of(&mut self, store: &TileStore) -> Result<Option<MapConfig>> {
        match config_from(store.metadata(), &store.layout().metadata()) {
            Ok(config) => Ok(Some(config)),
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report(finding);
                Ok(None)
            }
        }
    }

    pub(super) fn report(&mut self, finding: Finding) {
        match finding.severity {
            // A repeated check reads all snapshots again, and would report their known damage a second time.
            Severity::Damage if self.is_again && !self.reported.insert(finding.to_string()) => return,
            Severity::Damage => self.counts.damage += 1,
            Severity::Note if self.is_again => return,
            Severity::Note => self.counts.notes += 1,
        }
        (self.found)(&finding);
    }

    /// Reports damage if two checks find it for one flush. At the first check, a writer may have been replacing,
    /// renaming or removing the file.
    pub(super) fn report_if_confirmed(&mut self, finding: Finding, part: Recheck) {
        let is_first = self.opened.is_some() && self.before != self.opened;
        if is_first || self.opened.is_some() && log_end(&*self.disk, &self.layout) != self.opened {
            self.rechecks.add(part);
        } else {
            self.report(finding);
        }
    }

    fn verify_map(&mut self, store: &TileStore, config: &MapConfig) -> Result<()> {
        self.counts.verified = store.map_id().is_some();
        self.counts.flush_number = store.commits().flush_number;
        self.counts.scan_number = store.commits().scan_number;
        if !self.counts.verified {
            let reason =
                "a map of the original format: no checksums, so only the format of its tables is checked";
            self.report(Finding::note(&self.layout.metadata(), None, reason));
        }
        if let Some(torn) = &store.commits().torn {
            let mut note = Finding::note(&self.layout.commit_log(), None, torn.reason.clone());
            (note.offset, note.reason) = (Some(torn.at), format!("an uncommitted flush: {}", torn.reason));
            self.report(note);
        }
        if self.scope.has_rest() {
            self.verify_list(store)?;
        }
        let mut tiles: Vec<_> = store.tiles().iter().collect();
        tiles.sort_unstable();
        let chosen: Vec<_> = tiles.iter().copied().filter(|&tile| self.scope.has_tile(tile)).collect();
        self.counts.tiles = chosen.len() as u64;
        for (done, tile) in (1..).zip(&chosen) {
            self.verify_tile(store, config, *tile, false)?;
            (self.progress)(done, chosen.len() as u64);
        }
        if !self.scope.has_rest() {
            return Ok(());
        }
        self.verify_snapshots(store, config)?;
        self.verify_kept_scans(store, None)
    }

    fn verify_surroundings(&mut self, store: &TileStore) -> Result<()> {
        if !self.scope.has_rest() {
            return Ok(());
        }
        self.listed = store.snapshots().list().cloned();
        for path in find_idle(&self.disk, store)? {
            self.leftover(&path, None, IDLE_SCANS);
        }
        self.check_map_folder(store, |tile| store.tiles().contains(tile))
    }

    /// Repeats the checks of possible damage until each part is found damaged or intact for one flush.
    fn recheck(&mut self) -> Result<()> {
        self.is_again = true;
        for look in 0..MAX_CHECKS {
            if self.rechecks.is_empty() {
                return Ok(());
            }
            // Longer each time, to reach a pause between two flushes.
            (0..look.min(MAX_PAUSES)).for_each(|_| self.disk.pause());
            let rechecks = std::mem::take(&mut self.rechecks);
            let (store, end) = match self.open_unchanged() {
                Ok(opened) => opened,
                Err(Error::Changed { .. }) => {
                    self.rechecks = rechecks;
                    continue;
                }
                Err(error) => {
                    // Without the map's own files the other parts cannot be decided.
                    self.counts.unsettled += rechecks.len();
                    let finding = Finding::of(error)?;
                    self.report(finding);
                    return Ok(());
                }
            };
            self.before = std::mem::replace(&mut self.opened, end);
            if self.before != self.opened {
                // New segments may have the numbers of removed ones.
                self.points = WholePoints::default();
            }
            self.listed = store.snapshots().list().cloned();
            let Some(config) = self.config_of(&store)? else { return Ok(()) };
            self.verify_rechecks(&store, &config, rechecks)?;
        }
        let unsettled = std::mem::take(&mut self.rechecks).len();
        if unsettled > 0 {
            self.counts.unsettled += unsettled;
            let reason = format!(
                "other processes changed the map during each of {MAX_CHECKS} checks of {unsettled} possible \
                 faults; run verify while no process writes"
            );
            self.is_again = false;
            self.report(Finding::note(self.layout.folder(), None, reason));
        }
        Ok(())
    }

    fn verify_rechecks(&mut self, store: &TileStore, config: &MapConfig, rechecks: Rechecks) -> Result<()> {
        let Rechecks { list, snapshots, catalogs, points, tiles, folders } = rechecks;
        if list {
            self.verify_list(store)?;
        }
        for (tile, is_counted) in tiles {
            if store.tiles().version(tile).is_some() {
                self.verify_tile(store, config, tile, is_counted)?;
            }
        }
        if snapshots {
            self.verify_snapshots(store, config)?;
        }
        if catalogs || !points.is_empty() {
            self.verify_kept_scans(store, (!catalogs).then_some(&points))?;
        }
        for tile in folders {
            let folder = self.layout.tile_folder(tile);
            self.check_tile_folder(store, &folder, tile, store.tiles().version(tile).is_some())?;
        }
        Ok(())
    }

    fn verify_list(&mut self, store: &TileStore) -> Result<()> {
        let (flush_number, records) = (store.commits().flush_number, store.listed_records());
        if let Err(error) = check_scans(&*self.disk, &self.layout, flush_number, records) {
            let finding = Finding::of(error)?;
            self.report_if_confirmed(finding, Recheck::List);
        }
        Ok(())
    }

    /// Checks the scans that the map and its snapshots keep, or the points of some of them.
    fn verify_kept_scans(&mut self, store: &TileStore, only: Option<&KeptLocations>) -> Result<()> {
        let disk = self.disk.clone();
        let mut whole = std::mem::take(&mut self.points);
        let checked = check_kept_scans(&*disk, store, only, &mut whole, &mut |finding, place| {
            self.report_if_confirmed(finding, place.map_or(Recheck::Catalog, Recheck::Points));
        });
        self.points = whole;
        checked
    }

    /// Checks a tile. With `is_counted` its table was counted before.
    fn verify_tile(
        &mut self,
        store: &TileStore,
        config: &MapConfig,
        tile: TileIndex,
        is_counted: bool,
    ) -> Result<()> {
        let check = check_tile(&*self.disk, store, config, tile)?;
        let table = match check.table {
            Ok(table) => table,
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report_if_confirmed(finding.in_tile(tile), Recheck::Tile(tile, is_counted));
                return Ok(());
            }
        };
        if !is_counted {
            self.counts.voxels += table.table.len() as u64;
            self.counts.table_bytes += table.file.bytes;
        }
        if let Some(Err(mut cause)) = check.octree {
            let path = self.layout.current(tile, TileFile::Octree);
            let mut expected = Vec::new();
            if write_octree(config, &table, &mut expected).is_ok() {
                cause.at = first_difference(&*self.disk, &path, &expected).unwrap_or(cause.at);
            }
            let finding = Finding::damage(&path, Some(tile), &cause);
            self.report_if_confirmed(finding, Recheck::Tile(tile, true));
        }
        Ok(())
    }

    /// Rebuilds an unreadable index from the remains, so that the tiles can be checked.
    fn index_from_remains(&mut self) -> Result<Option<TileStore>> {
        let remains = Salvage::read(&*self.disk, &self.layout)?;
        self.layout = remains.layout_of_tiles(&*self.disk, self.layout.folder());
        match rebuild::index_of(&*self.disk, &self.layout, &remains, &mut |_, _| ()) {
            Ok(Some(Index { map_id, metadata, commits, damaged, .. })) => {
                for (tile, error) in damaged {
                    self.reported_tiles.insert(tile);
                    let finding = Finding::of(error)?;
                    self.report(finding.in_tile(tile));
                }
                let (disk, folder) = (self.disk.clone(), self.layout.folder());
                Ok(Some(TileStore::of_commits(disk, folder, map_id, metadata, commits)))
            }
            Ok(None) => Ok(None),
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report(finding);
                Ok(None)
            }
        }
    }

    /// Checks the snapshots, and the tables that only they use.
    fn verify_snapshots(&mut self, store: &TileStore, config: &MapConfig) -> Result<()> {
        self.counts.snapshots = 0;
        let names = match store.snapshots().names() {
            Err(error) => {
                let finding = Finding::of(error)?;
                self.report_if_confirmed(finding, Recheck::Snapshots);
                return Ok(());
            }
            Ok(names) => names,
        };
        for name in names {
            self.counts.snapshots += 1;
            let snapshot = store.snapshots().read(&name);
            let lost = snapshot.and_then(|snapshot| lost_tiles(store, config, &snapshot, &mut self.whole));
            let errors = match lost {
                // Deleted meanwhile.
                Err(Error::InvalidArgument { .. }) => continue,
                Err(error) => vec![error],
                Ok(lost) => lost.into_iter().map(|(_, error)| error).collect(),
            };
            for error in errors {
                let mut finding = Finding::of(error)?;
                finding.reason += &format!("; the snapshot {name} needs it");
                self.report_if_confirmed(finding, Recheck::Snapshots);
            }
        }
        Ok(())
    }

    pub(super) fn damage(&mut self, path: &std::path::Path, tile: Option<TileIndex>, reason: &str) {
        self.report(Finding::damage(path, tile, &FormatError::at_offset(0, reason)));
    }
}
