//! Lines of a text of any size, each of bounded length.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// A longer line is an error: its words would take many times its bytes.
pub(crate) const MAX_LINE_BYTES: u64 = 1 << 16;

/// Lines of a file, one at a time.
pub(crate) struct Lines {
    path: PathBuf,
    input: Box<dyn BufRead + Send>,
    line: Vec<u8>,
    number: u64,
}

impl Lines {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
        Ok(Self::new(path, BufReader::with_capacity(1 << 16, file), 0))
    }

    /// The lines of what is left of an input, after so many lines.
    pub(crate) fn new(path: &Path, input: impl BufRead + Send + 'static, lines_before: u64) -> Self {
        Self { path: path.to_owned(), input: Box::new(input), line: Vec::new(), number: lines_before }
    }

    /// The next line without its end, and its number. Of a long comment only the start is read.
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
        if self.is_cut() {
            if !is_comment(&self.line) {
                return Err(self.error("the line is longer than 64 KiB: this is no text of numbers"));
            }
            self.input.skip_until(b'\n').map_err(|error| Error::io(&self.path, "read", error))?;
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
            let is_long = self.is_cut();
            if is_long {
                self.input.skip_until(b'\n').map_err(fail)?;
            }
            if is_long || !self.line.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }

    /// Whether the line goes on behind what was read of it.
    fn is_cut(&self) -> bool {
        self.line.len() as u64 == MAX_LINE_BYTES && self.line.last() != Some(&b'\n')
    }

    /// An error of the line that was read last.
    pub(crate) fn error(&self, reason: impl Into<String>) -> Error {
        FormatError::at_line(self.number, reason).in_input(&self.path)
    }
}

/// Whether a line starts as comments do in the texts that are read.
fn is_comment(line: &[u8]) -> bool {
    let start = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii_start();
    [&b"#"[..], b"%", b"//"].iter().any(|mark| start.starts_with(mark))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_comments_are_skipped_and_long_lines_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let long = MAX_LINE_BYTES as usize;
        let text =
            format!("# {}\n1 2\n%{}\n{}\n", "x".repeat(5 * long), "y".repeat(long - 2), "3 ".repeat(long));
        std::fs::write(file.path(), text).unwrap();
        let mut lines = Lines::open(file.path()).unwrap();
        let mut next = || lines.next().map(|line| line.map(|(number, line)| (number, line.len())));
        assert_eq!(next().unwrap(), Some((1, long)));
        assert_eq!(next().unwrap(), Some((2, 3)));
        assert_eq!(next().unwrap(), Some((3, long - 1)), "its end is in the last byte");
        let error = format!("{:#}", next().unwrap_err());
        assert!(error.contains("line 4: the line is longer than 64 KiB"), "{error}");
    }
}
