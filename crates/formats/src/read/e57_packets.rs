use super::e57_pages::Pages;
use crate::spill::Budget;
use e57::{PointCloud, RecordDataType};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Memory for an unpacked value whose point is incomplete, and for a complete point not yet consumed.
const VALUE_BYTES: u64 = 32;
const POINT_BYTES: u64 = 320;
const INDEX: u8 = 0;
const DATA: u8 = 1;
const IGNORED: u8 = 2;

/// Checks that each packet of a scan fits in memory after decoding. The library decodes whole packets and keeps the
/// values of a field until those of all other fields are available, so one bit in the file may take hundreds of bytes.
///
/// # Errors
///
/// A packet takes too much memory, or the file cannot be read. Other problems of packets are reported by the library.
pub(super) fn check_packets(path: &Path, scan: &PointCloud, budget: &Budget) -> Result<()> {
    let fail = |error| Error::io(path, "read", error);
    let mut file = File::open(path).map_err(fail)?;
    let mut packets = Packets {
        bits: scan.prototype.iter().map(|record| bits(&record.data_type)).collect(),
        unpacked: vec![0; scan.prototype.len()],
        points: 0,
    };
    let checked = packets.check(&mut file, scan, budget.whole_bytes());
    match checked {
        Ok(None) => Ok(()),
        Ok(Some(needed)) => {
            let reason = format!(
                "a packet of points would need {needed} bytes of memory: raise `memory`, or write the file again with \
                 smaller packets"
            );
            Err(FormatError::at_record(packets.points, reason).in_input(path))
        }
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(()),
        Err(error) => Err(fail(error)),
    }
}

/// State of the packets decoded so far.
struct Packets {
    /// Bits per value of each field.
    bits: Vec<u64>,
    /// Unpacked bits of each field.
    unpacked: Vec<u64>,
    /// Number of complete points.
    points: u64,
}

impl Packets {
    /// Returns the memory that a packet takes, if it exceeds `max_bytes`.
    fn check(&mut self, file: &mut File, scan: &PointCloud, max_bytes: u64) -> io::Result<Option<u64>> {
        let mut pages = Pages::new(file, scan.file_offset)?;
        let mut section = [0; 32];
        pages.read_exact(&mut section)?;
        let data_at = section.get(16..).and_then(|bytes| bytes.first_chunk()).copied();
        pages = Pages::new(file, data_at.map_or(0, u64::from_le_bytes))?;
        while self.points < scan.records {
            let mut head = [0; 4];
            pages.read_exact(&mut head)?;
            let [kind, _, length @ ..] = head;
            let length = u64::from(u16::from_le_bytes(length)) + 1;
            match kind {
                // The library skips these packets too.
                INDEX => pages.skip(12 + length)?,
                IGNORED => pages.skip(length)?,
                DATA => {
                    let mut count = [0; 2];
                    pages.read_exact(&mut count)?;
                    if usize::from(u16::from_le_bytes(count)) != self.bits.len() {
                        return Ok(None);
                    }
                    let mut sizes = vec![0; 2 * self.bits.len()];
                    pages.read_exact(&mut sizes)?;
                    let sizes = sizes.as_chunks().0.iter().map(|size| u64::from(u16::from_le_bytes(*size)));
                    let mut bytes = 0;
                    for (unpacked, size) in self.unpacked.iter_mut().zip(sizes) {
                        *unpacked += 8 * size;
                        bytes += size;
                    }
                    let before = self.points;
                    let needed = self.decode();
                    if needed > max_bytes {
                        self.points = before;
                        return Ok(Some(needed));
                    }
                    pages.skip(bytes)?;
                }
                _ => return Ok(None),
            }
            pages.skip(pages.position().wrapping_neg() % 4)?;
        }
        Ok(None)
    }

    /// Returns the memory for unpacked values, and consumes the complete points.
    fn decode(&mut self) -> u64 {
        let values = || {
            let fields = self.unpacked.iter().zip(&self.bits);
            fields.filter_map(|(unpacked, bits)| unpacked.checked_div(*bits))
        };
        let points = values().min().unwrap_or(self.points);
        let new = points.saturating_sub(self.points);
        let without_bits = self.bits.iter().filter(|bits| **bits == 0).count() as u64;
        let waiting = values().map(|values| values.saturating_sub(self.points)).fold(0, u64::saturating_add);
        let waiting = waiting.saturating_add(new.saturating_mul(without_bits));
        self.points = points;
        waiting.saturating_mul(VALUE_BYTES).saturating_add(new.saturating_mul(POINT_BYTES))
    }
}

/// Returns the bits per value of a field in a packet.
fn bits(of: &RecordDataType) -> u64 {
    match *of {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            u64::from(64 - max.abs_diff(min).leading_zeros())
        }
    }
}
