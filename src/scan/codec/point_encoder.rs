use super::column::ColumnWriter;
use super::words::{widen, zigzag};
use super::{CLASS_BYTES, CLASSES, COLOUR_BYTES, COLOURS, INTENSITIES, TIMES, VERSION};
use crate::scan::AttributeSlices;
use crate::space::{Point, put_number};
use std::fmt;
use std::io;

/// Encoder of blocks of points. It reuses its memory between blocks.
#[derive(Default)]
pub(crate) struct PointEncoder {
    columns: ColumnWriter,
    depths: Vec<f64>,
    values: Vec<f64>,
    words: Vec<u64>,
}

impl PointEncoder {
    /// Appends a block of at most [`MAX_POINTS`](super::MAX_POINTS) points, with the intensities and attributes that they
    /// have.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted.
    pub(crate) fn encode(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
        attributes: AttributeSlices<'_>,
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        let AttributeSlices { colours, classes, times_ns } = attributes;
        let columns = [
            (intensities.is_some(), INTENSITIES),
            (!colours.is_empty(), COLOURS),
            (!classes.is_empty(), CLASSES),
            (!times_ns.is_empty(), TIMES),
        ];
        let set =
            columns.into_iter().filter(|(is_there, _)| *is_there).fold(0, |set, (_, column)| set | column);
        out.extend([VERSION, set]);
        put_number(points.len() as u64, out);
        let Self { columns, depths, values, words } = self;
        let fill = |values: &mut Vec<f64>, axis: usize| {
            values.clear();
            values.extend(points.iter().map(|point| point[axis]));
        };
        fill(depths, 2);
        columns.put(2, depths, None, out)?;
        for axis in [0, 1] {
            fill(values, axis);
            columns.put(axis, values, Some(depths), out)?;
        }
        if let Some(intensities) = intensities {
            values.clear();
            values.extend(intensities.iter().map(|intensity| widen(intensity.to_bits())));
            columns.put(3, values, None, out)?;
        }
        if !colours.is_empty() {
            let word = |colour: &Option<[u8; 3]>| {
                colour.map_or(0, |[red, green, blue]| u64::from(u32::from_be_bytes([1, red, green, blue])))
            };
            columns.put_words(colours.iter().map(word), COLOUR_BYTES, out)?;
        }
        if !classes.is_empty() {
            let word = |class: &Option<u8>| class.map_or(0, |class| 1 << 8 | u64::from(class));
            columns.put_words(classes.iter().map(word), CLASS_BYTES, out)?;
        }
        if !times_ns.is_empty() {
            let mut before = 0;
            let differences = times_ns.iter().map(|time| {
                let difference = time.wrapping_sub(before);
                before = *time;
                zigzag(difference)
            });
            words.clear();
            words.extend(differences);
            let largest = words.iter().copied().max().unwrap_or_default();
            let bytes = (u64::BITS - largest.leading_zeros()).div_ceil(u8::BITS);
            out.push(bytes as u8);
            columns.put_words(words.iter().copied(), bytes as usize, out)?;
        }
        Ok(())
    }
}

impl fmt::Debug for PointEncoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointEncoder").finish_non_exhaustive()
    }
}
