use crate::error::{Error, Result};
use crate::tile::Table;
use crate::tile::format::{CompactEffort, CompactWriter};

/// Encoder of tables in the compact form. Its buffers are allocated with the first table and reused, because allocation
/// takes longer than encoding a small tile.
#[derive(Debug, Default)]
pub(crate) struct Packer(Option<CompactWriter>);

impl Packer {
    /// Encodes a table.
    ///
    /// # Errors
    ///
    /// Out of memory.
    pub(crate) fn pack(&mut self, table: &Table) -> Result<Vec<u8>> {
        self.writer()?.bytes(table).map_err(failed)
    }

    /// Encodes the layers of a table; empty if it has none.
    ///
    /// # Errors
    ///
    /// Out of memory.
    pub(crate) fn pack_layers(&mut self, table: &Table) -> Result<Vec<u8>> {
        self.writer()?.layer_section(table).map_err(failed)
    }

    fn writer(&mut self) -> Result<&mut CompactWriter> {
        match &mut self.0 {
            Some(writer) => Ok(writer),
            none => Ok(none.insert(CompactWriter::new(CompactEffort::Fast).map_err(failed)?)),
        }
    }
}

fn failed(error: std::io::Error) -> Error {
    Error::io("memory".as_ref(), "pack a tile in", error)
}
