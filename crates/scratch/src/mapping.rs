//! Memory mapping of files, the only unsafe code.

use memmap2::{Mmap, MmapOptions};
use std::fs::File;
use std::io;

/// Maps a part of a file, read-only.
///
/// The file must be unnamed, not shared with other processes, never truncated, and never changed where it was written.
/// A [`ScratchFile`](crate::ScratchFile) only appends.
#[expect(unsafe_code, reason = "no other process can access the file, and its owner only appends")]
pub(crate) fn map(file: &File, at: u64, bytes: usize) -> io::Result<Mmap> {
    // SAFETY: no other process can access the file, and its owner only appends, as required above.
    unsafe { MmapOptions::new().offset(at).len(bytes).map(file) }
}
