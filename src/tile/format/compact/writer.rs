use super::codebook::Codebook;
use super::column_writer::ColumnWriter;
use super::columns::put_states;
use super::effort::CompactEffort;
use super::group::Group;
use super::{CRC_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::tile::Table;
use std::fmt;
use std::io::{self, Write};

/// Writes tables in compact form. Its buffers are kept from table to table: 0.7 MB, or 1.7 MB for
/// [`CompactEffort::Small`], and up to 3 MB more after a table in which hardly two voxels were in one state.
pub struct CompactWriter {
    column_writer: ColumnWriter,
    group: Group,
    part: Vec<u8>,
}

impl CompactWriter {
    /// A writer of this effort.
    ///
    /// # Errors
    ///
    /// Those of zstd.
    pub fn new(effort: CompactEffort) -> io::Result<Self> {
        Ok(Self { column_writer: ColumnWriter::new(effort)?, group: Group::default(), part: Vec::new() })
    }

    /// Streams a table in compact form. Returns the number of bytes.
    ///
    /// Equal tables give equal bytes. Writing takes up to 80 bytes of memory per state of the palette, and up to 12 MB
    /// if some bricks do not use the palette.
    ///
    /// # Errors
    ///
    /// Those of `out` and of zstd.
    pub fn write(&mut self, table: &Table, out: &mut impl Write) -> io::Result<u64> {
        let Self { column_writer, group, part } = self;
        let codebook = Codebook::of(table);
        let mut crc = crc32fast::Hasher::new();
        let mut bytes = 0;
        let mut write = |part: &mut Vec<u8>| {
            crc.update(part);
            bytes += part.len() as u64;
            let written = out.write_all(part);
            part.clear();
            written
        };
        // A failed write may have left something behind.
        part.clear();
        group.begin();
        part.extend_from_slice(&header(table, &codebook));
        let mut states = Vec::new();
        put_states(codebook.states.iter().copied(), &mut states);
        column_writer.put_columns([&states], part)?;
        write(part)?;
        for brick in table.bricks_in_order() {
            group.push(brick, &codebook, &table.palette);
            if group.is_full() {
                group.end(column_writer, part)?;
                write(part)?;
            }
        }
        if !group.is_empty() {
            group.end(column_writer, part)?;
            write(part)?;
        }
        out.write_all(&crc.finalize().to_le_bytes())?;
        Ok(bytes + CRC_BYTES)
    }
}

impl fmt::Debug for CompactWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CompactWriter").finish_non_exhaustive()
    }
}

/// Writes one table, see [`CompactWriter::write`].
///
/// # Errors
///
/// Those of `out` and of zstd.
pub fn write_compact(table: &Table, effort: CompactEffort, out: &mut impl Write) -> io::Result<u64> {
    CompactWriter::new(effort)?.write(table, out)
}

fn header(table: &Table, codebook: &Codebook) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[0..4].copy_from_slice(&MAGIC.to_le_bytes());
    header[4..8].copy_from_slice(&VERSION.to_le_bytes());
    header[8..16].copy_from_slice(&(table.len() as u64).to_le_bytes());
    // A tile has at most 2^21.1 bricks.
    header[16..20].copy_from_slice(&(table.bricks.len() as u32).to_le_bytes());
    header[20..24].copy_from_slice(&(codebook.states.len() as u32).to_le_bytes());
    header
}
