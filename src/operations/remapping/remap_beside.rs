use super::new_poses::NewPoses;
use super::remap::{Remap, Remapped};
use super::revision::{Revision, Touched};
use super::rework::{keep_as_it_is, tidied};
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, KeptSummary, Remapper, ShadowMapper, no_kept_scan};
use crate::persistence::give_way;
use crate::space::TileSelection;
use crate::store::{CatalogEntry, Disk, MapPath, SideFolder, TileStore};
use rayon::ThreadPool;
use std::path::PathBuf;
use std::sync::Arc;

/// A [`remap`](super::remap()) beside the mapper of the map: what takes long is done while scans go on, in threads of
/// lower priority, and the map changes in one short commit at the end.
///
/// ```text
/// mapper:  scan, scan, scan, flush, scan ... flush | closed     | opened again
/// beside:  begin -> follow -> follow -> follow ... | -> finish  |
/// ```
///
/// Tiles that moved scans touch are mapped again into a map beside the first, `MAP.remapping`: first from the scans
/// that there are, then from those that were flushed meanwhile, which keep their poses. In the end the map takes these
/// tiles over. It is then, to the bit, what `remap` would have made of it with the same poses for the same scans.
///
/// Memory: [`Rework::memory`](super::Rework::memory), beside what the mapper takes. Disk: the touched tiles
/// once more. Dropping it gives both back; the map is as it was.
pub struct RemapBeside {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
    how: Remap,
    /// Where scans come from is mapped again in these, so that the mapper's threads go first.
    threads: ThreadPool,
    revision: Revision,
    touched: Touched,
    remapped: Remapped,
    /// `None` if no scan moves.
    side: Option<ShadowMapper>,
    /// The catalog that it reads, and how many of its entries it has gone over.
    catalog: Option<u64>,
    entries: u64,
}

/// Entries of scans that wait in memory to be written.
const MAX_ENTRIES: u64 = 256;

impl RemapBeside {
    /// Finds out what the new poses of some scans touch. Scans that were flushed since `scans` was read keep their
    /// poses.
    ///
    /// # Errors
    ///
    /// As for [`remap`](super::remap()); a dry run, which is that function's; another remapping of the same map.
    pub fn begin(scans: &KeptSummary, poses: &NewPoses, how: &Remap) -> Result<Self> {
        let (disk, folder) = scans.place();
        if how.rework.is_dry_run {
            return Err(Error::argument(
                "is_dry_run",
                "not beside a mapper; `remap` tells what would be done",
            ));
        }
        let threads = rayon::ThreadPoolBuilder::new().start_handler(|_| give_way()).build();
        let threads =
            threads.map_err(|error| Error::io(folder, "start threads for", std::io::Error::other(error)))?;
        let (remapped, changes) = Remapped::by_poses(scans, poses, how)?;
        let mut revision = Revision::new(scans, &how.rework, changes);
        let store = TileStore::open_read_only(disk.clone(), folder)?;
        check_catalog(&store, scans.catalog())?;
        let touched = threads.install(|| revision.look(&store))?;
        let is_needed = revision.counts.scans_changed > 0;
        let begin = || ShadowMapper::begin(&store, touched.config.clone(), how.rework.stop.clone());
        let side = is_needed.then(begin).transpose()?;
        // Counted again as they are gone over.
        (revision.counts.scans, revision.counts.updates) = (0, 0);
        drop(store);
        let (folder, how, catalog) = (folder.to_owned(), how.clone(), scans.catalog());
        Ok(Self { disk, folder, how, threads, revision, touched, remapped, side, catalog, entries: 0 })
    }

    /// Removes what one that was killed has left beside the map; the next one would do so, too.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] if one is at work; something that is not of a map in its place; a disk that refuses.
    pub fn remove_leftovers(map: impl Into<MapPath>) -> Result<()> {
        let (disk, folder) = map.into().into_parts();
        SideFolder::begin(disk, &folder).map(drop)
    }

    /// Whether the poses move any scan; if not, there is nothing to follow and to finish.
    pub fn moves_scans(&self) -> bool {
        self.side.is_some()
    }

    /// Goes over the scans that were flushed since the last call; the first call over all. Returns how many these were.
    /// `progress` is told the scans gone over in this call.
    ///
    /// # Errors
    ///
    /// [`Error::Changed`] if the scans of the map have been changed by something else meanwhile; damage; a disk that
    /// refuses; a request to stop. Nothing can be gone on with then.
    pub fn follow(&mut self, mut progress: impl FnMut(u64) + Send) -> Result<u64> {
        let Some(side) = &mut self.side else { return Ok(0) };
        let store = TileStore::open_read_only(self.disk.clone(), &self.folder)?;
        let (revision, touched) = (&mut self.revision, &self.touched);
        let (catalog, entries) = (self.catalog, &mut self.entries);
        let mut follow = || follow_scans(&store, catalog, entries, revision, touched, side, &mut progress);
        self.threads.install(&mut follow)
    }

    /// Changes the map: its mapper has flushed and is closed. What was flushed since [`RemapBeside::follow`] is mapped
    /// before; the rest is a commit of the tiles that were touched.
    ///
    /// # Errors
    ///
    /// As for [`RemapBeside::follow`] and for [`remap`](super::remap()). The map is as it was then; the snapshot that
    /// keeps it may have been made.
    pub fn finish(mut self) -> Result<Remapped> {
        let Some(side) = self.side.take() else {
            self.remapped.mapped = self.revision.counts;
            return Ok(self.remapped);
        };
        let mut store = TileStore::open(self.disk.clone(), &self.folder)?;
        keep_as_it_is(&mut store, &self.how.rework)?;
        let (disk, folder) = (self.disk.clone(), self.folder.clone());
        tidied(disk, &folder, self.take_over(store, side))
    }

    fn take_over(mut self, store: TileStore, mut side: ShadowMapper) -> Result<Remapped> {
        let (revision, touched) = (&mut self.revision, &self.touched);
        follow_scans(&store, self.catalog, &mut self.entries, revision, touched, &mut side, &mut |_| ())?;
        let tiles: Vec<_> = store.tiles().iter().filter(|&tile| touched.has(tile)).collect();
        revision.counts.tiles = store.tiles().count() as u64;
        revision.counts.tiles_mapped = tiles.len() as u64;
        self.remapped.mapped = revision.counts;
        let stop = self.how.rework.stop.clone();
        let mut remapper = Remapper::begin(store, touched.config.clone(), tiles, stop)?;
        remapper.take_over(&mut side)?;
        if let Err(error) = remapper.finish(true, TileStore::release_scans)? {
            log::warn!("{}: committed, but not tidied up: {error:#}", self.folder.display());
        }
        Ok(self.remapped)
    }
}

/// Maps what the scans that come after so many entries say about touched tiles.
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
                let record = revision.map_beside(store.layout(), *record, touched, map)?;
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

/// Scans add to the catalog that was read; what changes earlier entries makes another one.
fn check_catalog(store: &TileStore, catalog: Option<u64>) -> Result<()> {
    match store.archive().generation()? == catalog {
        true => Ok(()),
        false => Err(Error::Changed { path: store.folder().to_owned() }),
    }
}

impl std::fmt::Debug for RemapBeside {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { folder, remapped, entries, .. } = self;
        let mut out = f.debug_struct("RemapBeside");
        out.field("folder", folder)
            .field("remapped", remapped)
            .field("entries", entries)
            .finish_non_exhaustive()
    }
}
