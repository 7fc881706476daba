use crate::error::{Error, Result};
use crate::persistence::CompactTile;
use crate::scan::PackedUpdates;
use crate::sensor::SensorModel;
use crate::store::{SpillFile, TileReader, TileVersion};
use crate::tile::Tile;
use std::sync::Arc;

/// State of a tile at some time. It is immutable and cheap to clone.
#[derive(Clone, Debug)]
pub(in crate::mapper) enum TileState {
    /// No observations.
    Nothing,
    /// Ready for use.
    Resident(Arc<Tile>),
    /// To be built from its stored form.
    Stored(StoredTileState),
}

/// Stored form of a tile: a base, and the updates to apply to it.
#[derive(Clone, Debug)]
pub(in crate::mapper) struct StoredTileState {
    pub(in crate::mapper) base: Base,
    /// Updates in the tile's spill file; may be empty.
    pub(in crate::mapper) spilled: SpillFile,
    /// Updates that follow those in the spill file.
    pub(in crate::mapper) updates: Option<Arc<PackedUpdates>>,
}

/// Base of a stored tile.
#[derive(Clone, Debug)]
pub(in crate::mapper) enum Base {
    /// None: the tile consists of updates only.
    Nothing,
    /// The compact form in memory.
    Compact(CompactTile),
    /// A version on disk.
    OnDisk(TileVersion),
    /// A tile folder that is missing from the commit log.
    Orphan,
}

impl TileState {
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
    /// Applies the updates to a tile that was built from the base.
    ///
    /// # Errors
    ///
    /// Fails if a read fails, or if the spill file was removed or has other content than was written.
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
    /// Returns whether both are the same version of the same tile.
    pub(in crate::mapper) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Compact(own), Self::Compact(other)) => own.is_same(other),
            (Self::OnDisk(own), Self::OnDisk(other)) => own == other,
            _ => false,
        }
    }
}
