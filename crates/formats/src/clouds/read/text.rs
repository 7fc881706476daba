use super::one::{Points, Visit};
use super::text_line::{Columns, Line};
use crate::clouds::cloud::{CloudHead, CloudPoint};
use crate::clouds::error::{Error, Place, Result};
use crate::clouds::lines::Lines;
use std::path::Path;

/// The points of a text.
struct TextPoints {
    lines: Lines,
    columns: Columns,
    /// The point that told what the columns are.
    first: Option<CloudPoint>,
}

/// Opens a text of points and reads up to its first point.
pub(super) fn open(path: &Path, mut head: CloudHead) -> Result<(CloudHead, Box<dyn Points>)> {
    let mut points = TextPoints { lines: Lines::open(path)?, columns: Columns::default(), first: None };
    points.columns.clock = super::columns::Clock::new(head.stamp_ns);
    points.first = points.next()?;
    if points.first.is_none() && !points.columns.are_named() {
        return Err(Error::format(path, Place::Byte(0), "no point, and no names of columns with x, y and z"));
    }
    head.fields = points.columns.names.clone();
    if let Some(meaning) = points.columns.meaning() {
        head.has_intensities = meaning.intensity.is_some();
        head.has_times = meaning.time.is_some();
    }
    Ok((head, Box::new(points)))
}

impl TextPoints {
    fn next(&mut self) -> Result<Option<CloudPoint>> {
        while let Some((_, line)) = self.lines.next()? {
            match self.columns.take(&line) {
                Ok(Line::Point(point)) => return Ok(Some(point)),
                Ok(Line::Nothing) => {}
                Err(reason) => return Err(self.lines.error(reason)),
            }
        }
        Ok(None)
    }
}

impl Points for TextPoints {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        if let Some(point) = self.first.take() {
            visit(point)?;
        }
        while let Some(point) = self.next()? {
            visit(point)?;
        }
        Ok(())
    }
}
