use crate::error::Result;
use crate::scan::{AttributeSet, MAX_BLOCK_BYTES, MovingMarks, PointAttributes, PointDecoder};
use crate::space::Point;
use crate::store::{self, Disk, KeptRecord, Layout, SegmentPlace, SegmentReader};

/// Reader of the points of one kept scan, in blocks.
pub(crate) struct PointReader {
    blocks: SegmentReader,
    decoder: PointDecoder,
}

const _: () = assert!(MAX_BLOCK_BYTES == store::MAX_BLOCK_BYTES, "writer and reader have the same limit");

impl PointReader {
    /// Opens a kept scan.
    ///
    /// # Errors
    ///
    /// A missing or truncated segment, or an I/O error.
    pub(crate) fn open(disk: &dyn Disk, layout: &Layout, place: SegmentPlace) -> Result<Self> {
        Ok(Self { blocks: SegmentReader::open(disk, layout, place)?, decoder: PointDecoder::default() })
    }

    /// Replaces the content of the lists by the points of the next block. Returns false after the last block.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn next(
        &mut self,
        points: &mut Vec<Point>,
        intensities: &mut Vec<f32>,
        attributes: &mut PointAttributes,
    ) -> Result<bool> {
        points.clear();
        intensities.clear();
        attributes.clear();
        let at = self.blocks.at();
        let Some(block) = self.blocks.next_block()? else { return Ok(false) };
        let decoded = self.decoder.decode(block, points, intensities, attributes);
        decoded.map_err(|error| self.blocks.damaged(at, &error.to_string()))?;
        Ok(true)
    }

    /// Checks that the points of a block have the attributes that the record names.
    pub(crate) fn check_attributes(
        &self,
        intensities: usize,
        attributes: AttributeSet,
        record: &KeptRecord,
    ) -> Result<()> {
        match (intensities > 0) == record.has_intensities
            && (attributes.colours, attributes.classes) == (record.has_colours, record.has_classes)
            && attributes.times == record.sweep.is_some()
        {
            true => Ok(()),
            false => {
                let reason = "a block with attributes that do not match its points";
                Err(self.blocks.damaged(self.blocks.at(), reason))
            }
        }
    }

    /// Checks, after the last block, the number of points against the catalog.
    pub(crate) fn check_count(&self, points: u64, scan: &KeptRecord) -> Result<()> {
        match points == scan.points {
            true => Ok(()),
            false => {
                let reason =
                    format!("scan {} has {points} points, but its record says {}", scan.number, scan.points);
                Err(self.blocks.damaged(self.blocks.at(), &reason))
            }
        }
    }
}

/// Reads the marks of moving points of a kept scan. Returns `None` if it has none, or lost them.
///
/// # Errors
///
/// Damage or an I/O error.
pub(crate) fn read_marks(disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<Option<MovingMarks>> {
    let Some(kept) = scan.moving else { return Ok(None) };
    let Some(place) = kept.place else { return Ok(None) };
    let mut blocks = SegmentReader::open(disk, layout, place)?;
    let mut runs = Vec::new();
    // A run has at most 10 bytes, and all but the first have a point. More cannot be valid.
    let max_bytes = scan.points.saturating_add(1).saturating_mul(10);
    while let Some(block) = blocks.next_block()?
        && runs.len() as u64 <= max_bytes
    {
        runs.extend_from_slice(block);
    }
    match MovingMarks::from_bytes(runs, scan.points).filter(|marks| marks.marked() == kept.marked) {
        Some(marks) => Ok(Some(marks)),
        None => {
            let reason = format!("the marks of moving points of scan {} are invalid", scan.number);
            Err(blocks.damaged(place.offset, &reason))
        }
    }
}

/// Checks that the points of a kept scan are intact.
pub(crate) fn check_points(disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<()> {
    let mut input = PointReader::open(disk, layout, scan.place)?;
    let (mut points, mut intensities, mut attributes) = Default::default();
    let mut count = 0;
    while input.next(&mut points, &mut intensities, &mut attributes)? {
        count += points.len() as u64;
    }
    input.check_count(count, scan)
}
