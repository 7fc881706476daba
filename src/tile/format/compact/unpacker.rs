use super::input::Input;
use crate::error::{DecodeError, FormatError};
use std::io::{self, Read};
use zstd::zstd_safe::{DCtx, get_error_name};

/// Decompresses the columns of a [`Packer`](super::packer::Packer).
pub(super) struct Unpacker {
    zstd: DCtx<'static>,
    packed: Vec<u8>,
}

/// A column to read.
pub(super) struct Column<'a> {
    pub(super) name: &'static str,
    /// Most bytes of the column.
    pub(super) most: usize,
    /// Receives its bytes.
    pub(super) bytes: &'a mut Vec<u8>,
}

impl Unpacker {
    pub(super) fn new() -> io::Result<Self> {
        // `zstd::bulk` would panic.
        let zstd = DCtx::try_create().ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self { zstd, packed: Vec::new() })
    }

    /// Reads columns; none takes more memory than its limit.
    pub(super) fn take_columns<const N: usize>(
        &mut self,
        columns: [Column<'_>; N],
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        let mut packed_lengths = [0; N];
        let mut columns = columns;
        for (column, packed_length) in columns.iter_mut().zip(&mut packed_lengths) {
            let length = input.number(column.name, column.most)?;
            *packed_length = input.number(column.name, length)?;
            column.bytes.clear();
            column.bytes.resize(length, 0);
        }
        for (column, packed_length) in columns.into_iter().zip(packed_lengths) {
            self.take(column, packed_length, input)?;
        }
        Ok(())
    }

    fn take(
        &mut self,
        column: Column<'_>,
        packed_length: usize,
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        if packed_length == column.bytes.len() {
            return input.read(column.bytes);
        }
        let offset = input.offset;
        self.packed.resize(packed_length, 0);
        input.read(&mut self.packed)?;
        let unpacked = self.zstd.decompress(&mut column.bytes[..], &self.packed);
        let wrong = |reason| Err(FormatError::at_offset(offset, format!("{}: {reason}", column.name)).into());
        match unpacked {
            Ok(length) if length == column.bytes.len() => Ok(()),
            Ok(length) => wrong(format!("{length} bytes where {} are announced", column.bytes.len())),
            Err(code) => wrong(format!("cannot be unpacked: {}", get_error_name(code))),
        }
    }
}
