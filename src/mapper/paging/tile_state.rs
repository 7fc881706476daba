use crate::persistence::CompactTile;
use crate::scan::PackedUpdates;
use crate::store::{SpillFile, TileVersion};
use crate::tile::Tile;
use std::sync::Arc;

/// A tile at some time, wherever it is. It is cheap to copy and does not change.
#[derive(Clone, Debug)]
pub(in crate::mapper) enum TileState {
    /// Nothing was observed in it.
    Nothing,
    /// It is ready for use.
    Resident(Arc<Tile>),
    /// It has to be made.
    Stored(StoredTileState),
}

/// A tile that is not ready for use: what to begin with, and the updates to apply to that.
#[derive(Clone, Debug)]
pub(in crate::mapper) struct StoredTileState {
    pub(in crate::mapper) base: Base,
    /// Updates in the tile's spill file, if it is not empty.
    pub(in crate::mapper) spilled: SpillFile,
    /// Updates after these.
    pub(in crate::mapper) updates: Option<Arc<PackedUpdates>>,
}

/// What a stored tile is made from.
#[derive(Clone, Debug)]
pub(in crate::mapper) enum Base {
    /// Updates alone.
    Nothing,
    /// Its compact form in memory.
    Compact(CompactTile),
    /// A version on disk.
    OnDisk(TileVersion),
    /// A folder that the log does not name.
    Orphan,
}

impl TileState {
    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>()
            + match self {
                Self::Nothing => 0,
                Self::Resident(tile) => tile.bytes(),
                Self::Stored(StoredTileState { base, updates, .. }) => {
                    let compact = if let Base::Compact(tile) = base { tile.bytes().len() } else { 0 };
                    compact + updates.as_ref().map_or(0, |updates| updates.bytes())
                }
            }
    }
}

impl Base {
    /// Whether both are the same tile in the same version.
    pub(in crate::mapper) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Compact(own), Self::Compact(other)) => own.is_same(other),
            (Self::OnDisk(own), Self::OnDisk(other)) => own == other,
            _ => false,
        }
    }
}
