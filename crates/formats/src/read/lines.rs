//! Reads the lines of a text of any size. The length of each line is bounded.

use super::foreign::text_encoding;
use super::input_file::open_input;
use super::text_line::comment_of;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Limit for a line. The words of a longer line would take a multiple of its size in memory.
pub(crate) const MAX_LINE_BYTES: usize = 1 << 16;

/// Extent of a line that was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    Whole,
    /// The line is longer than the limit.
    Start,
}

/// Reader of lines as bytes. Lines end with LF, CR LF or CR.
pub(crate) struct RawLines<R> {
    input: R,
    line: Vec<u8>,
    /// Limit for the bytes read at once from a line.
    max_bytes: usize,
    /// Whether the last line ended with CR. A following LF then belongs to the same line end.
    is_after_return: bool,
}

impl<R: BufRead> RawLines<R> {
    pub(crate) fn new(input: R, max_bytes: usize) -> Self {
        Self { input, line: Vec::new(), max_bytes, is_after_return: false }
    }

    /// Returns the current line without its end.
    pub(crate) fn line(&self) -> &[u8] {
        &self.line
    }

    /// Reads the next line, or the start of a long one. Returns `None` at the end of the input.
    pub(crate) fn next(&mut self) -> io::Result<Option<Extent>> {
        let Self { input, line, max_bytes, is_after_return } = self;
        line.clear();
        let mut has_read = false;
        loop {
            let chunk = match input.fill_buf() {
                Ok([]) => return Ok(has_read.then_some(Extent::Whole)),
                Ok(chunk) => chunk,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            if std::mem::take(is_after_return) && chunk.first() == Some(&b'\n') {
                input.consume(1);
                continue;
            }
            has_read = true;
            let part = chunk.get(..*max_bytes - line.len()).unwrap_or(chunk);
            let end = part.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            let (text, after) = part.split_at(end.unwrap_or(part.len()));
            line.extend_from_slice(text);
            *is_after_return = after.first() == Some(&b'\r');
            let taken = text.len() + usize::from(end.is_some());
            input.consume(taken);
            if end.is_some() {
                return Ok(Some(Extent::Whole));
            }
            if line.len() == *max_bytes {
                return Ok(Some(Extent::Start));
            }
        }
    }

    /// Skips the rest of a line of which the start was read.
    pub(crate) fn pass_rest(&mut self) -> io::Result<()> {
        while self.next()? == Some(Extent::Start) {}
        Ok(())
    }
}

/// Reader of the lines of a file.
pub(crate) struct Lines {
    path: PathBuf,
    lines: RawLines<Box<dyn BufRead + Send>>,
    number: u64,
}

impl Lines {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        Ok(Self::new(path, BufReader::with_capacity(1 << 16, open_input(path)?), 0))
    }

    /// Reads the rest of an input. `lines_before` is the number of lines already read.
    pub(crate) fn new(path: &Path, input: impl BufRead + Send + 'static, lines_before: u64) -> Self {
        let lines = RawLines::new(Box::new(input) as Box<dyn BufRead + Send>, MAX_LINE_BYTES);
        Self { path: path.to_owned(), lines, number: lines_before }
    }

    /// Returns the next line, without its end, and its number. Long comments are truncated.
    pub(crate) fn next(&mut self) -> Result<Option<(u64, String)>> {
        let Some(extent) = self.read()? else { return Ok(None) };
        if self.number == 1
            && let Some(encoding) = text_encoding(self.lines.line())
        {
            return Err(self.error(encoding));
        }
        let text = String::from_utf8_lossy(self.lines.line());
        let text = if self.number == 1 { text.trim_start_matches('\u{feff}') } else { &text }.to_owned();
        if extent == Extent::Start {
            if comment_of(&text).is_none() {
                return Err(self.error("the line is longer than 64 KiB: this is not a text file of numbers"));
            }
            self.pass_rest()?;
        }
        Ok(Some((self.number, text)))
    }

    /// Skips the next line that is not blank, whatever its length. Returns `false` at the end.
    pub(crate) fn pass(&mut self) -> Result<bool> {
        while let Some(extent) = self.read()? {
            if extent == Extent::Start {
                self.pass_rest()?;
                return Ok(true);
            }
            if !self.lines.line().trim_ascii().is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn read(&mut self) -> Result<Option<Extent>> {
        let extent = self.lines.next().map_err(|error| Error::io(&self.path, "read", error))?;
        self.number += u64::from(extent.is_some());
        Ok(extent)
    }

    fn pass_rest(&mut self) -> Result<()> {
        self.lines.pass_rest().map_err(|error| Error::io(&self.path, "read", error))
    }

    /// Returns the number of the current line.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Creates an error for the current line.
    pub(crate) fn error(&self, reason: impl Into<String>) -> Error {
        self.error_at(self.number, reason)
    }

    pub(crate) fn error_at(&self, line: u64, reason: impl Into<String>) -> Error {
        FormatError::at_line(line, reason).in_input(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_comments_are_skipped_and_long_lines_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let long = MAX_LINE_BYTES;
        let text =
            format!("# {}\n1 2\n%{}\n{}\n", "x".repeat(5 * long), "y".repeat(long - 2), "3 ".repeat(long));
        std::fs::write(file.path(), text).unwrap();
        let mut lines = Lines::open(file.path()).unwrap();
        let mut next = || lines.next().map(|line| line.map(|(number, line)| (number, line.len())));
        assert_eq!(next().unwrap(), Some((1, long)));
        assert_eq!(next().unwrap(), Some((2, 3)));
        assert_eq!(next().unwrap(), Some((3, long - 1)), "the limit is reached at the end of the line");
        let error = format!("{:#}", next().unwrap_err());
        assert!(error.contains("line 4: the line is longer than 64 KiB"), "{error}");
    }

    #[test]
    fn line_ends_of_all_systems_are_accepted() {
        let read = |text: &'static [u8]| {
            // A buffer of two bytes may split a line end.
            let mut lines = Lines::new(Path::new("a"), BufReader::with_capacity(2, text), 0);
            std::iter::from_fn(|| lines.next().unwrap()).collect::<Vec<_>>()
        };
        let wanted = [(1, "1 2".to_owned()), (2, String::new()), (3, "3".to_owned())];
        for text in [&b"1 2\n\n3\n"[..], b"1 2\r\n\r\n3", b"1 2\r\r3\r", b"\xef\xbb\xbf1 2\r\n\r3\r\n"] {
            assert_eq!(read(text), wanted, "{}", String::from_utf8_lossy(text));
        }
        assert_eq!(read(b""), []);
    }

    #[test]
    fn text_in_another_encoding_is_reported() {
        for text in [&b"\xff\xfe1\0 \0"[..], b"\xfe\xff\x001", b"1\0 \x002\0\r\0\n\0"] {
            let mut lines = Lines::new(Path::new("a"), text, 0);
            let error = format!("{:#}", lines.next().unwrap_err());
            assert!(error.contains("line 1: is text in UTF-16: save it as UTF-8"), "{error}");
        }
    }
}
