//! Copies of table files with another trailer, for the same table in another map; entries are not decoded.

use super::compact_file::read_compact_front;
use super::reader::read_header;
use super::trailer::Trailer;
use super::{ENTRY_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use std::io::{self, Read, Write};

/// Copies an `iwlo_meta.bin` of `file_bytes` bytes and replaces its trailer by the result of `renew`. Its entries are
/// not checked.
///
/// # Errors
///
/// Fails if the header or trailer violates the format or the trailer is missing. Returns errors from both streams.
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
    // The layers, if there are any.
    io::copy(input, out)?;
    Ok(())
}

/// Copies a `tile.vxt` of `file_bytes` bytes and replaces its front part by the result of `renew`. The table is not
/// checked.
///
/// # Errors
///
/// Fails if the front part violates the format. Returns errors from both streams.
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
