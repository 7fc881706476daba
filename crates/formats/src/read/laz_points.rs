use super::guard::guarded;
use super::laz_chunks::{ChunkPoints, Chunks};
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LasZipError, LazItem};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Seek, SeekFrom};
use voxtile::{Error, Result};

/// Decompressor of points in order, chunk by chunk. The complete decompressor of the crate `laz` requires a chunk table
/// and panics without one; its record decompressors do not.
pub(super) struct LazPoints {
    decompressor: Box<dyn RecordDecompressor<BufReader<File>> + Send>,
    items: Vec<LazItem>,
    points: ChunkPoints,
    /// Number of chunks started.
    chunks: usize,
    /// Number of unread points of the current chunk.
    left: u64,
    /// Without a chunk table, points may end with the file.
    pub(super) has_table: bool,
}

/// Reason for an early end.
pub(super) enum End {
    /// End of the file.
    File,
    /// The file is damaged.
    Damage(String),
}

impl LazPoints {
    pub(super) fn new(path: &std::path::Path, file: File, chunks: Chunks) -> Result<Self> {
        let mut input = BufReader::with_capacity(1 << 16, file);
        input.seek(SeekFrom::Start(chunks.data_at)).map_err(|error| Error::io(path, "read", error))?;
        let decompressor: Box<dyn RecordDecompressor<BufReader<File>> + Send> = match chunks.is_layered {
            true => Box::new(LayeredPointRecordDecompressor::new(input)),
            false => Box::new(SequentialPointRecordDecompressor::new(input)),
        };
        let Chunks { items, points, has_table, .. } = chunks;
        Ok(Self { decompressor, items, points, chunks: 0, left: 0, has_table })
    }

    /// Fills `bytes` with points of `point_bytes` each. Returns the number of complete points, and the reason for an
    /// early end.
    pub(super) fn fill(&mut self, bytes: &mut [u8], point_bytes: usize) -> (usize, Option<End>) {
        let mut done = 0;
        let mut is_file_end = false;
        let read = guarded(|| {
            for point in bytes.chunks_exact_mut(point_bytes) {
                let read = self.next(point);
                if let Err(error) = read {
                    is_file_end =
                        matches!(&error, LasZipError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof);
                    return Err(error);
                }
                done += 1;
            }
            Ok(())
        });
        let end = read.err().map(|reason| if is_file_end { End::File } else { End::Damage(reason) });
        (done, end)
    }

    fn next(&mut self, point: &mut [u8]) -> std::result::Result<(), LasZipError> {
        if self.left == 0 {
            self.left = match &self.points {
                ChunkPoints::All => u64::MAX,
                ChunkPoints::Each(points) => *points,
                ChunkPoints::Own(points) => points
                    .get(self.chunks)
                    .copied()
                    .ok_or_else(|| std::io::Error::from(ErrorKind::UnexpectedEof))?,
            };
            self.chunks += 1;
            self.decompressor.reset();
            self.decompressor.set_fields_from(&self.items)?;
            self.decompressor.set_selection(DecompressionSelection::all());
        }
        self.decompressor.decompress_next(point)?;
        self.left -= 1;
        Ok(())
    }
}
