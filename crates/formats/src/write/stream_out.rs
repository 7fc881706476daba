use super::{Error, Result};
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Output stream. Its errors contain the name of the output.
pub(super) struct StreamOut<'a> {
    name: PathBuf,
    out: Box<dyn Write + 'a>,
}

impl<'a> StreamOut<'a> {
    pub(super) fn new(name: &Path, out: Box<dyn Write + 'a>) -> Self {
        Self { name: name.to_owned(), out }
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|error| Error::io(&self.name, "write", error))
    }

    /// Called by `write!`.
    pub(super) fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> Result<()> {
        self.out.write_fmt(text).map_err(|error| Error::io(&self.name, "write", error))
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.out.flush().map_err(|error| Error::io(&self.name, "write", error))
    }
}
