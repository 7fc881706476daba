use super::stalls::Stalls;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::statistics::{IoCounts, MapStatistics};
use crate::persistence::{CompactTile, IoThreads, Loaded, Saved, TileSaver, load, new_metadata, upgrade};
use crate::scan::{MovingMarks, PackedUpdates, PointBlocks, PointFrame, ScanPoints, TileUpdates};
use crate::space::{TileIndex, TileTable};
use crate::store::{
    BegunCommit, CatalogEntry, InputRecord, KeptMarks, Metadata, SegmentPlace, SnapshotName, SpillFile,
    SpillFiles, TileStore, TileVersion, TileWriter,
};
use crate::tile::{Table, Tile};
use std::time::{Duration, Instant};

/// Disk access of the pager: the map's store, the threads that save and load in the background, and counts of both.
#[derive(Debug)]
pub(super) struct TileDisk {
    config: MapConfig,
    store: TileStore,
    spills: SpillFiles,
    /// Saves tiles on the mapper's own thread.
    saver: TileSaver,
    threads: IoThreads,
    stalls: Stalls,
    counts: IoCounts,
    /// Tiles on disk that were neither read nor written since the map was opened, and may be damaged. Their updates are
    /// not buffered, so that damage is found before a scan is accepted.
    unread: TileTable<()>,
    /// Tiles written since the last call of `take_written`.
    written: TileTable<()>,
    /// Error of a failed background save, whose tile is still dirty.
    save_error: Option<Error>,
    /// Encoder for the points of kept scans.
    blocks: PointBlocks,
}

/// Approximate bytes of memory per voxel of a tile on disk.
pub(super) const BYTES_OF_VOXEL: usize = 6;
/// Maximum bytes of the marks of a scan in one block, below the limit of blocks.
const MARKS_BLOCK_BYTES: usize = 1 << 20;

impl TileDisk {
    pub(super) fn new(config: &MapConfig, store: TileStore) -> Self {
        let unread = store.tiles().iter().chain(store.tiles().orphans()).map(|tile| (tile, ())).collect();
        Self {
            config: config.clone(),
            spills: store.spill_files(),
            store,
            saver: TileSaver::new(config),
            threads: IoThreads::new(config),
            stalls: Stalls::default(),
            counts: IoCounts::default(),
            unread,
            written: TileTable::default(),
            save_error: None,
            blocks: PointBlocks::default(),
        }
    }

    pub(super) fn store(&self) -> &TileStore {
        &self.store
    }

    /// Returns whether a tile is on disk and was not verified yet.
    pub(super) fn is_unread(&self, index: TileIndex) -> bool {
        self.unread.contains(index)
    }

    /// Runs an operation that the mapper waits for, and counts the time.
    pub(super) fn stall<T>(&mut self, wait: impl FnOnce(&mut Self) -> T) -> T {
        let since = Instant::now();
        let answer = wait(self);
        self.stalls.note(since.elapsed());
        answer
    }

    pub(super) fn note_stall(&mut self, time: Duration) {
        self.stalls.note(time);
    }

    // Reading.

    /// Reads the table of a tile; `None` if it is not on disk.
    ///
    /// # Errors
    ///
    /// Fails if the tile is damaged or the read fails.
    pub(super) fn read(&mut self, index: TileIndex) -> Result<Option<Table>> {
        if !self.store.tiles().contains(index) {
            return Ok(None);
        }
        let read = self.stall(|disk| load::load_table(&disk.store, &disk.config.grid, index))?;
        Ok(read.map(|read| {
            self.note_read(index, read.file.bytes);
            read.table
        }))
    }

    fn note_read(&mut self, index: TileIndex, bytes: u64) {
        self.counts.loads += 1;
        self.counts.bytes_read += bytes;
        self.unread.remove(index);
    }

    pub(super) fn can_prefetch(&self) -> bool {
        self.threads.can_load()
    }

    pub(super) fn is_prefetching(&self, index: TileIndex) -> bool {
        self.threads.is_loading(index)
    }

