use super::CRC_BYTES;
use super::group_index::joined_crc;
use super::header::HEADER_1_BYTES;
use super::numbers::take_number;
use crate::error::{DecodeError, FormatError};
use std::io::Read;

/// Reader for the bytes of a compact table. It tracks the number of bytes left and the checksum.
pub(super) struct Input<R> {
    input: R,
    /// Number of bytes read so far.
    pub(super) offset: u64,
    /// Number of bytes before the checksum.
    end: u64,
    /// Checksum of the current part.
    crc: crc32fast::Hasher,
    /// Offset of the current part.
    part: u64,
    /// Checksum of all earlier parts.
    crc_before: u32,
}

impl<R: Read> Input<R> {
    /// Creates an input of `bytes` bytes, which must include a checksum.
    pub(super) fn new(input: R, bytes: u64) -> Self {
        Self {
            input,
            offset: 0,
            end: bytes - CRC_BYTES,
            crc: crc32fast::Hasher::new(),
            part: 0,
            crc_before: 0,
        }
    }

    pub(super) fn of_table(input: R, bytes: u64) -> Result<Self, FormatError> {
        if bytes < HEADER_1_BYTES as u64 + CRC_BYTES {
            let reason = format!("{bytes} bytes are too few for a compact table");
            return Err(FormatError::at_offset(0, reason));
        }
        Ok(Self::new(input, bytes))
    }

    /// Number of unread bytes before the checksum.
    pub(super) fn left(&self) -> u64 {
        self.end - self.offset
    }

    /// Ends a part and returns its checksum.
    pub(super) fn end_part(&mut self) -> u32 {
        let crc = std::mem::take(&mut self.crc).finalize();
        self.crc_before = joined_crc(self.crc_before, crc, self.offset - self.part);
        self.part = self.offset;
        crc
    }

    /// Ends a part, which must have the given length and checksum.
    pub(super) fn end_part_as(&mut self, what: &str, bytes: u64, crc: u32) -> Result<(), DecodeError> {
        let (begin, found) = (self.part, self.offset - self.part);
        let wrong = |reason| Err(FormatError::at_offset(begin, reason).into());
        if found != bytes {
            return wrong(format!("the {what} has {found} bytes instead of {bytes}"));
        }
        match self.end_part() == crc {
            true => Ok(()),
            false => wrong(format!("the {what} does not match its checksum")),
        }
    }

    pub(super) fn wrong(&self, reason: impl Into<String>) -> DecodeError {
        FormatError::at_offset(self.offset, reason).into()
    }

    pub(super) fn read(&mut self, bytes: &mut [u8]) -> Result<(), DecodeError> {
        let left = self.left();
        if bytes.len() as u64 > left {
            return Err(self.wrong(format!("{} bytes are expected, but only {left} follow", bytes.len())));
        }
        self.input.read_exact(bytes)?;
        self.crc.update(bytes);
        self.offset += bytes.len() as u64;
        Ok(())
    }

    /// Reads a number of at most `max`.
    pub(super) fn number(&mut self, what: &str, max: usize) -> Result<usize, DecodeError> {
        let offset = self.offset;
        let mut failed = None;
        let number = take_number(|| {
            let mut byte = [0];
            self.read(&mut byte).map_err(|error| failed = Some(error)).ok().map(|()| byte[0])
        });
        if let Some(error) = failed {
            return Err(error);
        }
        let number = number.and_then(|number| usize::try_from(number).ok()).filter(|&number| number <= max);
        let reason = || format!("the {what} must be a number of at most {max}");
        Ok(number.ok_or_else(|| FormatError::at_offset(offset, reason()))?)
    }

    /// Checks that only the correct checksum follows.
    pub(super) fn end(mut self) -> Result<(), DecodeError> {
        if self.offset != self.end {
            return Err(self.wrong(format!("{} bytes follow the last voxel", self.left())));
        }
        let mut crc = [0; CRC_BYTES as usize];
        self.input.read_exact(&mut crc)?;
        self.end_part();
        if self.crc_before != u32::from_le_bytes(crc) {
            return Err(self.wrong("the bytes do not match their checksum"));
        }
        Ok(())
    }
}
