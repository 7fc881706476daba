use super::packer::Packer;
use crate::error::{DecodeError, Result};
use crate::space::{Grid, TileIndex};
use crate::tile::format::{read_compact, read_layer_section};
use crate::tile::{Table, Tile};
use std::sync::Arc;

/// Tile in the compact form, with the counts that are needed without decoding.
#[derive(Clone, Debug)]
pub(crate) struct CompactTile {
    /// The table, then the layers.
    bytes: Arc<[u8]>,
    layer_bytes: usize,
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
        let mut bytes = packer.pack(table)?;
        let layers = packer.pack_layers(table)?;
        bytes.extend_from_slice(&layers);
        Ok(Self {
            bytes: bytes.into(),
            layer_bytes: layers.len(),
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
        let voxels = grid.voxels_of_tile(index);
        let (table, layers) = self.parts();
        let decode = || {
            let mut table = read_compact(&mut { table }, table.len() as u64, &voxels)?;
            if !layers.is_empty() {
                table.set_layers(Some(read_layer_section(&mut { layers }, layers.len() as u64, &voxels)?));
            }
            Ok(table)
        };
        decode().map_err(|error: DecodeError| error.in_map("memory".as_ref(), Some(index)))
    }

    /// Table and section of layers, which is empty if there are none.
    pub(crate) fn parts(&self) -> (&[u8], &[u8]) {
        self.bytes.split_at(self.bytes.len() - self.layer_bytes)
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