    /// Begins to read a tile in the background, if it is on disk.
    pub(super) fn prefetch(&mut self, index: TileIndex) {
        if let Some(location) = self.store.tables().location(index) {
            let voxels = self.store.tiles().version(index).map_or(0, |version| version.voxels) as usize;
            self.threads.load(location, BYTES_OF_VOXEL.saturating_mul(voxels));
        }
    }

    /// Returns a prefetch that has ended, if any; without a table if it failed. The tile is then read again when it is
    /// needed, which reports the error.
    pub(super) fn take_prefetched(&mut self) -> Option<(TileIndex, Option<Table>)> {
        let loaded = self.threads.take_loaded()?;
        Some(self.note_prefetched(loaded))
    }

    /// Waits for a prefetch to end; `None` if none is running.
    pub(super) fn wait_prefetched(&mut self) -> Option<(TileIndex, Option<Table>)> {
        let loaded = self.threads.wait_loaded()?;
        Some(self.note_prefetched(loaded))
    }

    fn note_prefetched(&mut self, loaded: Loaded) -> (TileIndex, Option<Table>) {
        let Loaded { index, result } = loaded;
        let Ok(read) = result else { return (index, None) };
        if self.store.tiles().version(index).is_some_and(|version| version.table != read.file) {
            return (index, None); // A background flush has written a newer version since.
        }
        self.note_read(index, read.file.bytes);
        self.counts.prefetches += 1;
        (index, Some(read.table))
    }

    // Writing.

    /// Writes the next version of a tile and returns it. No save of the tile may be running, because its older version
    /// could overwrite this one.
    ///
    /// # Errors
    ///
    /// Fails if the write fails.
    pub(super) fn write(&mut self, tile: &Tile, scan_number: u64) -> Result<TileVersion> {
        let version = self.saver.save(&mut self.store, tile, scan_number)?;
        self.note_written(tile.index(), version);
        Ok(version)
    }

    /// Records that a background flush has written a tile.
    pub(super) fn note_flushed(&mut self, index: TileIndex, version: TileVersion) {
        self.store.tiles_mut().note_next(index, version);
        self.note_written(index, version);
    }

    /// Counts a tile of `bytes` bytes that a background flush has read.
    pub(super) fn note_read_to_flush(&mut self, bytes: u64) {
        self.counts.loads += 1;
        self.counts.bytes_read += bytes;
    }

    fn note_written(&mut self, index: TileIndex, version: TileVersion) {
        self.counts.saves += 1;
        self.counts.bytes_written += version.table.bytes + version.octree.bytes;
        self.unread.remove(index);
        self.written.insert(index, ());
    }

    /// Returns the tiles written since the last call, sorted by index.
    pub(super) fn take_written(&mut self) -> Vec<TileIndex> {
        std::mem::take(&mut self.written).tiles().collect()
    }

    pub(super) fn can_save(&self) -> bool {
        self.threads.can_save()
    }

    pub(super) fn is_saving(&self, index: TileIndex) -> bool {
        self.threads.is_saving(index)
    }

    /// Returns a writer for a background save.
    ///
    /// # Errors
    ///
    /// Fails if the rest of the last commit cannot be completed.
    pub(super) fn writer(&mut self) -> Result<TileWriter> {
        self.store.writer()
    }

    /// Begins to save a tile in the background.
    pub(super) fn save(&mut self, writer: TileWriter, index: TileIndex, tile: CompactTile, scan_number: u64) {
        self.threads.save(writer, index, tile, scan_number);
    }

    /// Returns a save that has ended, if any; pass it to [`TileDisk::note_saved`].
    pub(super) fn take_saved(&mut self) -> Option<Saved> {
        self.threads.take_saved()
    }

    /// Waits for a save to end; `None` if none is running.
    pub(super) fn wait_saved(&mut self) -> Option<Saved> {
        self.threads.wait_saved()
    }

