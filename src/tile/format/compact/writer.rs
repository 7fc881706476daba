use super::codebook::Codebook;
use super::column_writer::ColumnWriter;
use super::columns::put_states;
use super::effort::CompactEffort;
use super::group::{Group, GroupSizes};
use super::group_index::{ENTRY_BYTES, GroupIndex};
use super::header::{HEADER_BYTES, Header};
use super::layer_section::layer_section;
use crate::tile::Table;
use std::fmt;
use std::io::{self, Write};

/// Writer of tables in compact form. It reuses its buffers: 0.7 MB, or 1.7 MB for [`CompactEffort::Small`], and up to
/// 3 MB more after a table in which almost every voxel had a state of its own.
pub struct CompactWriter {
    column_writer: ColumnWriter,
    group: Group,
}

impl CompactWriter {
    /// Creates a writer.
    ///
    /// # Errors
    ///
    /// Returns errors from zstd.
    pub fn new(effort: CompactEffort) -> io::Result<Self> {
        Ok(Self { column_writer: ColumnWriter::new(effort)?, group: Group::default() })
    }

    /// Writes a table in compact form. Returns the number of bytes.
    ///
    /// Equal tables give equal bytes. Writing needs memory for the output, 8 bytes per brick, up to 80 bytes per state
    /// of the palette, and up to 12 MB if some bricks do not use the palette.
    ///
    /// # Errors
    ///
    /// Returns errors from `out` and of zstd.
    pub fn write(&mut self, table: &Table, out: &mut impl Write) -> io::Result<u64> {
        let bytes = self.bytes(table)?;
        out.write_all(&bytes)?;
        Ok(bytes.len() as u64)
    }

    /// Returns the bytes that [`CompactWriter::write`] writes.
    ///
    /// # Errors
    ///
    /// Returns errors from zstd.
    pub fn bytes(&mut self, table: &Table) -> io::Result<Vec<u8>> {
        let Self { column_writer, group } = self;
        let codebook = Codebook::of(table);
        // A failed write may have left bricks in the group.
        group.clear();
        let bricks: Vec<_> = table.bricks_in_order().collect();
        let mut sizes = GroupSizes::default();
        for brick in &bricks {
            sizes.push(brick.observed.iter().map(|word| word.count_ones() as usize).sum());
        }
        let mut out = vec![0; HEADER_BYTES + sizes.groups() * ENTRY_BYTES];
        let codebook_begin = out.len();
        let mut states = Vec::new();
        put_states(codebook.states.iter().copied(), &mut states);
        column_writer.put_columns([&states], &mut out)?;
        let codebook_bytes = &out[codebook_begin..];
        let header = Header {
            voxels: table.len(),
            bricks: bricks.len(),
            states: codebook.states.len(),
            groups: sizes.groups(),
            codebook_bytes: codebook_bytes.len(),
            codebook_crc: crc32fast::hash(codebook_bytes),
        };
        let mut index = GroupIndex::default();
        for brick in bricks {
            group.push(brick, &codebook, &table.palette);
            if group.is_full() {
                index.groups.extend(group.end(column_writer, &mut out)?);
            }
        }
        index.groups.extend(group.end(column_writer, &mut out)?);
        let head = header.to_bytes().into_iter().chain(index.to_bytes());
        out.iter_mut().zip(head).for_each(|(to, from)| *to = from);
        let crc = index.crc_of_all(crc32fast::hash(&out[..codebook_begin]), &header);
        out.extend_from_slice(&crc.to_le_bytes());
        Ok(out)
    }

    /// Returns the section with the table's layers, which follows the table in files; empty if it has none.
    ///
    /// # Errors
    ///
    /// Returns errors from zstd.
    pub fn layer_section(&mut self, table: &Table) -> io::Result<Vec<u8>> {
        table.layers().map_or(Ok(Vec::new()), |layers| layer_section(layers, &mut self.column_writer))
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
/// Returns errors from `out` and of zstd.
pub fn write_compact(table: &Table, effort: CompactEffort, out: &mut impl Write) -> io::Result<u64> {
    CompactWriter::new(effort)?.write(table, out)
}
