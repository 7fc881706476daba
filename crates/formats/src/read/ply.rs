use super::attribute_columns::{AttributeColumns, AttributeValues};
use super::cloud::CloudHead;
use super::columns::{Clock, Meaning};
use super::input_file::open_input;
use super::lines::Lines;
use super::one::{Points, Visit};
use super::ply_header::{Element, Encoding, Header};
use super::ply_rows::{PlyRows, Row};
use super::scalar::Scalar;
use super::skipped_rows::SkippedRows;
use crate::read_options::ReadOptions;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Points of a PLY file.
struct PlyPoints {
    path: PathBuf,
    header: Header,
    input: Option<BufReader<File>>,
    vertices: usize,
    meaning: Meaning,
    attributes: AttributeColumns,
    /// Converts values to attributes.
    values: AttributeValues,
    clock: Clock,
    skipped_rows: SkippedRows,
}

/// Opens a PLY file and reads its header.
pub(crate) fn open(
    path: &Path,
    mut head: CloudHead,
    options: &ReadOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let mut input = BufReader::with_capacity(1 << 16, open_input(path)?);
    let header = Header::read(path, &mut input)?;
    let wrong = |reason: &str| FormatError::at_line(header.lines, reason).in_input(path);
    let is_vertices = |element: &Element| element.name.eq_ignore_ascii_case("vertex");
    let vertices = header.elements.iter().position(is_vertices);
    let vertices = vertices.ok_or_else(|| wrong("the file has no element `vertex`"))?;
    let element = header.elements.get(vertices).ok_or_else(|| wrong("the file has no element `vertex`"))?;
    let names: Vec<String> = element.properties.iter().map(|property| property.name.clone()).collect();
    let is_integer = |at: usize| element.properties.get(at).is_some_and(|found| found.kind.is_integer());
    let meaning = Meaning::of(&names, is_integer).map_err(|reason| wrong(&reason))?;
    let meaning = meaning.ok_or_else(|| wrong("vertices lack x, y or z"))?;
    let property = |at: usize| element.properties.get(at).filter(|property| property.list.is_none());
    let wanted = options.attributes_to_read();
    let attributes = AttributeColumns::of(names.iter().map(String::as_str), wanted, |_| false);
    let values = attributes.values(|at| property(at).map(|property| property.kind));
    head.points = Some(element.count);
    head.attributes = attributes.set();
    head.fields = names;
    head.has_intensities = meaning.intensity.is_some();
    head.has_times = meaning.time.is_some();
    let (clock, skipped_rows) = (Clock::new(head.stamp_ns), SkippedRows::default());
    let (path, input) = (path.to_owned(), Some(input));
    let points =
        PlyPoints { path, header, input, vertices, meaning, attributes, values, clock, skipped_rows };
    Ok((head, Box::new(points)))
}

impl Points for PlyPoints {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        let Some(input) = self.input.take() else { return Ok(()) };
        match self.header.encoding {
            Encoding::Ascii => self.read_ascii(Lines::new(&self.path, input, self.header.lines), visit),
            encoding => self.read_binary(input, encoding == Encoding::BigEndian, visit),
        }
    }

    fn remarks(&self) -> Vec<String> {
        let units = self.meaning.remark();
        let comment = self.header.unit.as_ref().filter(|_| units.is_none()).map(|(line, comment)| {
            format!("line {line} contains `{comment:.60}`, but coordinates are read as metres")
        });
        let rows = self.skipped_rows.remark();
        units.into_iter().chain(comment).chain(rows).chain(self.values.remarks()).collect()
    }
}

