use super::input::Input;
use crate::error::{DecodeError, FormatError};
use std::io::{self, Read};
use zstd::zstd_safe::{DCtx, get_error_name};

/// Decompresses the columns of a [`ColumnWriter`](super::column_writer::ColumnWriter).
pub(super) struct ColumnReader {
    zstd: DCtx<'static>,
    compressed: Vec<u8>,
}

pub(super) struct Column<'a> {
    pub(super) name: &'static str,
    /// Maximum size of the column in bytes.
    pub(super) max_bytes: usize,
    /// Receives the decompressed bytes.
    pub(super) bytes: &'a mut Vec<u8>,
}

impl ColumnReader {
    pub(super) fn new() -> io::Result<Self> {
        // `zstd::bulk` would panic if this fails.
        let zstd = DCtx::try_create().ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self { zstd, compressed: Vec::new() })
    }

    /// Reads columns; none takes more memory than its limit.
    pub(super) fn take_columns<const N: usize>(
        &mut self,
        columns: [Column<'_>; N],
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        let mut compressed_lengths = [0; N];
        let mut columns = columns;
        for (column, compressed_length) in columns.iter_mut().zip(&mut compressed_lengths) {
            let length = input.number(column.name, column.max_bytes)?;
            *compressed_length = input.number(column.name, length)?;
            column.bytes.clear();
            column.bytes.resize(length, 0);
        }
        for (column, compressed_length) in columns.into_iter().zip(compressed_lengths) {
            self.take(column, compressed_length, input)?;
        }
        Ok(())
    }

    fn take(
        &mut self,
        column: Column<'_>,
        compressed_length: usize,
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        if compressed_length == column.bytes.len() {
            return input.read(column.bytes);
        }
        let offset = input.offset;
        self.compressed.resize(compressed_length, 0);
        input.read(&mut self.compressed)?;
        let decompressed = self.zstd.decompress(&mut column.bytes[..], &self.compressed);
        let wrong = |reason| Err(FormatError::at_offset(offset, format!("{}: {reason}", column.name)).into());
        match decompressed {
            Ok(length) if length == column.bytes.len() => Ok(()),
            Ok(length) => wrong(format!("{length} bytes instead of {}", column.bytes.len())),
            Err(code) => wrong(format!("cannot be decompressed: {}", get_error_name(code))),
        }
    }
}
