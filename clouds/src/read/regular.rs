use crate::error::{Error, Result};
use std::path::Path;

/// Checks that a path is no FIFO, socket or device: opening one waits for a program that writes, perhaps for ever, and
/// gives its bytes once. What is not there is reported when it is opened.
pub(crate) fn check_regular(path: &Path) -> Result<()> {
    let is_special = std::fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
    if !is_special {
        return Ok(());
    }
    let reason = "is a FIFO, a socket or a device, not a file: save what it gives to a file; or name it alone, with \
                  --format ply or --format xyz, which are read as they come";
    Err(Error::argument(path.display().to_string(), reason))
}
