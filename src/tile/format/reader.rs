use super::any_order_entries::AnyOrderEntries;
use super::ascending_entries::AscendingEntries;
use super::compact::read_layer_section;
use super::gather::{FilteredVoxels, Gather, VoxelFilter};
use super::trailer::Trailer;
use super::{ENTRY_BYTES, EntryBytes, HEADER_BYTES, MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use crate::space::VoxelBox;
use crate::tile::Table;
use std::io::{self, Read};

/// Decoder of entries.
pub(super) trait TakeEntries {
    /// Type of the result.
    type Made;

    /// Takes the next entries, which start at `offset` in the file.
    fn take(&mut self, entries: &[EntryBytes], offset: u64) -> Result<(), FormatError>;

    /// Returns the result for all entries.
    fn end(self) -> Result<Self::Made, FormatError>;
}

/// Content of an `iwlo_meta.bin` or a `tile.vxt`.
#[derive(Debug)]
pub struct Decoded<T> {
    /// The exact table, or a value derived from it.
    pub table: T,
    /// The trailer; `None` for a file of the original format, which cannot be verified.
    pub trailer: Option<Trailer>,
}

/// Exact table and trailer of a tile.
pub type DecodedTable = Decoded<Table>;

/// Reads an `iwlo_meta.bin` of `file_bytes` bytes that belongs to the tile of `voxels`.
///
/// With a trailer, entries must be in Morton order and the checksum must match. Without one, any order is accepted.
///
/// # Errors
///
/// Fails if the file violates the format; the error contains the offset. Examples are a wrong magic or version, a count
/// that does not match the length, keys of another tile, duplicate keys, invalid evidence, a wrong checksum.
pub fn read_table(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
) -> Result<DecodedTable, DecodeError> {
    let (mut decoded, layer_bytes) = read_made(input, file_bytes, voxels, Table::default())?;
    read_layers(&mut decoded.table, input, file_bytes, layer_bytes, voxels)?;
    Ok(decoded)
}

/// Reads the observed voxels of an `iwlo_meta.bin` whose log-odds are at least `from`, in Morton order, without
/// building a table if the entries are in order.
///
/// # Errors
///
/// Same errors as [`read_table`].
pub fn read_voxels_from(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
    from: f64,
) -> Result<Decoded<FilteredVoxels>, DecodeError> {
    let (decoded, layer_bytes) = read_made(input, file_bytes, voxels, VoxelFilter::from(from))?;
    skip(input, layer_bytes)?;
    Ok(decoded)
}

/// Reads the layers in the last `bytes` bytes of a file, if there are any.
pub(super) fn read_layers(
    table: &mut Table,
    input: &mut impl Read,
    file_bytes: u64,
    bytes: u64,
    voxels: &VoxelBox,
) -> Result<(), DecodeError> {
    if bytes > 0 {
        let layers = read_layer_section(input, bytes, voxels);
        table.set_layers(Some(layers.map_err(|error| error.further_by(file_bytes - bytes))?));
    }
    Ok(())
}

/// Reads the next bytes without using them; the checksum of the file covers them.
pub(super) fn skip(input: &mut impl Read, bytes: u64) -> io::Result<()> {
    match io::copy(&mut input.take(bytes), &mut io::sink())? == bytes {
        true => Ok(()),
        false => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}

/// Reads table and trailer; also returns the number of bytes that follow.
fn read_made<G: Gather>(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
    gather: G,
) -> Result<(Decoded<G::Made>, u64), DecodeError> {
    let mut crc = crc32fast::Hasher::new();
    let (count, trailer_bytes) = read_header(input, file_bytes, &mut crc)?;
    if trailer_bytes == 0 {
        let table = read_entries(input, count, &mut crc, AnyOrderEntries::new(voxels))?;
        return Ok((Decoded { table: gather.of_table(table), trailer: None }, 0));
    }
    let table = read_entries(input, count, &mut crc, AscendingEntries::new(voxels, gather))?;
    let trailer = Trailer::read(input, HEADER_BYTES + count * ENTRY_BYTES, trailer_bytes)?;
    if trailer.table_crc != crc.finalize() {
        return Err(FormatError::at_offset(0, "the entries do not match the checksum in the trailer").into());
    }
    let layer_bytes = trailer_bytes - trailer.bytes();
    Ok((Decoded { table, trailer: Some(trailer) }, layer_bytes))
}

fn read_entries<E: TakeEntries>(
    input: &mut impl Read,
    count: u64,
    crc: &mut crc32fast::Hasher,
    mut entries: E,
) -> Result<E::Made, DecodeError> {
    let mut chunk = vec![0; 4096 * ENTRY_BYTES as usize];
    let mut done = 0;
    while done < count {
        let entries_here = (count - done).min(4096);
        let bytes = &mut chunk[..(entries_here * ENTRY_BYTES) as usize];
        input.read_exact(bytes)?;
        crc.update(bytes);
        entries.take(bytes.as_chunks().0, HEADER_BYTES + done * ENTRY_BYTES)?;
        done += entries_here;
    }
    Ok(entries.end()?)
}

/// Reads only the trailer of an `iwlo_meta.bin`, skipping the entries; `None` for a file of the original format.
///
/// # Errors
///
/// Fails if the header or the trailer violates the format.
pub fn read_trailer(input: &mut impl Read, file_bytes: u64) -> Result<Option<Trailer>, DecodeError> {
    let (count, trailer_bytes) = read_header(input, file_bytes, &mut crc32fast::Hasher::new())?;
    if trailer_bytes == 0 {
        return Ok(None);
    }
    io::copy(&mut input.take(count * ENTRY_BYTES), &mut io::sink())?;
    Trailer::read(input, HEADER_BYTES + count * ENTRY_BYTES, trailer_bytes).map(Some)
}

/// Reads the count of entries, checked against the length of the file, and the number of bytes that follow them.
pub(super) fn read_header(
    input: &mut impl Read,
    file_bytes: u64,
    crc: &mut crc32fast::Hasher,
) -> Result<(u64, u64), DecodeError> {
    let wrong = |offset, reason: String| Err(FormatError::at_offset(offset, reason).into());
    if file_bytes < HEADER_BYTES {
        return wrong(0, format!("{file_bytes} bytes are too few for the header of {HEADER_BYTES}"));
    }
    let mut header = [0; HEADER_BYTES as usize];
    input.read_exact(&mut header)?;
    crc.update(&header);
    let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
    if u32_at(0) != MAGIC {
        return wrong(0, format!("the magic number is {:#010x}, not {MAGIC:#010x}", u32_at(0)));
    }
    if u32_at(4) != VERSION {
        return wrong(4, format!("version {} is not known; this program reads version {VERSION}", u32_at(4)));
    }
    let count = u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32;
    let after_header = file_bytes - HEADER_BYTES;
    let Some(after_entries) =
        count.checked_mul(ENTRY_BYTES).and_then(|bytes| after_header.checked_sub(bytes))
    else {
        return wrong(8, format!("a count of {count} entries does not fit into {file_bytes} bytes"));
    };
    Ok((count, after_entries))
}
