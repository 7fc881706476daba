//! `tile.vxt`: a trailer like that of `iwlo_meta.bin`, in front, and behind it the table in the compact form without its
//! last four bytes, the checksum, which stands in front too. In front it tells what the file is and where the compact form
//! begins and ends; and because no checksum follows what it is of, that of the whole file depends on the content.

use super::compact::{CRC_BYTES, read_compact};
use super::reader::DecodedTable;
use super::trailer::Trailer;
use crate::error::{DecodeError, FormatError};
use crate::space::VoxelBox;
use std::io::{self, BufReader, Read, Write};

/// Writes a table in the compact form as `tile.vxt`. The checksum in `front.table_crc` is that of the compact form; what
/// the caller put there is ignored. There is no octree.
///
/// # Errors
///
/// Those of `out`, and bytes that are too few for a compact form.
pub fn write_compact_file(compact: &[u8], front: Trailer, out: &mut impl Write) -> io::Result<()> {
    let Some((body, crc)) = compact.split_last_chunk::<{ CRC_BYTES as usize }>() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "no table in the compact form"));
    };
    let front = Trailer { table_crc: u32::from_le_bytes(*crc), octree_crc: 0, octree_bytes: 0, ..front };
    out.write_all(&front.to_bytes())?;
    out.write_all(body)
}

/// Reads a `tile.vxt` of `file_bytes` bytes that belongs to the tile of `voxels`.
///
/// # Errors
///
/// Anything that is not as the format says, with its offset.
pub fn read_compact_file(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
) -> Result<DecodedTable, DecodeError> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    let front = read_compact_front(&mut input, file_bytes)?;
    let body_bytes = file_bytes - front.bytes();
    let crc = front.table_crc.to_le_bytes();
    let mut compact = input.take(body_bytes).chain(&crc[..]);
    let table = read_compact(&mut compact, body_bytes + CRC_BYTES, voxels)
        .map_err(|error| error.further_by(front.bytes()))?;
    Ok(DecodedTable { table, trailer: Some(front) })
}

/// Reads only what stands in front in a `tile.vxt`.
///
/// # Errors
///
/// What is not as the format says.
pub fn read_compact_front(input: &mut impl Read, file_bytes: u64) -> Result<Trailer, DecodeError> {
    let front = Trailer::read_in_front(input, file_bytes)?;
    if (front.octree_crc, front.octree_bytes) != (0, 0) {
        return Err(FormatError::at_offset(48, "an octree is named, and compact tiles have none").into());
    }
    Ok(front)
}
