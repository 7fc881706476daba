//! Lines of a text of any size, each of bounded length.

use crate::error::{Error, Place, Result};
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// A longer line is an error.
const MOST_LINE_BYTES: u64 = 1 << 20;

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
            .take(MOST_LINE_BYTES)
            .read_until(b'\n', &mut self.line)
            .map_err(|error| Error::io(&self.path, "read", error))?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        if read as u64 == MOST_LINE_BYTES {
            return Err(self.error("the line is longer than a megabyte: this is no text of numbers"));
        }
        let text = String::from_utf8_lossy(&self.line);
        let text = if self.number == 1 { text.trim_start_matches('\u{feff}') } else { &text };
        Ok(Some((self.number, text.trim_end_matches(['\r', '\n']).to_owned())))
    }

    /// An error of the line that was read last.
    pub(crate) fn error(&self, reason: impl Into<String>) -> Error {
        Error::format(&self.path, Place::Line(self.number), reason)
    }
}
