use super::catalog_entry::{KeptRecord, SegmentPlace};
use super::codec::{MAX_POINTS, PointDecoder, PointEncoder};
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::space::Point;
use crate::store::disk::{Disk, DiskRead, DiskWrite};
use crate::store::layout::Layout;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A segment that is longer is followed by another.
const MAX_BYTES: u64 = 256 << 20;
/// Length and checksum of a block.
const BLOCK_FRAME_BYTES: u64 = 8;
/// No block is longer: the points as they are in memory, and some.
const MAX_BLOCK_BYTES: usize = 2 * MAX_POINTS * (size_of::<Point>() + size_of::<f32>());

/// Appends scans to a segment, block by block. What no catalog names is nothing.
pub(super) struct SegmentWriter {
    pub(super) segment: u64,
    path: PathBuf,
    /// A store that is read by several threads is `Sync`.
    out: Mutex<Box<dyn DiskWrite>>,
    bytes: u64,
    encoder: PointEncoder,
    /// Points of the block that is being filled.
    points: Vec<Point>,
    intensities: Vec<f32>,
    block: Vec<u8>,
}

impl SegmentWriter {
    /// Begins a segment.
    pub(super) fn create(disk: &dyn Disk, layout: &Layout, segment: u64) -> Result<Self> {
        let path = layout.segment(segment);
        let out = disk.create(&path).map_err(|error| Error::io(&path, "create", error))?;
        let (encoder, points, intensities, block) = Default::default();
        Ok(Self { segment, path, out: Mutex::new(out), bytes: 0, encoder, points, intensities, block })
    }

    /// Where the next scan begins.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Whether the next scan goes to another segment.
    pub(super) fn is_full(&self) -> bool {
        self.bytes >= MAX_BYTES
    }

    /// Adds points to the scan.
    pub(super) fn push(&mut self, points: &[Point], intensities: Option<&[f32]>) -> Result<()> {
        let mut at = 0;
        while at < points.len() {
            let count = (points.len() - at).min(MAX_POINTS - self.points.len());
            if count == MAX_POINTS {
                // A whole block need not be copied.
                let some = at..at + count;
                self.put(&points[some.clone()], intensities.map(|all| &all[some]))?;
            } else {
                self.points.extend_from_slice(&points[at..at + count]);
                self.intensities.extend_from_slice(intensities.map_or(&[], |all| &all[at..at + count]));
                if self.points.len() == MAX_POINTS {
                    self.put_rest(intensities.is_some())?;
                }
            }
            at += count;
        }
        Ok(())
    }

    /// Ends the scan that began at `offset`.
    pub(super) fn end(&mut self, offset: u64, has_intensities: bool) -> Result<SegmentPlace> {
        self.put_rest(has_intensities)?;
        Ok(SegmentPlace { segment: self.segment, offset, bytes: self.bytes - offset })
    }

    /// Copies a scan that lies elsewhere, block by block, checked.
    pub(super) fn copy(&mut self, scan: &mut SegmentScan) -> Result<SegmentPlace> {
        let offset = self.bytes;
        while let Some(block) = scan.next_block()? {
            self.write(block).map_err(|error| Error::io(&self.path, "write", error))?;
        }
        self.end(offset, false)
    }

    fn put_rest(&mut self, has_intensities: bool) -> Result<()> {
        if self.points.is_empty() {
            return Ok(());
        }
        let (points, intensities) = (std::mem::take(&mut self.points), std::mem::take(&mut self.intensities));
        let put = self.put(&points, has_intensities.then_some(&*intensities));
        // Their memory serves again.
        (self.points, self.intensities) = (points, intensities);
        self.points.clear();
        self.intensities.clear();
        put
    }

    fn put(&mut self, points: &[Point], intensities: Option<&[f32]>) -> Result<()> {
        let mut block = std::mem::take(&mut self.block);
        block.clear();
        let encoded = self.encoder.encode(points, intensities, &mut block);
        let written = encoded.and_then(|()| self.write(&block));
        self.block = block;
        written.map_err(|error| Error::io(&self.path, "write", error))
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

    /// Takes back a scan that is given up: what comes next begins where it began.
    pub(super) fn cut(&mut self, disk: &dyn Disk, offset: u64) -> io::Result<()> {
        self.points.clear();
        self.intensities.clear();
        *self.out.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner) =
            disk.append(&self.path, offset)?;
        self.bytes = offset;
        Ok(())
    }
}

/// Reads the points of one scan from its segment, block by block, and nothing else of it.
pub(crate) struct SegmentScan {
    input: io::Take<Box<dyn DiskRead>>,
    path: PathBuf,
    /// Where the next block begins in the segment.
    at: u64,
    block: Vec<u8>,
    decoder: PointDecoder,
}

impl SegmentScan {
    /// Goes to where a scan begins.
    ///
    /// # Errors
    ///
    /// A segment that is missing or too short, a disk that refuses.
    pub(crate) fn open(disk: &dyn Disk, layout: &Layout, place: SegmentPlace) -> Result<Self> {
        let path = layout.segment(place.segment);
        let input = disk.open_at(&path, place.offset).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => {
                FormatError::at_offset(0, "the segment is missing").in_map(&path, None)
            }
            _ => Error::io(&path, "open", error),
        })?;
        let (block, decoder) = Default::default();
        Ok(Self { input: input.take(place.bytes), path, at: place.offset, block, decoder })
    }

    /// Reads the next block's points in place of those in the lists; false after the last block.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub(crate) fn next(&mut self, points: &mut Vec<Point>, intensities: &mut Vec<f32>) -> Result<bool> {
        points.clear();
        intensities.clear();
        let at = self.at;
        if self.next_block()?.is_none() {
            return Ok(false);
        }
        let decoded = self.decoder.decode(&self.block, points, intensities);
        decoded.map_err(|error| damaged(&self.path, at, &error.to_string()))?;
        Ok(true)
    }

    /// After a block: whether it has as many intensities as it should.
    pub(crate) fn check_intensities(&self, points: usize, intensities: usize, has_any: bool) -> Result<()> {
        match intensities == if has_any { points } else { 0 } {
            true => Ok(()),
            false => {
                Err(damaged(&self.path, self.at, "a block with intensities that do not match its points"))
            }
        }
    }

    /// After the last block: whether as many points were there as the catalog says.
    pub(crate) fn check_count(&self, points: u64, scan: &KeptRecord) -> Result<()> {
        match points == scan.points {
            true => Ok(()),
            false => {
                let reason =
                    format!("scan {} has {points} points, its record says {}", scan.number, scan.points);
                Err(damaged(&self.path, self.at, &reason))
            }
        }
    }

    /// The next block as it is encoded; `None` after the last.
    fn next_block(&mut self) -> Result<Option<&[u8]>> {
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
            return Err(wrong("a block of no possible length"));
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

fn damaged(path: &Path, at: u64, reason: &str) -> Error {
    FormatError::at_offset(at, reason).in_map(path, None)
}
