use super::metadata::Metadata;
use crate::error::FormatError;
use crate::space::{TileIndex, TileTable};
use crate::store::scans::CatalogVersion;
use crate::store::tiles::tile_version::TileVersion;

/// All commits of a log, taken together.
#[derive(Clone, Debug, Default)]
pub struct Commits {
    /// Number of the last flush; 0 before the first.
    pub flush_number: u64,
    /// Number of the last scan in the last flush; 0 before the first.
    pub scan_number: u64,
    /// Every tile of the map.
    pub tiles: TileTable<TileVersion>,
    /// The tiles that the last record names.
    pub last_changed: TileTable<()>,
    /// The tiles that the last record takes out of the map: their files may still be there.
    pub last_removed: Vec<TileIndex>,
    /// The catalog of the scans that the map keeps; `None` if it keeps none, or the log is of a version that did not
    /// name it: then it is the newest one.
    pub catalog: Option<CatalogVersion>,
    /// The last metadata in the log: its parameters are the map's, its bounds and numbers may be older ones.
    pub metadata: Option<Metadata>,
    /// What is wrong with the end of the log, where a flush may have been cut short: it never happened, unless
    /// something else names it.
    pub torn: Option<FormatError>,
}
