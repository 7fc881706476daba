use super::las_layout::number;
use laz::LazVlr;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Head of a layered chunk. It follows the first point and contains the number of points and the size of each layer.
pub(super) struct LayeredHead {
    pub(super) points: u64,
    lengths_at: u64,
    layers_at: u64,
    /// Total size of the layers.
    claimed: u64,
}

impl LayeredHead {
    pub(super) fn read(path: &Path, input: &mut BufReader<&File>, laz: &LazVlr, at: u64) -> Result<Self> {
        let layers = laz.items().iter().map(|item| match u16::from(item.item_type()) {
            // Point, colour, colour with near infrared, wave packet, extra bytes.
            10 => 9,
            12 => 2,
            14 => u64::from(item.size()),
            _ => 1,
        });
        let point_bytes: u64 = laz.items().iter().map(|item| u64::from(item.size())).sum();
        let lengths_at = at + point_bytes + 4;
        let lengths_bytes = 4 * layers.sum::<u64>();
        let head = bytes_at(path, input, lengths_at - 4, 4 + lengths_bytes)?;
        let lengths = head.get(4..).unwrap_or_default();
        let claimed = lengths.chunks_exact(4).map(|length| number(length, 0, 4)).sum();
        Ok(Self { points: number(&head, 0, 4), lengths_at, layers_at: lengths_at + lengths_bytes, claimed })
    }

    /// Returns the offset of the chunk's end.
    pub(super) fn end(&self) -> Option<u64> {
        self.layers_at.checked_add(self.claimed)
    }

    /// Checks that the layers end with the chunk. The library takes the bytes after them as the next chunk.
    pub(super) fn check(&self, path: &Path, end: u64) -> Result<()> {
        if self.end() == Some(end) {
            return Ok(());
        }
        let there = end.saturating_sub(self.layers_at);
        let reason = format!("the fields of a chunk need {} bytes, but it has {there}", self.claimed);
        Err(FormatError::at_offset(self.lengths_at, reason).in_input(path))
    }
}

/// Reads bytes at an offset. Fails if the file is truncated.
pub(super) fn bytes_at(path: &Path, input: &mut BufReader<&File>, at: u64, count: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = input.seek(SeekFrom::Start(at)).and_then(|_| input.take(count).read_to_end(&mut bytes));
    read.map_err(|error| Error::io(path, "read", error))?;
    if (bytes.len() as u64) < count {
        return Err(FormatError::at_offset(at, "the file ends within its compressed points").in_input(path));
    }
    Ok(bytes)
}
