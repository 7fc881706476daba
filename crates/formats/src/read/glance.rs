use super::input_file::open_input;
use super::regular::check_regular;
use std::io::Read;
use std::path::Path;
use voxtile::{Error, Result};

/// Number of bytes used to identify a file.
pub(super) const GLANCE_BYTES: u64 = 1 << 13;

/// Reads the first bytes of a regular file.
pub(crate) fn first_bytes(path: &Path) -> Result<Vec<u8>> {
    check_regular(path)?;
    let mut start = Vec::new();
    let read = open_input(path)?.take(GLANCE_BYTES).read_to_end(&mut start);
    read.map_err(|error| Error::io(path, "read", error))?;
    Ok(start)
}
