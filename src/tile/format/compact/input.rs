use super::CRC_BYTES;
use super::numbers::take_number;
use crate::error::{DecodeError, FormatError};
use std::io::Read;

/// Reads the bytes of a compact table, with the number of bytes left and the checksum.
pub(super) struct Input<R> {
    input: R,
    /// Bytes read so far.
    pub(super) offset: u64,
    /// Bytes before the checksum.
    end: u64,
    crc: crc32fast::Hasher,
}

impl<R: Read> Input<R> {
    /// An input of `bytes` bytes, at least those of a checksum.
    pub(super) fn new(input: R, bytes: u64) -> Self {
        Self { input, offset: 0, end: bytes - CRC_BYTES, crc: crc32fast::Hasher::new() }
    }

    /// An error at the present offset.
    pub(super) fn wrong(&self, reason: impl Into<String>) -> DecodeError {
        FormatError::at_offset(self.offset, reason).into()
    }

    pub(super) fn read(&mut self, bytes: &mut [u8]) -> Result<(), DecodeError> {
        let left = self.end - self.offset;
        if bytes.len() as u64 > left {
            return Err(self.wrong(format!("{} bytes should follow, and {left} do", bytes.len())));
        }
        self.input.read_exact(bytes)?;
        self.crc.update(bytes);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// A number of at most `most`.
    pub(super) fn number(&mut self, what: &str, most: usize) -> Result<usize, DecodeError> {
        let offset = self.offset;
        let mut failed = None;
        let number = take_number(|| {
            let mut byte = [0];
            self.read(&mut byte).map_err(|error| failed = Some(error)).ok().map(|()| byte[0])
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let number = number.and_then(|number| usize::try_from(number).ok()).filter(|&number| number <= most);
        let reason = || format!("the {what} must be a number of at most {most}");
        Ok(number.ok_or_else(|| FormatError::at_offset(offset, reason()))?)
    }

    /// Checks that only the right checksum follows.
    pub(super) fn end(mut self) -> Result<(), DecodeError> {
        if self.offset != self.end {
            return Err(self.wrong(format!("{} bytes stand behind the last voxel", self.end - self.offset)));
        }
        let mut crc = [0; CRC_BYTES as usize];
        self.input.read_exact(&mut crc)?;
        if self.crc.clone().finalize() != u32::from_le_bytes(crc) {
            return Err(self.wrong("the bytes do not match their checksum"));
        }
        Ok(())
    }
}
