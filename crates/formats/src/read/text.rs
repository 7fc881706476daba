use super::cloud::{CloudHead, CloudPoint};
use super::foreign::{text_encoding, without_bom};
use super::glance::GLANCE_BYTES;
use super::lines::{Lines, MAX_LINE_BYTES, RawLines};
use super::one::{Points, Visit};
use super::skipped_rows::SkippedRows;
use super::text_columns::{Columns, Line};
use crate::read_options::ReadOptions;
use std::path::Path;
use voxtile::{FormatError, Result};

struct TextPoints {
    lines: Lines,
    columns: Columns,
    skipped_rows: SkippedRows,
    /// The point that determined the columns.
    first: Option<CloudPoint>,
    is_at_end: bool,
}

/// Checks that a file with this start is a text of points. A file without a known extension must contain only numbers.
///
/// # Errors
///
/// The reason why it is not, with the line.
pub(crate) fn check_start(start: &[u8], is_named: bool) -> std::result::Result<(), String> {
    if let Some(encoding) = text_encoding(start) {
        return Err(encoding.to_owned());
    }
    if start.contains(&0) {
        return Err("it contains zero bytes, so it is not a text file".to_owned());
    }
    let is_cut = start.len() as u64 == GLANCE_BYTES;
    let mut text = without_bom(start);
    if is_cut && let Some(end) = text.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')) {
        text = text.get(..end).unwrap_or(text);
    }
    let (mut lines, mut columns, mut skipped_rows) =
        (RawLines::new(text, MAX_LINE_BYTES), Columns::default(), SkippedRows::default());
    let at_line = |(line, reason): (u64, String)| format!("line {line}: {reason}");
    for number in 1.. {
        // Reading from memory does not fail.
        if !matches!(lines.next(), Ok(Some(_))) {
            break;
        }
        match columns.take(number, &String::from_utf8_lossy(lines.line())).map_err(at_line)? {
            Line::Point(_) if is_named || columns.are_named() || columns.are_numbers() => return Ok(()),
            Line::Point(_) => return Err(format!("line {number}: there are words between the numbers")),
            Line::Nothing => {}
            Line::Unread(reason) => skipped_rows.add(number, reason),
        }
    }
    if let Some(wrong) = columns.why_none() {
        return Err(at_line(wrong));
    }
    // No point was found so far. Accept a text with column names, and a file with a known extension of which only the
    // start was read.
    match skipped_rows.error() {
        None if columns.are_named() || (is_named && is_cut) => Ok(()),
        Some(error) => Err(error.to_string()),
        None => Err("no line has three or more numbers or column names with x, y and z".to_owned()),
    }
}

/// Opens a text of points and reads up to its first point.
pub(crate) fn open(
    path: &Path,
    mut head: CloudHead,
    options: &ReadOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let (mut columns, skipped_rows) = (Columns::default(), SkippedRows::default());
    columns.wanted = options.attributes_to_read();
    let mut points =
        TextPoints { lines: Lines::open(path)?, columns, skipped_rows, first: None, is_at_end: false };
    points.columns.clock = super::columns::Clock::new(head.stamp_ns);
    points.first = points.next()?;
    if points.first.is_none() {
        if let Some((line, reason)) = points.columns.why_none() {
            return Err(FormatError::at_line(line, reason).in_input(path));
        }
        if let Some(error) = points.skipped_rows.error() {
            return Err(error.in_input(path));
        }
        if !points.columns.are_named() {
            let reason = "there are no points and no column names with x, y and z";
            return Err(FormatError::at_offset(0, reason).in_input(path));
        }
    }
    head.fields = points.columns.names.clone();
    head.attributes = points.columns.attributes();
    if let Some(meaning) = points.columns.meaning() {
        head.has_intensities = meaning.intensity.is_some();
        head.has_times = meaning.time.is_some();
    }
    Ok((head, Box::new(points)))
}

impl TextPoints {
    fn next(&mut self) -> Result<Option<CloudPoint>> {
        while let Some((number, line)) = self.lines.next()? {
            match self.columns.take(number, &line) {
                Ok(Line::Point(point)) => return Ok(Some(point)),
                Ok(Line::Nothing) => {}
                Ok(Line::Unread(reason)) => self.skipped_rows.add(number, reason),
                Err((line, reason)) => return Err(self.lines.error_at(line, reason)),
            }
        }
        self.is_at_end = true;
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

    fn remarks(&self) -> Vec<String> {
        let last = self.columns.last_remark().filter(|_| self.is_at_end);
        self.columns.remarks().into_iter().chain(self.skipped_rows.remark()).chain(last).collect()
    }
}
