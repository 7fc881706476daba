//! Flushes beside the mapper: a thread writes the tiles as of a scan and commits them, while other scans go on.
//!
//! Until it has committed, the mapper saves no tile: a version that a later scan made must not get the name of one that
//! the commit is to name. Where memory is so short that a dirty tile has to go, the mapper waits for the flush.

use super::shared_contents::SharedContents;
use super::shared_disk::SharedDisk;
use crate::config::MapConfig;
use crate::error::Result;
use crate::persistence::{CompactTile, TileSaver, Worker};
use crate::space::{Grid, TileIndex};
use crate::store::{BegunCommit, TileVersion, TileWriter};
use crate::tile::Tile;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// The thread that flushes beside the mapper.
#[derive(Debug)]
pub(super) struct Flusher {
    worker: Mutex<Worker<FlushJob, ()>>,
}

/// All that a flush takes.
pub(super) struct FlushJob {
    pub(super) contents: Arc<SharedContents>,
    pub(super) disk: Arc<SharedDisk>,
    pub(super) begun: BegunFlush,
}

/// The map as of a scan, as far as it is to be written.
pub(super) struct BegunFlush {
    pub(super) scan_number: u64,
    /// The dirty tiles.
    pub(super) tiles: Vec<FlushedTile>,
    /// Those of them that the next scan will change.
    pub(super) soon_changed: Range<usize>,
    pub(super) writer: TileWriter,
    pub(super) commit: BegunCommit,
}

/// A tile as it is to be written.
pub(super) enum FlushedTile {
    Resident(Arc<Tile>),
    Compact(TileIndex, CompactTile),
}

/// Tiles that are written before the locks are taken to note them.
const NOTED_AT_ONCE: usize = 8;

impl Flusher {
    pub(super) fn new(config: &MapConfig) -> Self {
        let config = config.clone();
        let worker = Worker::new("voxtile-flush", move |job: FlushJob| job.run(&config));
        Self { worker: Mutex::new(worker) }
    }

    /// Begins a flush. The caller holds no lock: where the system refuses a thread, it is done here.
    pub(super) fn give(&self, job: FlushJob) {
        self.worker.lock().unwrap_or_else(PoisonError::into_inner).give(job);
    }

    /// Waits for a flush to end; tells whether there was one. The caller holds no lock.
    pub(super) fn wait(&self) -> bool {
        self.worker.lock().unwrap_or_else(PoisonError::into_inner).wait().is_some()
    }
}

impl FlushJob {
    fn run(mut self, config: &MapConfig) {
        self.copy_soon_changed();
        let flushed = self.write_tiles(config).and_then(|()| self.commit());
        let mut contents = self.contents.lock();
        for tile in self.begun.tiles {
            contents.note_not_flushed(tile);
        }
        contents.end_flight(flushed);
    }

    /// Copies the tiles that the next scan will change, so that it needs not.
    fn copy_soon_changed(&mut self) {
        let tiles = self.begun.tiles.get_mut(self.begun.soon_changed.clone()).unwrap_or_default();
        for tile in tiles {
            let FlushedTile::Resident(shared) = tile else { continue };
            // A scan may have been first.
            if self.contents.lock().is_shared_with_flush(shared.index()) {
                *shared = Arc::new(Tile::clone(shared));
                self.contents.lock().note_copied(shared.index());
            }
        }
    }

    fn write_tiles(&mut self, config: &MapConfig) -> Result<()> {
        let Self { contents, disk, begun } = self;
        let mut saver = TileSaver::new(config);
        loop {
            let mut written = Vec::new();
            let mut outcome = Ok(());
            while written.len() < NOTED_AT_ONCE
                && let Some(tile) = begun.tiles.pop()
            {
                match tile.write(&mut saver, &begun.writer, &config.grid, begun.scan_number) {
                    Ok(version) => written.push((tile, version)),
                    Err(error) => {
                        begun.tiles.push(tile);
                        outcome = Err(error);
                        break;
                    }
                }
            }
            let is_all = written.is_empty();
            // In the order in which the mapper takes them.
            let mut disk = disk.lock();
            let mut contents = contents.lock();
            for (tile, version) in written {
                disk.note_flushed(tile.index(), version);
                contents.note_flushed(tile, version);
            }
            outcome?;
            if is_all {
                return Ok(());
            }
        }
    }

    /// Commits what was written. The lock on the disk is held for the steps that are short; what takes long goes on
    /// beside the mapper.
    fn commit(&self) -> Result<()> {
        let (has_news, unsynced) = {
            let disk = self.disk.lock();
            (disk.store().has_news(&self.begun.commit), disk.store().unsynced())
        };
        if has_news {
            let synced = unsynced.sync_with_scans();
            self.disk.lock().store_mut().commit_synced(&self.begun.commit, synced)?;
        }
        // It is committed: what the disk refuses from here on is done later.
        if let Err(error) = self.put_in_place() {
            log::warn!("flushed, but not tidied up: {error:#}");
        }
        Ok(())
    }

    fn put_in_place(&self) -> Result<()> {
        loop {
            let Some(step) = self.disk.lock().store_mut().begin_step()? else { break };
            step.sync_kept()?;
            for part in 0..step.parts() {
                self.disk.lock().store_mut().put_in_place(&step, part)?;
            }
            step.sync_names()?;
            self.disk.lock().store_mut().end_step(&step);
        }
        self.disk.lock().store_mut().tidy_up();
        Ok(())
    }
}

impl FlushedTile {
    pub(super) fn index(&self) -> TileIndex {
        match self {
            Self::Resident(tile) => tile.index(),
            Self::Compact(index, _) => *index,
        }
    }

    /// Bytes of memory, as they count while it is shared.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Resident(tile) => tile.bytes(),
            Self::Compact(_, tile) => tile.bytes().len(),
        }
    }

    fn write(
        &self,
        saver: &mut TileSaver,
        writer: &TileWriter,
        grid: &Grid,
        scan_number: u64,
    ) -> Result<TileVersion> {
        match self {
            Self::Resident(tile) => saver.write(writer, tile.index(), tile.table(), scan_number),
            Self::Compact(index, tile) => saver.write_compact(writer, grid, *index, tile, scan_number),
        }
    }
}