    /// Records the end of a save; returns the version that is on disk now. `is_current` is whether the tile in memory
    /// is still the saved version. If not, the tile will be written again, so an error is ignored.
    pub(super) fn note_saved(&mut self, saved: Saved, is_current: bool) -> Option<TileVersion> {
        let Saved { index, result, .. } = saved;
        match result {
            Ok(version) => {
                self.store.tiles_mut().note_next(index, version);
                self.note_written(index, version);
                return Some(version);
            }
            Err(error) if is_current => self.save_error = Some(error),
            Err(error) => log::debug!("an older version of tile {index} was not saved: {error:#}"),
        }
        None
    }

    /// Returns whether a background save has failed and the error was not taken.
    pub(super) fn has_save_error(&self) -> bool {
        self.save_error.is_some()
    }

    /// Takes the error of a failed background save, so that it is reported once.
    pub(super) fn take_save_error(&mut self) -> Option<Error> {
        self.save_error.take()
    }

    // Spilled updates.

    /// Appends updates of a tile to its spill file after the bytes in use.
    ///
    /// # Errors
    ///
    /// Fails if the write fails; the bytes in use are unchanged.
    pub(super) fn spill(
        &mut self,
        index: TileIndex,
        before: SpillFile,
        updates: &PackedUpdates,
    ) -> Result<SpillFile> {
        let appended = self.spills.append(index, before, updates.as_bytes());
        let file = appended.inspect_err(|_| self.spills.cut(index, before))?;
        self.counts.bytes_written += updates.as_bytes().len() as u64;
        Ok(file)
    }

    /// Reads the updates in a tile's spill file, in order.
    ///
    /// # Errors
    ///
    /// Fails if the read fails or the content is not what was written.
    pub(super) fn read_spill(
        &mut self,
        index: TileIndex,
        file: SpillFile,
        take: impl FnMut(TileUpdates),
    ) -> Result<()> {
        let input = self.stall(|disk| disk.spills.open(index, file))?;
        self.counts.bytes_read += file.bytes;
        PackedUpdates::unpack(input, take)
            .map_err(|error| Error::io(&self.store.layout().spill(index), "read", error))
    }

    pub(super) fn remove_spill(&self, index: TileIndex) {
        self.spills.remove(index);
    }

    /// Truncates a tile's spill file to the bytes in use.
    pub(super) fn cut_spill(&self, index: TileIndex, file: SpillFile) {
        self.spills.cut(index, file);
    }

    // Commits.

    /// Upgrades a map of the original format before its first change.
    ///
    /// # Errors
    ///
    /// Fails if the map is damaged or a disk operation fails.
    pub(super) fn upgrade(&mut self, inputs: &[InputRecord]) -> Result<()> {
        let Self { store, saver, config, .. } = self;
        upgrade(store, saver, config, |map_id| new_metadata(config, map_id, inputs))
    }

    /// Writes the points of a scan to be kept, and its marks of moving points if there are any.
    ///
    /// # Errors
    ///
    /// Fails if points cannot be read or written; nothing is kept then.
    pub(super) fn keep(&mut self, scan: &dyn ScanPoints) -> Result<(SegmentPlace, Option<KeptMarks>)> {
        let (archive, blocks) = (self.store.archive_mut(), &mut self.blocks);
        archive.begin_scan()?;
        blocks.begin();
        let (mut written, put) = (Ok(()), &mut |block: &[u8]| archive.push_block(block));
        let all = 0..scan.len();
        let read =
            scan.for_each_attributed_chunk(all, PointFrame::Raw, &mut |points, intensities, attributes| {
                written = blocks.push(points, intensities, attributes, put);
                written.is_ok()
            });
        let mut kept = read.and(written).and_then(|()| blocks.end(scan.has_intensities(), put));
        let place = archive.end_scan();
        let mut moving = None;
        if let Some(marks) = scan.moving().filter(|marks| marks.marked() > 0) {
            let mut blocks = marks.as_bytes().chunks(MARKS_BLOCK_BYTES);
            kept = kept.and_then(|()| blocks.try_for_each(|block| archive.push_block(block)));
            // The marks follow the points.
            let end = place.offset + place.bytes;
            let bytes = archive.end_scan().bytes - place.bytes;
            let place = Some(SegmentPlace { offset: end, bytes, ..place });
            moving = Some(KeptMarks { marked: marks.marked(), place });
        }
        match kept {
            Ok(()) => Ok((place, moving)),
            Err(error) => {
                archive.give_up_scan();
                Err(error)
            }
        }
    }

