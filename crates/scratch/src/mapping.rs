//! The one place that maps files.

use memmap2::{Mmap, MmapOptions, UncheckedAdvice};
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

/// Gives the pages of a mapping back. They stay in the system's cache, and count as this process's memory no more.
#[cfg(unix)]
#[expect(unsafe_code, reason = "pages of a file that is only read come back with the same content")]
pub(crate) fn forget_pages(mapping: &Mmap) {
    // SAFETY: the mapping is shared and read-only, so that no byte is lost.
    // A system that refuses keeps the pages.
    let _ = unsafe { mapping.unchecked_advise(UncheckedAdvice::DontNeed) };
}

#[cfg(not(unix))]
pub(crate) fn forget_pages(_: &Mmap) {}
