use super::packer::Packer;
use crate::error::Result;
use crate::space::{Grid, TileIndex};
use crate::tile::format::read_compact;
use crate::tile::{Table, Tile};
use std::sync::Arc;

/// Tile in the compact form, with the counts that are needed without decoding.
#[derive(Clone, Debug)]
pub(crate) struct CompactTile {
    bytes: Arc<[u8]>,
    voxels: u64,
    /// Number of occupied voxels, if the map stores tiles in the compact form.
    occupied: Option<u64>,
    /// Memory of the source table in bytes.
    table_bytes: usize,
}

impl CompactTile {
    /// Encodes a tile. If the map stores tiles in this form, also counts voxels with log-odds of at least
    /// `occupied_from`.
    ///
    /// # Errors
    ///
    /// Out of memory.
    pub(crate) fn encode(packer: &mut Packer, tile: &Tile, occupied_from: Option<f64>) -> Result<Self> {
        let table = tile.table();
        Ok(Self {
            bytes: packer.pack(table)?.into(),
            voxels: table.len() as u64,
            occupied: occupied_from.map(|log_odds| table.count_from(log_odds) as u64),
            table_bytes: table.bytes(),
        })
    }

    /// Decodes the table. `index` must be the index of the tile.
    ///
    /// # Errors
    ///
    /// [`Damaged`](crate::Error::Damaged) if the bytes in memory changed.
    pub(crate) fn decode(&self, grid: &Grid, index: TileIndex) -> Result<Table> {
        read_compact(&mut &*self.bytes, self.bytes.len() as u64, &grid.voxels_of_tile(index))
            .map_err(|error| error.in_map("memory".as_ref(), Some(index)))
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(crate) fn voxels(&self) -> u64 {
        self.voxels
    }

    /// Number of occupied voxels, if the map stores tiles in this form.
    pub(crate) fn occupied(&self) -> Option<u64> {
        self.occupied
    }

    /// Additional memory for saving the tile in bytes. A map that stores full tables must decode the tile.
    pub(crate) fn bytes_to_save(&self) -> usize {
        if self.occupied.is_some() { 0 } else { self.table_bytes }
    }

    /// Returns whether both share the same memory, not only equal content.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bytes, &other.bytes)
    }
}
