use super::codebook::Codebook;
use super::columns::put_states;
use super::effort::CompactEffort;
use super::group::Group;
use super::packer::Packer;
use super::{CRC_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::tile::Table;
use std::io::{self, Write};

/// Streams a table in its compact form, and returns the number of bytes.
///
/// Equal tables give equal bytes, whatever way they came about. Besides the table it takes 0.5 MB of memory and 8 bytes
/// a state of the palette, whatever the size of the table; where some bricks do without the palette, up to 4 MB.
///
/// # Errors
///
/// Those of `out`.
pub fn write_compact(table: &Table, effort: CompactEffort, out: &mut impl Write) -> io::Result<u64> {
    let codebook = Codebook::of(table);
    let mut packer = Packer::new(effort)?;
    let mut crc = crc32fast::Hasher::new();
    let mut bytes = 0;
    let mut write = |part: &[u8]| {
        crc.update(part);
        bytes += part.len() as u64;
        out.write_all(part)
    };
    let mut part = header(table, &codebook).to_vec();
    let mut states = Vec::new();
    put_states(codebook.states.iter().copied(), &mut states);
    packer.put_columns([&states], &mut part)?;
    write(&part)?;

    let mut group = Group::default();
    let mut end = |group: &mut Group| {
        part.clear();
        group.end(&mut packer, &mut part)?;
        write(&part)
    };
    for brick in table.bricks_in_order() {
        group.push(brick, &codebook, &table.palette);
        if group.is_full() {
            end(&mut group)?;
        }
    }
    if !group.is_empty() {
        end(&mut group)?;
    }
    out.write_all(&crc.finalize().to_le_bytes())?;
    Ok(bytes + CRC_BYTES)
}

fn header(table: &Table, codebook: &Codebook) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[0..4].copy_from_slice(&MAGIC.to_le_bytes());
    header[4..8].copy_from_slice(&VERSION.to_le_bytes());
    header[8..16].copy_from_slice(&(table.len() as u64).to_le_bytes());
    // A tile has 2^21.1 bricks at most.
    header[16..20].copy_from_slice(&(table.bricks.len() as u32).to_le_bytes());
    header[20..24].copy_from_slice(&(codebook.states.len() as u32).to_le_bytes());
    header
}
