use std::fs::File;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};
use voxtile_scratch::ScratchFile;

/// How much memory a reader may take. What exceeds it goes to temporary files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Bytes of memory for what grows with the input.
    pub bytes: usize,
    /// Folder of temporary files; the system's own if `None`.
    pub scratch: Option<PathBuf>,
}

impl Default for Budget {
    fn default() -> Self {
        Self { bytes: Self::DEFAULT_BYTES, scratch: None }
    }
}

impl Budget {
    /// The memory of a reader that is given none.
    pub const DEFAULT_BYTES: usize = 64 << 20;

    /// Bytes that a message, or another part of a file that cannot be read piece by piece, may take on top.
    #[cfg(any(feature = "las", feature = "e57", feature = "ros"))]
    const WHOLE_BYTES: u64 = 12 << 20;

    /// The largest part of a file that is held in memory whole.
    #[cfg(any(feature = "las", feature = "e57", feature = "ros"))]
    pub(crate) fn whole_bytes(&self) -> u64 {
        Self::WHOLE_BYTES.saturating_add(self.bytes as u64)
    }

    /// The base-2 logarithm of the largest window of zstd. Every decoder takes 8 MiB.
    #[cfg(feature = "ros")]
    pub(crate) fn window_log(&self) -> u32 {
        self.bytes.saturating_mul(2).checked_ilog2().unwrap_or(0).clamp(23, 27)
    }

    /// An unnamed file, which is freed with its last handle.
    pub(crate) fn file(&self) -> Result<File> {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        tempfile::tempfile_in(&folder).map_err(|error| self.cannot("make", error))
    }

    /// A file that is read as memory.
    pub(crate) fn scratch_file(&self) -> Result<ScratchFile> {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        ScratchFile::in_folder(&folder).map_err(|error| self.cannot("make", error))
    }

    /// An error of a temporary file.
    pub(crate) fn cannot(&self, what: &'static str, error: std::io::Error) -> Error {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        cannot(&folder, what, error)
    }
}

/// An error of a temporary file in a folder.
pub(super) fn cannot(folder: &Path, what: &'static str, error: std::io::Error) -> Error {
    let action = match what {
        "make" => "make a temporary file in",
        "write" => "write a temporary file in",
        _ => "read a temporary file in",
    };
    Error::io(folder, action, error)
}
