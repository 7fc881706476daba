//! Files of tables with another trailer: the same table in another map, of which no entry is decoded.

use super::compact_file::read_compact_front;
use super::reader::read_header;
use super::trailer::Trailer;
use super::{ENTRY_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use std::io::{self, Read, Write};

/// Copies an `iwlo_meta.bin` of `file_bytes` bytes with what `renew` makes of its trailer. Its entries are not checked.
///
/// # Errors
///
/// A header or trailer that violates the format, a file without a trailer, and those of both streams.
pub fn renew_table(
    input: &mut impl Read,
    file_bytes: u64,
    renew: impl FnOnce(Trailer) -> Trailer,
    out: &mut (impl Write + ?Sized),
) -> Result<(), DecodeError> {
    let (count, trailer_bytes) = read_header(input, file_bytes, &mut crc32fast::Hasher::new())?;
    if trailer_bytes == 0 {
        return Err(FormatError::at_offset(file_bytes, "the trailer after the last entry is missing").into());
    }
    out.write_all(&MAGIC.to_le_bytes())?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&count.to_le_bytes())?;
    let entries_bytes = count * ENTRY_BYTES;
    if io::copy(&mut input.take(entries_bytes), out)? < entries_bytes {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    let trailer = Trailer::read(input, HEADER_BYTES + entries_bytes, trailer_bytes)?;
    out.write_all(&renew(trailer).to_bytes())?;
    Ok(())
}

/// Copies a `tile.vxt` of `file_bytes` bytes with what `renew` makes of its front part. The table is not checked.
///
/// # Errors
///
/// A front part that violates the format, and those of both streams.
pub fn renew_compact_file(
    input: &mut impl Read,
    file_bytes: u64,
    renew: impl FnOnce(Trailer) -> Trailer,
    out: &mut (impl Write + ?Sized),
) -> Result<(), DecodeError> {
    let front = read_compact_front(input, file_bytes)?;
    out.write_all(&renew(front).to_bytes())?;
    io::copy(input, out)?;
    Ok(())
}