impl PlyPoints {
    fn read_ascii(&mut self, lines: Lines, visit: Visit<'_>) -> Result<()> {
        let (meaning, attributes, mut visited) = (self.meaning, self.attributes, 0_u64);
        let mut rows = PlyRows::new(lines);
        for (number, element) in self.header.elements.iter().enumerate() {
            if element.properties.is_empty() {
                continue;
            }
            if number != self.vertices {
                // In a file with wrapped lines, the elements after the vertices must be read too: they show whether
                // numbers are missing.
                if number < self.vertices || rows.are_wrapped() {
                    rows.pass(element)?;
                }
                continue;
            }
            for done in 0..element.count {
                match rows.next(element, done, &|at| meaning.reads(at) || attributes.reads(at))? {
                    Row::Values(values) => {
                        visited += 1;
                        let value = |at: usize| values.get(at).copied().unwrap_or(f64::NAN);
                        let mut point = self.clock.point(&meaning, value);
                        attributes.set_in(&mut point, &mut self.values, value, |_| None);
                        visit(point)?;
                    }
                    Row::Unread(line, reason) => self.skipped_rows.add(line, reason),
                }
            }
        }
        if rows.are_wrapped() {
            rows.check_end()?;
        }
        match self.skipped_rows.error() {
            Some(error) if visited == 0 => Err(error.in_input(&self.path)),
            _ => Ok(()),
        }
    }

    fn read_binary(&mut self, input: BufReader<File>, is_big: bool, visit: Visit<'_>) -> Result<()> {
        let mut records = Records { input, at: self.header.bytes, is_big, bytes: Vec::new() };
        let mut values = Vec::new();
        for (number, element) in self.header.elements.iter().enumerate().take(self.vertices + 1) {
            let cut = |done: u64, records: &Records| {
                let reason = format!("the file ends after {done} of {} {}", element.count, element.name);
                FormatError::at_offset(records.at, reason).in_input(&self.path)
            };
            let is_wanted = number == self.vertices;
            if let (false, Some(bytes)) = (is_wanted, element.bytes()) {
                // Elements of fixed size are skipped at once. A truncated file is detected at the next element.
                let skipped = element.count.checked_mul(bytes).map(|bytes| records.skip(bytes));
                match skipped {
                    Some(Ok(())) => continue,
                    Some(Err(error)) if error.kind() != io::ErrorKind::UnexpectedEof => {
                        return Err(Error::io(&self.path, "read", error));
                    }
                    _ => return Err(cut(0, &records)),
                }
            }
            for done in 0..element.count {
                match records.next(element, &mut values) {
                    Ok(()) => {}
                    Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                        return Err(cut(done, &records));
                    }
                    Err(error) => return Err(Error::io(&self.path, "read", error)),
                }
                if is_wanted {
                    let value = |at: usize| values.get(at).copied().unwrap_or(f64::NAN);
                    let mut point = self.clock.point(&self.meaning, value);
                    self.attributes.set_in(&mut point, &mut self.values, value, |_| None);
                    visit(point)?;
                }
            }
        }
        Ok(())
    }
}

/// Reader of the elements of a binary file.
struct Records {
    input: BufReader<File>,
    at: u64,
    is_big: bool,
    bytes: Vec<u8>,
}

impl Records {
    /// Reads an element: one value per property, NaN for a list.
    fn next(&mut self, element: &Element, values: &mut Vec<f64>) -> io::Result<()> {
        values.clear();
        for property in &element.properties {
            match property.list {
                None => {
                    let value = self.value(property.kind)?;
                    values.push(value);
                }
                Some(count) => {
                    // A negative length is damage; the list is then empty.
                    let count = self.value(count)? as u64;
                    self.skip(count.saturating_mul(property.kind.bytes() as u64))?;
                    values.push(f64::NAN);
                }
            }
        }
        Ok(())
    }

    fn value(&mut self, kind: Scalar) -> io::Result<f64> {
        self.bytes.resize(kind.bytes(), 0);
        self.input.read_exact(&mut self.bytes)?;
        self.at += self.bytes.len() as u64;
        Ok(kind.value(&self.bytes, self.is_big))
    }

    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        let skipped = io::copy(&mut (&mut self.input).take(bytes), &mut io::sink())?;
        self.at = self.at.saturating_add(skipped);
        if skipped == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }
}
