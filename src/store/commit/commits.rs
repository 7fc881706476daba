use super::metadata::Metadata;
use crate::error::FormatError;
use crate::space::{TileIndex, TileTable};
use crate::store::scans::CatalogVersion;
use crate::store::tiles::tile_version::TileVersion;

/// Accumulated content of all records of a log.
#[derive(Clone, Debug, Default)]
pub struct Commits {
    /// Number of the last flush; 0 before the first.
    pub flush_number: u64,
    /// Number of the last scan in the last flush; 0 before the first.
    pub scan_number: u64,
    /// All tiles of the map.
    pub tiles: TileTable<TileVersion>,
    /// Tiles that the last record changes.
    pub last_changed: TileTable<()>,
    /// Tiles that the last record removes. Their files may still exist.
    pub last_removed: Vec<TileIndex>,
    /// Catalog of kept scans. `None` if the map does not keep its scans, or if an older version of voxtile wrote the
    /// log: then the newest catalog is valid.
    pub catalog: Option<CatalogVersion>,
    /// Last metadata in the log. Its parameters are those of the map; its bounds and numbers may be older.
    pub metadata: Option<Metadata>,
    /// Error at the end of the log, where a flush may have been interrupted. That flush was not committed, except if
    /// its number is in `metadata.json`: then the log is damaged.
    pub torn: Option<FormatError>,
}
