//! Background flush: a thread writes the tiles as of a scan and commits them, while the mapper inserts other scans.
//!
//! Until the commit, the mapper saves no tile: a file with a later version must not take the name of one that the
//! commit references. If dirty tiles fill the memory of the compact form, the mapper waits for the flush.

use super::pinned_tile::{PinnedForm, PinnedTile};
use super::shared_contents::SharedContents;
use super::shared_disk::SharedDisk;
use super::unapplied_tile::UnappliedTile;
use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::persistence::{CompactTile, TileSaver, Worker};
use crate::space::TileIndex;
use crate::store::{BegunCommit, TileReader, TileVersion, TileWriter};
use crate::tile::Tile;
use std::ops::Range;
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};

/// Thread of the background flush.
#[derive(Debug)]
pub(super) struct Flusher {
    worker: Mutex<Worker<FlushJob, ()>>,
    /// Receives a message whenever the running flush has released tiles.
    progress: Mutex<Option<Receiver<()>>>,
}

/// Input of a flush.
pub(super) struct FlushJob {
    pub(super) contents: Arc<SharedContents>,
    pub(super) disk: Arc<SharedDisk>,
    pub(super) begun: BegunFlush,
    pub(super) progress: Sender<()>,
}

/// Map as of a scan, reduced to what has to be written.
pub(super) struct BegunFlush {
    pub(super) scan_number: u64,
    /// Dirty tiles, except those in the compact form. Written in reverse order.
    pub(super) tiles: Vec<FlushedTile>,
    pub(super) compact: Vec<FlushedTile>,
    /// The first `after_saves` tiles are written when no save is running any more: older versions of them are being
    /// saved.
    pub(super) after_saves: usize,
    /// The part of `tiles` that the next scan will likely change.
    pub(super) soon_changed: Range<usize>,
    pub(super) writer: TileWriter,
    /// Reads the earlier versions of tiles.
    pub(super) files: TileReader,
    pub(super) commit: BegunCommit,
}

pub(super) enum FlushedTile {
    Resident(Arc<PinnedTile>),
    Compact(TileIndex, CompactTile),
    /// Built from its updates for writing only.
    Unapplied(Box<UnappliedTile>),
}

/// Number of tiles that are written between two acquisitions of the locks.
const NOTED_AT_ONCE: usize = 8;

/// Bytes of written files after which tiles are recorded, even if they are fewer than [`NOTED_AT_ONCE`]. A mapper that
/// waits for memory waits for this record, and a slow disk takes some milliseconds for this many bytes.
const NOTED_BYTES: u64 = 256 << 10;

impl Flusher {
    pub(super) fn new(config: &MapConfig) -> Self {
        let config = config.clone();
        let worker = Worker::new("voxtile-flush", move |job: FlushJob| job.run(&config)).with_low_priority();
        Self { worker: Mutex::new(worker), progress: Mutex::new(None) }
    }

    /// Begins a flush. The caller must not hold a lock: if the system cannot create a thread, the flush runs in this
    /// call.
    pub(super) fn give(&self, job: FlushJob, progress: Receiver<()>) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
        self.worker.lock().unwrap_or_else(PoisonError::into_inner).give(job);
    }

    /// Waits until the running flush has released tiles; returns `false` if it has ended. The caller must not hold a
    /// lock.
    pub(super) fn wait_for_some(&self) -> bool {
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.as_ref().is_some_and(|progress| progress.recv().is_ok())
    }

    /// Waits for the end of a flush; returns whether there was one. The caller must not hold a lock.
    pub(super) fn wait(&self) -> bool {
        self.worker.lock().unwrap_or_else(PoisonError::into_inner).wait().is_some()
    }
}

impl FlushJob {
    fn run(mut self, config: &MapConfig) {
        self.copy_soon_changed();
        let flushed = self.write_tiles(config).and_then(|()| self.commit());
        // The locks are taken in the same order as in the mapper, which prevents a deadlock.
        let disk = self.disk.lock();
        let mut contents = self.contents.lock();
        for tile in self.begun.tiles.into_iter().chain(self.begun.compact) {
            contents.note_not_flushed(tile, &disk);
        }
        contents.end_background_flush(flushed);
    }

    /// Copies the tiles that the next scan will likely change, so that the scan need not copy them.
    fn copy_soon_changed(&mut self) {
        let tiles = self.begun.tiles.get_mut(self.begun.soon_changed.clone()).unwrap_or_default();
        for tile in tiles {
            let FlushedTile::Resident(held) = tile else { continue };
            // A scan may already have copied the tile.
            if self.contents.lock().is_shared_with_flush(held.index())
                && let Some(shared) = held.resident()
                && held.hold_copy(Tile::clone(&shared))
            {
                drop(shared);
                self.contents.lock().note_copied(held.index());
            }
        }
    }

