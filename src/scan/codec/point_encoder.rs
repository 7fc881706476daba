use super::VERSION;
use super::column::ColumnWriter;
use super::words::widen;
use crate::space::{Point, put_number};
use std::fmt;
use std::io;

/// Encoder of blocks of points. It reuses its memory between blocks.
#[derive(Default)]
pub(crate) struct PointEncoder {
    columns: ColumnWriter,
    depths: Vec<f64>,
    values: Vec<f64>,
}

impl PointEncoder {
    /// Appends a block of at most [`MAX_POINTS`](super::MAX_POINTS) points, with their intensities if they have any.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted.
    pub(crate) fn encode(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        out.extend([VERSION, u8::from(intensities.is_some())]);
        put_number(points.len() as u64, out);
        let Self { columns, depths, values } = self;
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
        Ok(())
    }
}

impl fmt::Debug for PointEncoder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointEncoder").finish_non_exhaustive()
    }
}
