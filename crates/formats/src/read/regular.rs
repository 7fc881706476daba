use super::listing::extension_of;
use crate::input_format::Open;
use crate::registry::Registry;
use std::path::Path;
use voxtile::{Error, Result};

/// Checks that a path is not a FIFO, socket or device: opening one may block, and it can be read only once. A missing
/// file is reported when it is opened.
pub(crate) fn check_regular(path: &Path) -> Result<()> {
    let is_special = std::fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
    if !is_special {
        return Ok(());
    }
    // The hint applies to formats that read a single cloud in one pass.
    let extension = extension_of(path);
    let is_streamed = extension.is_empty()
        || (Registry::default().formats().iter())
            .any(|format| matches!(format.open, Open::Stream(_)) && format.has_extension(&extension));
    let hint = "; or use it as the only input with `format` ply or `format` xyz, which are read in one pass";
    let reason = format!(
        "is a FIFO, a socket or a device, not a file: save its contents to a file{}",
        if is_streamed { hint } else { "" }
    );
    Err(Error::argument(path.display().to_string(), reason))
}
