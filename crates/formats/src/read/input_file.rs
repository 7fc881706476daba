use super::foreign::stand_in;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;
use voxtile::{Error, Result};

/// How much of a file is read to see whether it is what its name says.
const GLANCE_BYTES: u64 = 512;

/// Opens a file of an input, of any format. All readers open their files here, so that a pointer of Git LFS or a page
/// of HTML in place of the file is named as what it is.
///
/// # Errors
///
/// A file that cannot be opened; something else in its place.
pub(crate) fn open_input(path: &Path) -> Result<File> {
    let fail = |error: io::Error| Error::io(path, "read", error);
    let mut file = File::open(path).map_err(fail)?;
    // A pipe gives its bytes only once.
    if !file.metadata().map_err(fail)?.is_file() {
        return Ok(file);
    }
    let mut start = Vec::new();
    (&mut file).take(GLANCE_BYTES).read_to_end(&mut start).map_err(fail)?;
    if let Some(what) = stand_in(&start) {
        return Err(Error::argument(path.display().to_string(), what));
    }
    file.rewind().map_err(fail)?;
    Ok(file)
}
