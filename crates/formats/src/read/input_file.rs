use super::foreign::stand_in;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;
use voxtile::{Error, Result};

/// Number of bytes used to detect placeholders.
const GLANCE_BYTES: u64 = 512;

/// Opens an input file of any format. All readers open their files with this function, so that Git LFS pointers and
/// HTML pages stored instead of a file are reported as such.
///
/// # Errors
///
/// The file cannot be opened, or a placeholder is stored instead.
pub fn open_input(path: &Path) -> Result<File> {
    let fail = |error: io::Error| Error::io(path, "read", error);
    let mut file = File::open(path).map_err(fail)?;
    // A pipe cannot be read twice.
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
