use super::contents::TileContents;
use super::shared_contents::SharedContents;
use super::tile_cache::TileCache;
use super::tile_disk::TileDisk;
use super::tile_pager::TilePager;
use super::views::Views;
use super::write_buffer::WriteBuffer;
use crate::config::MapConfig;
use crate::space::TileBox;
use crate::store::TileStore;
use std::sync::{Arc, Mutex, PoisonError};

/// The tiles of an out-of-core map: what it holds, which readers share, and the disk, which belongs to the mapper.
#[derive(Debug)]
pub(in crate::mapper) struct PagedTiles {
    config: MapConfig,
    contents: Arc<SharedContents>,
    disk: Mutex<TileDisk>,
}

impl PagedTiles {
    pub(in crate::mapper) fn new(config: MapConfig, store: TileStore) -> Self {
        let contents = TileContents {
            cache: TileCache::new(&config),
            buffer: WriteBuffer::default(),
            scan_number: store.commits().scan_number,
            last_scan: None,
            bounds: TileBox::of(store.tiles().chain(store.orphans())),
            inputs: store.metadata().ext.as_ref().map_or(Vec::new(), |ext| ext.inputs.clone()),
            views: Views::default(),
        };
        let disk = Mutex::new(TileDisk::new(&config, store));
        Self { config, contents: Arc::new(SharedContents::new(contents)), disk }
    }

    /// The pager, for one call of the mapper. A second one waits until the first is dropped.
    pub(in crate::mapper) fn pager(&self) -> TilePager<'_> {
        // A panic in a query leaves no update half applied.
        let disk = self.disk.lock().unwrap_or_else(PoisonError::into_inner);
        TilePager { config: &self.config, shared: &self.contents, contents: self.contents.lock(), disk }
    }

    /// What readers share with the mapper.
    pub(in crate::mapper) fn contents(&self) -> &Arc<SharedContents> {
        &self.contents
    }
}
