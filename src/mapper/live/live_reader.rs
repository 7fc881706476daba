use super::live_view::LiveView;
use super::read_tiles::ReadTiles;
use crate::config::MapConfig;
use crate::mapper::paging::SharedContents;
use crate::store::TileReader;
use parking_lot::Mutex;
use std::sync::Arc;

/// Handle for querying a map from other threads while its mapper inserts scans and flushes, for example from a planner.
///
/// Each query sees the map as of one scan, including unsaved changes. A query waits neither for flushes nor for disk
/// accesses of the mapper. It does wait while the mapper changes tiles in memory, which is the shorter part of
/// inserting a scan. Use a [`LiveView`] for several queries about the same scan.
///
/// Queries may run on any thread, including in parallel loops on a rayon pool: while the mapper changes tiles, it uses
/// its own thread pool.
///
/// After the mapper is dropped, the handle still sees the last scan until another writer opens the map.
///
/// ```
/// use voxtile::{MapOptions, Mapper, Queries, Scan, Shape, UnknownAs};
///
/// # fn main() -> voxtile::Result<()> {
/// # let folder = tempfile::tempdir().unwrap();
/// let mut mapper = MapOptions::new().create_if_missing(true).open(folder.path().join("map"))?;
/// let reader = mapper.reader()?;
/// let planner = std::thread::spawn(move || {
///     let view = reader.view(); // Several questions about one scan.
///     let body = Shape::Sphere { center: [2.0, 0.0, 0.0], radius_m: 0.4 };
///     view.collision(&body, UnknownAs::Free)
/// });
/// mapper.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.0, 0.0, 0.0]], intensities: None })?;
/// mapper.flush()?;
/// assert_eq!(planner.join().unwrap()?, None);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct LiveReader(Arc<Shared>);

/// State shared by the readers of a map.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) config: MapConfig,
    pub(super) contents: Arc<SharedContents>,
    pub(super) files: TileReader,
    pub(super) read_tiles: Mutex<ReadTiles>,
}

impl LiveReader {
    /// Creates a reader. Readers keep at most `memory_bytes` of tiles that they read from disk.
    pub(in crate::mapper) fn new(
        config: MapConfig,
        contents: Arc<SharedContents>,
        files: TileReader,
        bytes: usize,
    ) -> Self {
        let read_tiles = Mutex::new(ReadTiles::new(bytes));
        Self(Arc::new(Shared { config, contents, files, read_tiles }))
    }

    /// Configuration of the map.
    pub fn config(&self) -> &MapConfig {
        &self.0.config
    }

    /// Returns a view of the map after its latest scan. [`Queries`](crate::Queries) called on the reader itself open a
    /// new view each time.
    pub fn view(&self) -> LiveView {
        LiveView::open(self.0.clone())
    }
}