    /// Writes new marks of moving points; `None` if no point is marked.
    ///
    /// # Errors
    ///
    /// An I/O error; nothing is written then.
    pub(super) fn keep_marks(&mut self, marks: &MovingMarks) -> Result<Option<KeptMarks>> {
        if marks.marked() == 0 {
            return Ok(None);
        }
        let archive = self.store.archive_mut();
        archive.begin_scan()?;
        match marks.as_bytes().chunks(MARKS_BLOCK_BYTES).try_for_each(|block| archive.push_block(block)) {
            Ok(()) => Ok(Some(KeptMarks { marked: marks.marked(), place: Some(archive.end_scan()) })),
            Err(error) => {
                archive.give_up_scan();
                Err(error)
            }
        }
    }

    /// Discards the points of a scan that were written by [`Self::keep`] but not recorded.
    pub(super) fn discard_kept(&mut self) {
        self.store.archive_mut().give_up_scan();
    }

    /// Records a scan or a batch for the next commit.
    pub(super) fn note(&mut self, entry: CatalogEntry) {
        match entry {
            CatalogEntry::Listed(scan) => self.store.note_scan(scan),
            entry => self.store.archive_mut().note(entry),
        }
    }

    /// The store, for writing a catalog.
    pub(super) fn store_mut(&mut self) -> &mut TileStore {
        &mut self.store
    }

    /// Commits everything written so far.
    ///
    /// # Errors
    ///
    /// Fails if a disk operation fails; nothing is committed then.
    pub(super) fn commit(&mut self, inputs: &[InputRecord], scan_number: u64) -> Result<()> {
        let metadata = self.metadata(inputs);
        self.store.commit(metadata, scan_number)
    }

    /// Begins a commit that another thread completes, and returns the writer for its tiles.
    ///
    /// # Errors
    ///
    /// Fails if the rest of the last commit cannot be completed.
    pub(super) fn begin_commit(
        &mut self,
        inputs: &[InputRecord],
        scan_number: u64,
    ) -> Result<(BegunCommit, TileWriter)> {
        let metadata = self.metadata(inputs);
        let begun = self.store.begin_commit(metadata, scan_number)?;
        Ok((begun, self.store.writer()?))
    }

    fn metadata(&self, inputs: &[InputRecord]) -> Metadata {
        let map_id = self.store.map_id().unwrap_or_default();
        let mut metadata = new_metadata(&self.config, map_id, inputs);
        if let (Some(ext), Some(before)) = (&mut metadata.ext, &self.store.metadata().ext) {
            ext.decayed_scan = before.decayed_scan;
        }
        metadata
    }

    /// Creates a snapshot of the last commit.
    ///
    /// # Errors
    ///
    /// Fails if the name is in use or a disk operation fails.
    pub(super) fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.store.snapshot_writer().create(name)
    }

    // Counts.

    /// Bytes of memory of tiles that are being read or saved.
    pub(super) fn in_flight_bytes(&self) -> usize {
        self.threads.bytes()
    }

    /// Bytes of the index of tiles, without those of a commit.
    pub(super) fn index_bytes(&self) -> usize {
        self.store.index_bytes() + self.unread.bytes() + self.written.bytes()
    }

    /// Bytes of memory that a commit would take now.
    pub(super) fn commit_bytes(&self) -> usize {
        self.store.commit_bytes()
    }

    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        let versions = self.store.tiles().versions();
        statistics.disk_bytes = versions.map(|version| version.table.bytes + version.octree.bytes).sum();
        statistics.stalls = self.stalls.counts();
        statistics.io = self.counts;
    }
}
