use crate::error::{DecodeError, FormatError};
use std::io::{BufRead, ErrorKind};

/// Stream that tracks its offset for errors.
pub(super) struct Input<R> {
    reader: R,
    offset: u64,
}

impl<R: BufRead> Input<R> {
    pub(super) fn new(reader: R) -> Self {
        Self { reader, offset: 0 }
    }

    /// Number of bytes consumed so far.
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// Returns the next byte without consuming it; `None` at the end.
    pub(super) fn peek(&mut self) -> Result<Option<u8>, DecodeError> {
        loop {
            match self.reader.fill_buf() {
                Ok(bytes) => return Ok(bytes.first().copied()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Consumes the next byte; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<u8>, DecodeError> {
        let byte = self.peek()?;
        if byte.is_some() {
            self.reader.consume(1);
            self.offset += 1;
        }
        Ok(byte)
    }

    /// Consumes exactly `N` bytes; `part` names the part of the file in errors.
    pub(super) fn take<const N: usize>(&mut self, part: &str) -> Result<[u8; N], DecodeError> {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => self.error(format!("the file ends where {part} should be")).into(),
            _ => DecodeError::Io(error),
        })?;
        self.offset += N as u64;
        Ok(bytes)
    }

    /// Creates an error at the current offset.
    pub(super) fn error(&self, reason: impl Into<String>) -> FormatError {
        FormatError::at_offset(self.offset, reason)
    }
}
