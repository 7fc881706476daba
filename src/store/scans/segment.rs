use super::catalog_entry::SegmentPlace;
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::store::disk::{Disk, DiskRead, DiskWrite};
use crate::store::layout::Layout;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::Mutex;

/// Length in bytes from which on a segment is closed and a new one begins.
const MAX_BYTES: u64 = 256 << 20;
/// Length and checksum of a block.
const BLOCK_FRAME_BYTES: u64 = 8;
/// Maximum length of a block.
pub(crate) const MAX_BLOCK_BYTES: usize = 7 << 19;

/// Writer that appends scans to a segment in blocks. Bytes that no catalog references are ignored.
pub(super) struct SegmentWriter {
    pub(super) segment: u64,
    path: PathBuf,
    /// A `Mutex` because stores are `Sync`.
    out: Mutex<Box<dyn DiskWrite>>,
    bytes: u64,
}

impl SegmentWriter {
    pub(super) fn create(disk: &dyn Disk, layout: &Layout, segment: u64) -> Result<Self> {
        let path = layout.segment(segment);
        let out = disk.create(&path).map_err(|error| Error::io(&path, "create", error))?;
        Ok(Self { segment, path, out: Mutex::new(out), bytes: 0 })
    }

    /// Offset of the next scan.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns whether the next scan belongs in a new segment.
    pub(super) fn is_full(&self) -> bool {
        self.bytes >= MAX_BYTES
    }

    pub(super) fn push(&mut self, block: &[u8]) -> Result<()> {
        self.write(block).map_err(|error| Error::io(&self.path, "write", error))
    }

    /// Returns the location of the scan that began at `offset`, as far as it is written.
    pub(super) fn place_from(&self, offset: u64) -> SegmentPlace {
        SegmentPlace { segment: self.segment, offset, bytes: self.bytes - offset }
    }

    /// Copies a scan from another segment in blocks, and verifies their checksums.
    pub(super) fn copy(&mut self, scan: &mut SegmentReader) -> Result<SegmentPlace> {
        let offset = self.bytes;
        while let Some(block) = scan.next_block()? {
            self.push(block)?;
        }
        Ok(self.place_from(offset))
    }

    fn write(&mut self, block: &[u8]) -> io::Result<()> {
        let length = u32::try_from(block.len()).map_err(io::Error::other)?;
        let mut frame = [0; BLOCK_FRAME_BYTES as usize];
        frame[..4].copy_from_slice(&length.to_le_bytes());
        frame[4..].copy_from_slice(&crc32fast::hash(block).to_le_bytes());
        let out = self.out.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        out.write_all(&frame)?;
        out.write_all(block)?;
        self.bytes += BLOCK_FRAME_BYTES + block.len() as u64;
        Ok(())
    }

    /// Discards the scan that began at `offset`. The next scan starts there.
    pub(super) fn cut(&mut self, disk: &dyn Disk, offset: u64) -> io::Result<()> {
        *self.out.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner) =
            disk.append(&self.path, offset)?;
        self.bytes = offset;
        Ok(())
    }
}

/// Reader of one scan in its segment, in blocks.
pub(crate) struct SegmentReader {
    input: io::Take<Box<dyn DiskRead>>,
    path: PathBuf,
    /// Offset of the next block in the segment.
    at: u64,
    block: Vec<u8>,
}

impl SegmentReader {
    /// Opens a scan in its segment.
    ///
    /// # Errors
    ///
    /// A missing or truncated segment, or an I/O error.
    pub(crate) fn open(disk: &dyn Disk, layout: &Layout, place: SegmentPlace) -> Result<Self> {
        let path = layout.segment(place.segment);
        let input = disk.open_at(&path, place.offset).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => {
                FormatError::at_offset(0, "the segment of kept scans is missing").in_map(&path, None)
            }
            _ => Error::io(&path, "open", error),
        })?;
        Ok(Self { input: input.take(place.bytes), path, at: place.offset, block: Vec::new() })
    }

    /// Offset of the next block in the segment.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Returns the error of damage at an offset of the segment.
    pub(crate) fn damaged(&self, at: u64, reason: &str) -> Error {
        FormatError::at_offset(at, reason).in_map(&self.path, None)
    }

    /// Returns the next encoded block; `None` after the last.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn next_block(&mut self) -> Result<Option<&[u8]>> {
        self.read_block().map_err(|error| error.in_map(&self.path, None))?;
        Ok((!self.block.is_empty()).then_some(&*self.block))
    }

    fn read_block(&mut self) -> std::result::Result<(), DecodeError> {
        self.block.clear();
        if self.input.limit() == 0 {
            return Ok(());
        }
        let wrong = |reason: &str| DecodeError::from(FormatError::at_offset(self.at, reason));
        let mut frame = [0; BLOCK_FRAME_BYTES as usize];
        match self.input.read_exact(&mut frame) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(wrong("the segment ends early"));
            }
            result => result?,
        }
        let [length, checksum] =
            [0, 4].map(|at| u32::from_le_bytes([frame[at], frame[at + 1], frame[at + 2], frame[at + 3]]));
        let length = length as usize;
        if length == 0 || length > MAX_BLOCK_BYTES || length as u64 > self.input.limit() {
            return Err(wrong("a block with an invalid length"));
        }
        self.block.resize(length, 0);
        match self.input.read_exact(&mut self.block) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(wrong("the segment ends early"));
            }
            result => result?,
        }
        if crc32fast::hash(&self.block) != checksum {
            return Err(wrong("the checksum of a block of points does not match"));
        }
        self.at += BLOCK_FRAME_BYTES + length as u64;
        Ok(())
    }
}
