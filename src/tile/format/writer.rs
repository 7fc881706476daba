use super::entries::encode_entries;
use super::trailer::Trailer;
use super::{HEADER_BYTES, MAGIC, VERSION};
use crate::tile::Table;
use std::io::{self, Write};

/// Checksum and size of a written table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableChecksums {
    /// CRC-32 of header and entries.
    pub table_crc: u32,
    /// Number of bytes written, including the trailer.
    pub bytes: u64,
}

/// Writes a table as the stream `iwlo_meta.bin`, with the section of its layers
/// ([`CompactWriter::layer_section`](super::CompactWriter::layer_section)). The checksum `trailer.table_crc` is computed
/// here; the given value is ignored.
pub fn write_table(
    table: &Table,
    layers: &[u8],
    trailer: Trailer,
    out: &mut impl Write,
) -> io::Result<TableChecksums> {
    let mut crc = crc32fast::Hasher::new();
    let mut bytes = 0;
    let mut write = |chunk: &[u8]| {
        crc.update(chunk);
        bytes += chunk.len() as u64;
        out.write_all(chunk)
    };
    let mut header = [0; HEADER_BYTES as usize];
    header[0..4].copy_from_slice(&MAGIC.to_le_bytes());
    header[4..8].copy_from_slice(&VERSION.to_le_bytes());
    header[8..16].copy_from_slice(&(table.len() as u64).to_le_bytes());
    write(&header)?;
    encode_entries(table, write)?;
    let table_crc = crc.finalize();
    let trailer = Trailer { table_crc, ..trailer }.to_bytes();
    out.write_all(&trailer)?;
    out.write_all(layers)?;
    Ok(TableChecksums { table_crc, bytes: bytes + (trailer.len() + layers.len()) as u64 })
}
