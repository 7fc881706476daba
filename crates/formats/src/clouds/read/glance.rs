use super::regular::check_regular;
use super::text_line::{Columns, Line};
use crate::clouds::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// How much of a file is read to identify it.
const GLANCE_BYTES: u64 = 1 << 13;

/// The first bytes of a file.
pub(super) fn first_bytes(path: &Path) -> Result<Vec<u8>> {
    check_regular(path)?;
    let mut start = Vec::new();
    File::open(path)
        .and_then(|file| file.take(GLANCE_BYTES).read_to_end(&mut start))
        .map_err(|error| Error::io(path, "read", error))?;
    Ok(start)
}

/// Whether a file that starts like this is a text of points.
pub(super) fn looks_like_text_points(start: &[u8]) -> bool {
    if start.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(start);
    let is_cut = start.len() as u64 == GLANCE_BYTES;
    let mut lines: Vec<&str> = text.lines().collect();
    if is_cut && lines.len() > 1 {
        lines.pop();
    }
    let mut columns = Columns::default();
    for line in lines {
        match columns.take(line) {
            Ok(Line::Point(_)) => return true,
            Ok(Line::Nothing) => {}
            Err(_) => return false,
        }
    }
    // Names alone: a text without points yet.
    columns.are_named()
}
