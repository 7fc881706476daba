use super::effort::CompactEffort;
use super::numbers::put_number;
use std::io;
use zstd::zstd_safe::{CCtx, CParameter, compress_bound, get_error_name};

pub(super) struct ColumnWriter {
    /// One per level.
    zstd: Vec<CCtx<'static>>,
    /// Smallest encoding of a column so far, and the one being tried.
    compressed: [Vec<u8>; 2],
}

/// Columns shorter than this are not compressed.
const MIN_BYTES: usize = 24;

impl ColumnWriter {
    pub(super) fn new(effort: CompactEffort) -> io::Result<Self> {
        let zstd: io::Result<_> = effort.levels().iter().map(|&level| compressor(level)).collect();
        Ok(Self { zstd: zstd?, compressed: Default::default() })
    }

    /// Appends columns: first each column's length and stored length, then their bytes. A column that does not become
    /// smaller is stored uncompressed.
    pub(super) fn put_columns<const N: usize>(
        &mut self,
        columns: [&[u8]; N],
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        let mut written = Vec::new();
        for column in columns {
            let compressed = self.compress(column)?;
            put_number(column.len() as u64, out);
            put_number(compressed.len() as u64, out);
            written.extend_from_slice(compressed);
        }
        out.extend_from_slice(&written);
        Ok(())
    }

    fn compress<'a>(&'a mut self, column: &'a [u8]) -> io::Result<&'a [u8]> {
        if column.len() < MIN_BYTES {
            return Ok(column);
        }
        let bound = compress_bound(column.len());
        let mut least = column.len();
        for zstd in &mut self.zstd {
            let [best, other] = &mut self.compressed;
            if other.len() < bound {
                other.resize(bound, 0);
            }
            let length = zstd.compress2(&mut other[..bound], column).map_err(refused)?;
            if length < least {
                least = length;
                std::mem::swap(best, other);
            }
        }
        Ok(if least < column.len() { &self.compressed[0][..least] } else { column })
    }
}

/// Creates a compressor that omits headers and checksums.
fn compressor(level: i32) -> io::Result<CCtx<'static>> {
    // `zstd::bulk` would panic if this fails.
    let mut zstd = CCtx::try_create().ok_or(io::ErrorKind::OutOfMemory)?;
    for parameter in [
        CParameter::CompressionLevel(level),
        CParameter::ChecksumFlag(false),
        CParameter::ContentSizeFlag(false),
        CParameter::DictIdFlag(false),
    ] {
        zstd.set_parameter(parameter).map_err(refused)?;
    }
    Ok(zstd)
}

/// Converts an error of zstd, which most likely means that memory is exhausted.
fn refused(code: usize) -> io::Error {
    io::Error::other(get_error_name(code))
}
