use super::column::{ColumnReader, word_bytes};
use super::planes::BlockInput;
use super::words::{Width, unzigzag};
use super::{CLASS_BYTES, CLASSES, COLOUR_BYTES, COLOURS, INTENSITIES, MAX_POINTS, TIMES, VERSION};
use crate::error::FormatError;
use crate::scan::PointAttributes;
use crate::space::Point;
use std::fmt;

/// Decoder of blocks of points. It reuses its memory between blocks.
#[derive(Default)]
pub(crate) struct PointDecoder {
    columns: ColumnReader,
    values: [Vec<f64>; 3],
}

impl PointDecoder {
    /// Appends the points of a block, their intensities and attributes; returns whether it has intensities. After an error some of
    /// the points may have been appended.
    ///
    /// # Errors
    ///
    /// Fails if the block is damaged; the error contains the offset in the block.
    pub(crate) fn decode(
        &mut self,
        block: &[u8],
        points: &mut Vec<Point>,
        intensities: &mut Vec<f32>,
        attributes: &mut PointAttributes,
    ) -> Result<bool, FormatError> {
        let mut input = BlockInput::new(block);
        if !(1..=VERSION).contains(&input.byte()?) {
            return Err(input.wrong("a block of points of a newer version"));
        }
        let set = input.byte()?;
        if set & !(INTENSITIES | COLOURS | CLASSES | TIMES) != 0 {
            return Err(input.wrong("a block of points with unknown columns"));
        }
        let has_intensities = set & INTENSITIES != 0;
        let count = input.number()?;
        if count > MAX_POINTS {
            return Err(input.wrong("a block of too many points"));
        }
        let Self { columns, values: [z, x, y] } = self;
        columns.take(count, None, z, &mut input)?;
        columns.take(count, Some(z), x, &mut input)?;
        columns.take(count, Some(z), y, &mut input)?;
        points.extend(x.iter().zip(&*y).zip(&*z).map(|((x, y), z)| [*x, *y, *z]));
        if has_intensities {
            columns.take(count, None, z, &mut input)?;
            intensities.extend(z.iter().map(|value| f32::from_bits(Width::Narrow.bits(*value) as u32)));
        }
        if set & COLOURS != 0 {
            let words = columns.take_words(count, COLOUR_BYTES, &mut input)?;
            attributes.colours.extend(words.iter().map(|word| {
                let [has, red, green, blue] = (*word as u32).to_be_bytes();
                (has == 1).then_some([red, green, blue])
            }));
        }
        if set & CLASSES != 0 {
            let words = columns.take_words(count, CLASS_BYTES, &mut input)?;
            attributes.classes.extend(words.iter().map(|word| (word >> 8 == 1).then_some(*word as u8)));
        }
        if set & TIMES != 0 {
            let bytes = word_bytes(&mut input)?;
            let mut time = 0_i64;
            let words = columns.take_words(count, bytes, &mut input)?;
            attributes.times_ns.extend(words.iter().map(|word| {
                time = time.wrapping_add(unzigzag(*word));
                time
            }));
        }
        match input.is_at_end() {
            true => Ok(has_intensities),
            false => Err(input.wrong("extra bytes after a block of points")),
        }
    }
}

impl fmt::Debug for PointDecoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointDecoder").finish_non_exhaustive()
    }
}
