use super::new_poses::NewPoses;
use super::remap::{Remap, Remapped};
use super::replay::{clean_up_after_error, create_snapshot};
use super::revision::{Revision, Touched};
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, KeptSummary, Remapper, ShadowMapper, no_kept_scan};
use crate::persistence::lower_priority;
use crate::space::TileSelection;
use crate::store::{CatalogEntry, Disk, MapPath, SideFolder, TileStore};
use rayon::ThreadPool;
use std::path::PathBuf;
use std::sync::Arc;

/// Online [`remap`](super::remap()), which runs concurrently with the mapper of the map: the long part runs in threads
/// of low priority while scans are inserted, and one short commit at the end changes the map.
///
/// ```text
/// mapper:  scan, scan, scan, flush, scan ... flush | closed     | opened again
/// remap:   begin -> follow -> follow -> follow ... | -> finish  |
/// ```
///
/// Tiles that moved scans touch are replayed into a shadow map, `MAP.remapping`: first from the existing scans, then
/// from scans that are flushed meanwhile, which keep their poses. At the end these tiles are moved into the map. The
/// result equals, bit by bit, that of `remap` with the same poses and scans.
///
/// Memory: [`Replay::memory`](super::Replay::memory), in addition to the mapper's. Disk: a second copy of the affected
/// tiles. Dropping this value frees both, and the map is unchanged.
pub struct OnlineRemap {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
    how: Remap,
    /// Threads that trace scans, with low priority so that the mapper's threads run first.
    threads: ThreadPool,
    revision: Revision,
    touched: Touched,
    remapped: Remapped,
    /// `None` if no scan moves.
    side: Option<ShadowMapper>,
    /// Generation of the catalog, and number of its entries processed.
    catalog: Option<u64>,
    entries: u64,
}

/// Maximum number of scan entries in memory before they are written.
const MAX_ENTRIES: u64 = 256;

impl OnlineRemap {
    /// Finds the tiles that the new poses affect. Scans that were flushed after `scans` was read keep their poses.
    ///
    /// # Errors
    ///
    /// As for [`remap`](super::remap()); a dry run or finished parts, which only `remap` supports; another remap of the same map.
    pub fn begin(scans: &KeptSummary, poses: &NewPoses, how: &Remap) -> Result<Self> {
        let (disk, folder) = scans.place();
        if how.replay.is_dry_run {
            return Err(Error::argument("is_dry_run", "not supported online; use `remap` for a dry run"));
        }
        if how.replay.parts.is_some() {
            return Err(Error::argument("parts", "not supported online; use `remap`"));
        }
        let threads = rayon::ThreadPoolBuilder::new().start_handler(|_| lower_priority()).build();
        let threads =
            threads.map_err(|error| Error::io(folder, "start threads", std::io::Error::other(error)))?;
        let (remapped, changes) = Remapped::by_poses(scans, poses, how.tolerance)?;
        let mut revision = Revision::new(scans, &how.replay, changes)?;
        let store = TileStore::open_read_only(disk.clone(), folder)?;
        check_catalog(&store, scans.catalog())?;
        let touched = threads.install(|| revision.look(&store, None))?;
        let is_needed = revision.counts.scans_changed > 0;
        let begin = || ShadowMapper::begin(&store, touched.config.clone(), how.replay.stop.clone());
        let side = is_needed.then(begin).transpose()?;
        // `follow` counts the scans and updates again while it processes them.
        (revision.counts.scans, revision.counts.updates) = (0, 0);
        drop(store);
        let (folder, how, catalog) = (folder.to_owned(), how.clone(), scans.catalog());
        Ok(Self { disk, folder, how, threads, revision, touched, remapped, side, catalog, entries: 0 })
    }

    /// Removes the shadow map of a killed online remap, as the next one would.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] if an online remap is running, foreign content in the folder, or an I/O error.
    pub fn remove_leftovers(map: impl Into<MapPath>) -> Result<()> {
        let (disk, folder) = map.into().into_parts();
        SideFolder::begin(disk, &folder).map(drop)
    }

    /// Returns whether the poses move any scan. If not, there is nothing to follow and to finish.
    pub fn moves_scans(&self) -> bool {
        self.side.is_some()
    }

