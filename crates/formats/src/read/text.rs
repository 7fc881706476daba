use super::cloud::{CloudHead, CloudPoint};
use super::glance::GLANCE_BYTES;
use super::lines::Lines;
use super::one::{Points, Visit};
use super::text_columns::{Columns, Line};
use crate::read_options::ReadOptions;
use std::path::Path;
use voxtile::{FormatError, Result};

/// The points of a text.
struct TextPoints {
    lines: Lines,
    columns: Columns,
    /// The point that told what the columns are.
    first: Option<CloudPoint>,
}

/// Whether a file that starts like this is a text of points.
pub(crate) fn looks_like_points(start: &[u8]) -> bool {
    if start.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(start);
    let is_cut = start.len() as u64 == GLANCE_BYTES;
    let mut lines: Vec<&str> = text.lines().collect();
    if is_cut && lines.len() > 1 {
        lines.pop();
    }
    let mut columns = Columns::default();
    for line in lines {
        match columns.take(line) {
            Ok(Line::Point(_)) => return true,
            Ok(Line::Nothing) => {}
            Err(_) => return false,
        }
    }
    // Names alone: a text without points yet.
    columns.are_named()
}

/// Opens a text of points and reads up to its first point.
pub(crate) fn open(
    path: &Path,
    mut head: CloudHead,
    _: &ReadOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let mut points = TextPoints { lines: Lines::open(path)?, columns: Columns::default(), first: None };
    points.columns.clock = super::columns::Clock::new(head.stamp_ns);
    points.first = points.next()?;
    if points.first.is_none() && !points.columns.are_named() {
        return Err(
            FormatError::at_offset(0, "no point, and no names of columns with x, y and z").in_input(path)
        );
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
