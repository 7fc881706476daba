use super::live_view::LiveView;
use super::read_tiles::ReadTiles;
use crate::config::MapConfig;
use crate::mapper::paging::SharedContents;
use crate::store::TileReader;
use parking_lot::Mutex;
use std::sync::Arc;

/// Asks a map in other threads while its mapper inserts scans and flushes: a planner beside a mapper.
///
/// Every query sees the map as of one scan, unsaved ones too. It waits for no flush and for no disk but its own reads;
/// it waits while the mapper changes tiles in memory, which is the shorter part of inserting a scan. Queries that
/// belong together ask a [`LiveView`].
///
/// Threads of any rayon pool may ask, and so may parallel loops over single queries: while the mapper changes tiles it
/// uses threads of its own.
///
/// After the mapper is dropped it goes on seeing the last scan, until another writer opens the map.
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

/// What readers of a map share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) config: MapConfig,
    pub(super) contents: Arc<SharedContents>,
    pub(super) files: TileReader,
    pub(super) read_tiles: Mutex<ReadTiles>,
}

impl LiveReader {
    /// Readers may take so many bytes of memory for tiles that they make.
    pub(in crate::mapper) fn new(
        config: MapConfig,
        contents: Arc<SharedContents>,
        files: TileReader,
        bytes: usize,
    ) -> Self {
        let read_tiles = Mutex::new(ReadTiles::new(bytes));
        Self(Arc::new(Shared { config, contents, files, read_tiles }))
    }

    /// How the map is made.
    pub fn config(&self) -> &MapConfig {
        &self.0.config
    }

    /// The map after its latest scan. [`Queries`](crate::Queries) of the reader itself take a new view each.
    pub fn view(&self) -> LiveView {
        LiveView::open(self.0.clone())
    }
}
