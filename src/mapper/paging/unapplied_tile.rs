use super::tile_state::{Base, StoredTileState};
use crate::config::MapConfig;
use crate::error::{FormatError, Result};
use crate::persistence::load::read_stored_table;
use crate::space::TileIndex;
use crate::store::{TileLocation, TileReader};
use crate::tile::{Table, Tile};

/// Tile that is not resident, as of a background flush. The flush builds it from its stored form and its buffered
/// updates.
pub(super) struct UnappliedTile {
    pub(super) index: TileIndex,
    pub(super) state: StoredTileState,
    /// Location of the version on disk, if that is the base.
    pub(super) location: Option<TileLocation>,
}

impl UnappliedTile {
    /// Approximate bytes of memory in addition to [`bytes`](Self::bytes): its location contains a folder and a file
    /// name.
    pub(super) const OWN_BYTES: usize = size_of::<Self>() + 2 * 96;

    /// Builds the tile.
    ///
    /// # Errors
    ///
    /// Fails if the tile is damaged or a read fails.
    pub(super) fn make(&self, files: &TileReader, config: &MapConfig) -> Result<Tile> {
        let (grid, index) = (&config.grid, self.index);
        let table = match (&self.state.base, &self.location) {
            (Base::Compact(tile), _) => tile.decode(grid, index)?,
            (_, Some(location)) => read_stored_table(grid, index, location.clone().open()?)?.table,
            (Base::Orphan, _) => {
                let reason = "commits.log has no entry for this tile";
                return Err(FormatError::at_offset(0, reason).in_map(files.folder(), Some(index)));
            }
            (_, None) => Table::default(),
        };
        let mut tile = Tile::uncached(grid, index, table);
        self.state.apply_updates(&mut tile, files, &config.sensor_model)?;
        Ok(tile)
    }

    /// Bytes of memory of the compact form and the updates. Other owners may release these while the flush holds them.
    pub(super) fn bytes(&self) -> usize {
        let base = if let Base::Compact(tile) = &self.state.base { tile.bytes().len() } else { 0 };
        base + self.state.updates.as_ref().map_or(0, |updates| updates.bytes())
    }

    /// Length of the file to read, if the base is on disk.
    pub(super) fn bytes_on_disk(&self) -> Option<u64> {
        match (&self.state.base, &self.location) {
            (Base::OnDisk(version), Some(_)) => Some(version.table.bytes),
            _ => None,
        }
    }
}
