use crate::error::{Error, Result};
use crate::space::{Grid, TileIndex};
use crate::tile::format::{CompactWriter, read_compact};
use crate::tile::{Table, Tile};
use std::sync::Arc;

/// A tile in the compact form, and what is known of it without decoding.
#[derive(Clone, Debug)]
pub(crate) struct CompactTile {
    bytes: Arc<[u8]>,
    voxels: u64,
    /// Occupied voxels, where the map stores tiles in the compact form.
    occupied: Option<u64>,
    /// Bytes of memory of the table that it was made of.
    table_bytes: usize,
}

impl CompactTile {
    /// Encodes a tile. Where the map stores tiles in this form, voxels from `occupied_from` log-odds on are counted.
    ///
    /// # Errors
    ///
    /// A lack of memory.
    pub(crate) fn encode(
        writer: &mut CompactWriter,
        tile: &Tile,
        occupied_from: Option<f64>,
    ) -> Result<Self> {
        let (table, mut bytes) = (tile.table(), Vec::new());
        writer
            .write(table, &mut bytes)
            .map_err(|error| Error::io("memory".as_ref(), "pack a tile in", error))?;
        Ok(Self {
            bytes: bytes.into(),
            voxels: table.len() as u64,
            occupied: occupied_from.map(|log_odds| table.count_from(log_odds) as u64),
            table_bytes: table.bytes(),
        })
    }

    /// Decodes the table of the tile with this index.
    ///
    /// # Errors
    ///
    /// None but for broken memory.
    pub(crate) fn decode(&self, grid: &Grid, index: TileIndex) -> Result<Table> {
        read_compact(&mut &*self.bytes, self.bytes.len() as u64, &grid.voxels_of_tile(index))
            .map_err(|error| error.in_map("memory".as_ref(), Some(index)))
    }

    /// The encoded bytes.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Number of voxels.
    pub(crate) fn voxels(&self) -> u64 {
        self.voxels
    }

    /// Number of occupied voxels, where the map stores tiles in this form.
    pub(crate) fn occupied(&self) -> Option<u64> {
        self.occupied
    }

    /// Bytes of memory that saving takes beside the tile's own: a map that stores full tables has to decode it.
    pub(crate) fn bytes_to_save(&self) -> usize {
        if self.occupied.is_some() { 0 } else { self.table_bytes }
    }

    /// Whether both are the same encoding in memory, not only equal ones.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bytes, &other.bytes)
    }
}