    fn write_tiles(&mut self, config: &MapConfig) -> Result<()> {
        let mut saver = TileSaver::new(config);
        let mut is_behind = false;
        loop {
            if self.begun.has_only_to_wait() {
                self.end_saves()?;
            }
            let Self { contents, disk, begun, progress } = self;
            let (mut written, mut bytes) = (Vec::new(), 0);
            let mut outcome = Ok(());
            while written.len() < NOTED_AT_ONCE
                && bytes < NOTED_BYTES
                && let Some(tile) = begun.next(is_behind)
            {
                match begun.write(&tile, &mut saver, config) {
                    Ok(version) => {
                        bytes += version.table.bytes + version.octree.bytes;
                        written.push((tile, version));
                    }
                    Err(error) => {
                        begun.tiles.push(tile);
                        outcome = Err(error);
                        break;
                    }
                }
            }
            let is_all = written.is_empty();
            let mut disk = disk.lock();
            let mut contents = contents.lock();
            for (tile, version) in written {
                if let FlushedTile::Unapplied(tile) = &tile {
                    tile.bytes_on_disk().into_iter().for_each(|bytes| disk.note_read_to_flush(bytes));
                }
                disk.note_flushed(tile.index(), version);
                contents.note_flushed(tile, version, &disk);
            }
            is_behind = contents.cache.is_behind();
            // A failure is ignored, because there may be no receiver.
            let _ = progress.send(());
            outcome?;
            if is_all {
                return Ok(());
            }
        }
    }

    /// Waits until no save is running. Most have ended by now, because the mapper begins none during a flush.
    fn end_saves(&mut self) -> Result<()> {
        loop {
            let mut disk = self.disk.lock();
            let saved = disk.wait_saved();
            let mut contents = self.contents.lock();
            if let Some(saved) = saved {
                contents.note_saved(saved, &mut disk);
                continue;
            }
            let Some(pinned) = &mut contents.pinned else { return Ok(()) };
            if pinned.waits_for_saves() {
                let lost = std::io::Error::other("the save thread ended unexpectedly");
                return Err(Error::io(disk.store().folder(), "flush", lost));
            }
            let unsaved = pinned.take_unsaved().into_iter();
            self.begun.compact.extend(unsaved.map(|(index, tile)| FlushedTile::Compact(index, tile)));
            self.begun.after_saves = 0;
            return Ok(());
        }
    }

    /// Commits the written tiles. The lock on the disk is held only for short steps, so that the mapper can continue
    /// during the long ones.
    fn commit(&self) -> Result<()> {
        let (has_news, unsynced) = {
            let disk = self.disk.lock();
            (disk.store().has_news(&self.begun.commit), disk.store().unsynced())
        };
        if has_news {
            let synced = unsynced.sync_with_scans();
            self.disk.lock().store_mut().commit_synced(&self.begun.commit, synced)?;
        }
        // The flush is committed: steps that fail from here on are repeated later.
        if let Err(error) = self.put_in_place() {
            log::warn!("flushed, but cleanup failed and will be repeated: {error:#}");
        }
        Ok(())
    }

    fn put_in_place(&self) -> Result<()> {
        loop {
            let Some(step) = self.disk.lock().store_mut().begin_step()? else { break };
            step.sync_kept()?;
            for &tile in step.tiles() {
                self.disk.lock().store_mut().put_in_place(&step, tile)?;
            }
            step.sync_names()?;
            self.disk.lock().store_mut().end_step(&step);
        }
        self.disk.lock().store_mut().tidy_up();
        Ok(())
    }
}

impl BegunFlush {
    /// Returns the next tile to write. Tiles that will be evicted first are written first: resident tiles, or compact
    /// ones if the compact tier is full (`is_behind`).
    fn next(&mut self, is_behind: bool) -> Option<FlushedTile> {
        let compact = if is_behind { self.compact.pop() } else { None };
        if compact.is_none() && self.tiles.len() > self.after_saves {
            return self.tiles.pop();
        }
        compact.or_else(|| self.compact.pop())
    }

    /// Returns whether all remaining tiles must wait for running saves.
    fn has_only_to_wait(&self) -> bool {
        self.compact.is_empty() && self.tiles.len() <= self.after_saves
    }

    fn write(&self, tile: &FlushedTile, saver: &mut TileSaver, config: &MapConfig) -> Result<TileVersion> {
        let (writer, scan_number) = (&self.writer, self.scan_number);
        match tile {
            FlushedTile::Resident(held) => match held.begin_write() {
                PinnedForm::Resident(tile) => saver.write(writer, tile.index(), tile.table(), scan_number),
                PinnedForm::Compact(tile) => {
                    saver.write_compact(writer, &config.grid, held.index(), &tile, scan_number)
                }
            },
            FlushedTile::Compact(index, tile) => {
                saver.write_compact(writer, &config.grid, *index, tile, scan_number)
            }
            FlushedTile::Unapplied(tile) => {
                let made = tile.make(&self.files, config)?;
                // The tile may be built from an earlier `*.next` file, which the mapper may be reading: keep this file.
                let writer = writer.clone().keeping_earlier();
                saver.write(&writer, tile.index, made.table(), scan_number)
            }
        }
    }
}

impl FlushedTile {
    pub(super) fn index(&self) -> TileIndex {
        match self {
            Self::Resident(tile) => tile.index(),
            Self::Compact(index, _) => *index,
            Self::Unapplied(tile) => tile.index,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Resident(tile) => tile.bytes(),
            Self::Compact(_, tile) => tile.bytes().len(),
            Self::Unapplied(tile) => tile.bytes(),
        }
    }
}
