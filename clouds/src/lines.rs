//! Lines of a text of any size, each of bounded length.

use crate::error::{Error, Place, Result};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// A longer line is an error: its words would take many times its bytes.
pub(crate) const MAX_LINE_BYTES: u64 = 1 << 16;

/// Lines of a file, one at a time.
pub(crate) struct Lines {
    path: PathBuf,
    input: BufReader<File>,
    line: Vec<u8>,
    number: u64,
}

impl Lines {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
        Ok(Self::new(path, BufReader::with_capacity(1 << 16, file), 0))
    }

    /// The lines of what is left of an input, after so many lines.
    pub(crate) fn new(path: &Path, input: BufReader<File>, lines_before: u64) -> Self {
        Self { path: path.to_owned(), input, line: Vec::new(), number: lines_before }
    }

    /// The next line without its end, and its number.
    pub(crate) fn next(&mut self) -> Result<Option<(u64, String)>> {
        self.line.clear();
        let read = (&mut self.input)
            .take(MAX_LINE_BYTES)
            .read_until(b'\n', &mut self.line)
            .map_err(|error| Error::io(&self.path, "read", error))?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        if read as u64 == MAX_LINE_BYTES {
            return Err(self.error("the line is longer than 64 KiB: this is no text of numbers"));
        }
        let text = String::from_utf8_lossy(&self.line);
        let text = if self.number == 1 { text.trim_start_matches('\u{feff}') } else { &text };
        Ok(Some((self.number, text.trim_end_matches(['\r', '\n']).to_owned())))
    }

    /// Passes over the next line that is not blank, of any length; `false` at the end.
    pub(crate) fn pass(&mut self) -> Result<bool> {
        let fail = |error| Error::io(&self.path, "read", error);
        loop {
            self.line.clear();
            let mut start = (&mut self.input).take(MAX_LINE_BYTES);
            let read = start.read_until(b'\n', &mut self.line).map_err(fail)?;
            if read == 0 {
                return Ok(false);
            }
            self.number += 1;
            let is_long = read as u64 == MAX_LINE_BYTES && self.line.last() != Some(&b'\n');
            if is_long {
                self.input.skip_until(b'\n').map_err(fail)?;
            }
            if is_long || !self.line.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }

    /// An error of the line that was read last.
    pub(crate) fn error(&self, reason: impl Into<String>) -> Error {
        Error::format(&self.path, Place::Line(self.number), reason)
    }
}
