use crate::error::Result;
use crate::scan::{MAX_BLOCK_BYTES, PointDecoder};
use crate::space::Point;
use crate::store::{self, Disk, KeptRecord, Layout, SegmentPlace, SegmentReader};

/// Reads the points of one kept scan, block by block, and nothing else of its segment.
pub(crate) struct PointReader {
    blocks: SegmentReader,
    decoder: PointDecoder,
}

const _: () = assert!(MAX_BLOCK_BYTES == store::MAX_BLOCK_BYTES, "a block that is written can be read");

impl PointReader {
    /// Goes to where a scan begins.
    ///
    /// # Errors
    ///
    /// A segment that is missing or too short, a disk that refuses.
    pub(crate) fn open(disk: &dyn Disk, layout: &Layout, place: SegmentPlace) -> Result<Self> {
        Ok(Self { blocks: SegmentReader::open(disk, layout, place)?, decoder: PointDecoder::default() })
    }

    /// Reads the next block's points in place of those in the lists; false after the last block.
    ///
    /// # Errors
    ///
    /// Damage, or a disk that refuses.
    pub(crate) fn next(&mut self, points: &mut Vec<Point>, intensities: &mut Vec<f32>) -> Result<bool> {
        points.clear();
        intensities.clear();
        let at = self.blocks.at();
        let Some(block) = self.blocks.next_block()? else { return Ok(false) };
        let decoded = self.decoder.decode(block, points, intensities);
        decoded.map_err(|error| self.blocks.damaged(at, &error.to_string()))?;
        Ok(true)
    }

    /// After a block: whether it has as many intensities as it should.
    pub(crate) fn check_intensities(&self, points: usize, intensities: usize, has_any: bool) -> Result<()> {
        match intensities == if has_any { points } else { 0 } {
            true => Ok(()),
            false => {
                let reason = "a block with intensities that do not match its points";
                Err(self.blocks.damaged(self.blocks.at(), reason))
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
                Err(self.blocks.damaged(self.blocks.at(), &reason))
            }
        }
    }
}

/// Checks that the points of a kept scan are whole.
pub(crate) fn check_points(disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<()> {
    let mut input = PointReader::open(disk, layout, scan.place)?;
    let (mut points, mut intensities, mut count) = (Vec::new(), Vec::new(), 0);
    while input.next(&mut points, &mut intensities)? {
        count += points.len() as u64;
    }
    input.check_count(count, scan)
}
