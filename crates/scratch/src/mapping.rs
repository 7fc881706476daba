//! The one place that maps files.

use memmap2::{Mmap, MmapOptions};
use std::fs::File;
use std::io;

/// Maps a part of a file, read-only.
///
/// The file must have no name, be no other process's, never get shorter, and never change where it was written: a
/// [`ScratchFile`](crate::ScratchFile) only appends.
#[expect(unsafe_code, reason = "nobody else can cut or change the file below the mapping")]
pub(crate) fn map(file: &File, at: u64, bytes: usize) -> io::Result<Mmap> {
    // SAFETY: see above.
    unsafe { MmapOptions::new().offset(at).len(bytes).map(file) }
}
