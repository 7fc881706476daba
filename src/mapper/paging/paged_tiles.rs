use super::contents::TileContents;
use super::flusher::{FlushJob, Flusher};
use super::shared_contents::SharedContents;
use super::shared_disk::SharedDisk;
use super::tile_cache::TileCache;
use super::tile_disk::TileDisk;
use super::tile_pager::TilePager;
use super::views::Views;
use super::write_buffer::WriteBuffer;
use crate::config::MapConfig;
use crate::error::Result;
use crate::store::TileStore;
use std::sync::Arc;
use std::sync::mpsc::channel;

/// Tiles of an out-of-core map: the contents, shared with readers, and the disk, shared by the mapper and the
/// background flush.
#[derive(Debug)]
pub(in crate::mapper) struct PagedTiles {
    config: MapConfig,
    contents: Arc<SharedContents>,
    disk: Arc<SharedDisk>,
    flusher: Flusher,
}

impl PagedTiles {
    pub(in crate::mapper) fn new(config: MapConfig, store: TileStore) -> Self {
        let contents = TileContents {
            cache: TileCache::new(&config),
            buffer: WriteBuffer::default(),
            scan_number: store.commits().scan_number,
            last_scan: None,
            last_touched: 0,
            space: store.tiles().iter().chain(store.tiles().orphans()).collect(),
            inputs: store.metadata().ext.as_ref().map_or(Vec::new(), |ext| ext.inputs.clone()),
            views: Views::default(),
            pinned: None,
            flush_reserve: 0,
            flush_error: None,
        };
        let disk = Arc::new(SharedDisk::new(TileDisk::new(&config, store)));
        let flusher = Flusher::new(&config);
        Self { config, contents: Arc::new(SharedContents::new(contents)), disk, flusher }
    }

    /// Locks the pager for one call of the mapper. A second call waits until the first pager is dropped.
    pub(in crate::mapper) fn pager(&self) -> TilePager<'_> {
        let disk = self.disk.lock();
        let Self { config, contents: shared, flusher, .. } = self;
        TilePager { config, shared, flusher, contents: shared.lock(), disk }
    }

    /// Begins a background flush of all changes so far. Waits first for a flush that is running.
    ///
    /// # Errors
    ///
    /// Fails with the error of an earlier flush, or if a tile cannot be read or a disk operation fails.
    pub(in crate::mapper) fn begin_flush(&self) -> Result<()> {
        let Some(begun) = self.pager().begin_flush()? else { return Ok(()) };
        let (contents, disk) = (self.contents.clone(), self.disk.clone());
        let (progress, on_progress) = channel();
        self.flusher.give(FlushJob { contents, disk, begun, progress }, on_progress);
        Ok(())
    }

    /// Waits for the background flush, if one is running.
    ///
    /// # Errors
    ///
    /// Fails with the error of the flush.
    pub(in crate::mapper) fn end_flush(&self) -> Result<()> {
        while self.flusher.wait() {}
        let mut pager = self.pager();
        // If the thread panicked, this reports the failure.
        pager.end_background_flush();
        pager.contents.take_flush_error().map_or(Ok(()), Err)
    }

    pub(in crate::mapper) fn contents(&self) -> &Arc<SharedContents> {
        &self.contents
    }
}

impl Drop for PagedTiles {
    /// Waits for a running flush to commit, and frees the map for another writer.
    fn drop(&mut self) {
        while self.flusher.wait() {}
    }
}

#[cfg(test)]
mod tests {
    use super::super::pinned_tiles::PinnedTiles;
    use super::*;
    use crate::persistence::{new_map_id, new_metadata};
    use crate::store::FsDisk;

    #[test]
    fn a_flush_whose_thread_panicked_fails() {
        let folder = tempfile::tempdir().unwrap();
        let (config, map_id) = (MapConfig::new(0.1, 1.0).unwrap(), new_map_id());
        let metadata = new_metadata(&config, map_id, &[]);
        let store =
            TileStore::create(Arc::new(FsDisk), &folder.path().join("map"), metadata, map_id).unwrap();
        let tiles = PagedTiles::new(config, store);
        assert!(tiles.end_flush().is_ok());
        // The state that a panicked thread leaves.
        tiles.contents.lock().pinned = Some(PinnedTiles::default());
        let error = tiles.end_flush().unwrap_err().to_string();
        assert!(error.contains("flush"), "{error}");
        assert!(tiles.end_flush().is_ok(), "the error is reported once");
        tiles.begin_flush().unwrap();
        assert!(tiles.end_flush().is_ok());
    }
}
