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
        let failed = |error| Error::io("memory".as_ref(), "pack a tile in", error);
        let writer = match &mut self.0 {
            Some(writer) => writer,
            none => none.insert(CompactWriter::new(CompactEffort::Fast).map_err(failed)?),
        };
        writer.bytes(table).map_err(failed)
    }
}