    /// Processes the scans that were flushed since the last call; the first call processes all. Returns their number.
    /// `progress` receives the number of scans processed in this call.
    ///
    /// # Errors
    ///
    /// [`Error::Changed`] if another operation has changed the scans of the map; damage; an I/O error; a request to
    /// stop. The remap cannot continue then.
    pub fn follow(&mut self, mut progress: impl FnMut(u64) + Send) -> Result<u64> {
        let Some(side) = &mut self.side else { return Ok(0) };
        let store = TileStore::open_read_only(self.disk.clone(), &self.folder)?;
        let (revision, touched) = (&mut self.revision, &self.touched);
        let (catalog, entries) = (self.catalog, &mut self.entries);
        let mut follow = || follow_scans(&store, catalog, entries, revision, touched, side, &mut progress);
        self.threads.install(&mut follow)
    }

    /// Applies the new poses to the map. Call this after the map's mapper has flushed and was closed. First processes
    /// the scans that were flushed since [`OnlineRemap::follow`]; then one commit replaces the affected tiles.
    ///
    /// # Errors
    ///
    /// As for [`OnlineRemap::follow`] and [`remap`](super::remap()). The map is unchanged then. A snapshot `keep_as`
    /// may have been created.
    pub fn finish(mut self) -> Result<Remapped> {
        let Some(side) = self.side.take() else {
            self.remapped.mapped = self.revision.counts;
            return Ok(self.remapped);
        };
        let mut store = TileStore::open(self.disk.clone(), &self.folder)?;
        create_snapshot(&mut store, &self.how.replay)?;
        let (disk, folder) = (self.disk.clone(), self.folder.clone());
        clean_up_after_error(disk, &folder, self.swap_in(store, side))
    }

    fn swap_in(mut self, store: TileStore, mut side: ShadowMapper) -> Result<Remapped> {
        let (revision, touched) = (&mut self.revision, &self.touched);
        follow_scans(&store, self.catalog, &mut self.entries, revision, touched, &mut side, &mut |_| ())?;
        let tiles: Vec<_> = store.tiles().iter().filter(|&tile| touched.has(tile)).collect();
        revision.counts.tiles = store.tiles().count() as u64;
        revision.counts.tiles_mapped = tiles.len() as u64;
        self.remapped.mapped = revision.counts;
        let stop = self.how.replay.stop.clone();
        let mut remapper = Remapper::begin(store, touched.config.clone(), tiles, stop)?;
        remapper.take_over(&mut side)?;
        if let Err(error) = remapper.finish(true, TileStore::release_scans)? {
            log::warn!("{}: committed, but the cleanup failed: {error:#}", self.folder.display());
        }
        Ok(self.remapped)
    }
}

/// Inserts the scans after the first `entries` entries of the catalog into the affected tiles.
fn follow_scans(
    store: &TileStore,
    catalog: Option<u64>,
    entries: &mut u64,
    revision: &mut Revision,
    touched: &Touched,
    side: &mut ShadowMapper,
    progress: &mut (dyn FnMut(u64) + Send),
) -> Result<u64> {
    check_catalog(store, catalog)?;
    let mut records = store.archive().records()?;
    for _ in 0..*entries {
        records.next_entry()?;
    }
    let (mut scans, mut last, mut uncommitted) = (0, None, 0);
    while let Some(entry) = records.next_entry()? {
        revision.check_stop()?;
        last = entry.numbers().map(|(_, last)| last).or(last);
        let entry = match entry {
            CatalogEntry::Kept(record) => {
                scans += 1;
                progress(scans);
                revision.counts.scans += 1;
                revision.counts.updates += record.updates;
                let map = |scan: &KeptScan, selection: Option<&TileSelection>| side.map_kept(scan, selection);
                let record = revision.apply_change(store.layout(), *record, touched, map)?;
                CatalogEntry::Kept(Box::new(record))
            }
            other => match no_kept_scan(&other) {
                None => other,
                Some(reason) => return Err(Error::argument(store.folder().display().to_string(), reason)),
            },
        };
        side.note(entry);
        *entries += 1;
        uncommitted += 1;
        if let Some(last) = last
            && uncommitted == MAX_ENTRIES
        {
            side.commit(last)?;
            uncommitted = 0;
        }
    }
    if let Some(last) = last {
        side.commit(last)?;
    }
    Ok(scans)
}

/// Checks that the catalog is the same. New scans extend it; changes of earlier entries create another one.
fn check_catalog(store: &TileStore, catalog: Option<u64>) -> Result<()> {
    match store.archive().generation()? == catalog {
        true => Ok(()),
        false => Err(Error::Changed { path: store.folder().to_owned() }),
    }
}

impl std::fmt::Debug for OnlineRemap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { folder, remapped, entries, .. } = self;
        let mut out = f.debug_struct("OnlineRemap");
        out.field("folder", folder)
            .field("remapped", remapped)
            .field("entries", entries)
            .finish_non_exhaustive()
    }
}
