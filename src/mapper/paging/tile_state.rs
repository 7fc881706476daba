use crate::error::{Error, Result};
use crate::persistence::CompactTile;
use crate::scan::PackedUpdates;
use crate::sensor::SensorModel;
use crate::store::{SpillFile, TileReader, TileVersion};
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

impl StoredTileState {
    /// Applies the updates to a tile that was made of the base.
    ///
    /// # Errors
    ///
    /// A disk that refuses; a spill file that is not what was written, or was removed.
    pub(in crate::mapper) fn apply_updates(
        &self,
        tile: &mut Tile,
        files: &TileReader,
        model: &SensorModel,
    ) -> Result<()> {
        if self.spilled.bytes > 0 {
            let input = files.open_spill(tile.index(), self.spilled)?;
            PackedUpdates::unpack(input, |updates| tile.apply(model, &updates))
                .map_err(|error| Error::io(files.folder(), "read buffered updates in", error))?;
        }
        self.updates
            .iter()
            .flat_map(|updates| updates.iter())
            .for_each(|updates| tile.apply(model, &updates));
        Ok(())
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
