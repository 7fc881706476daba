use std::fs::File;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};
use voxtile_scratch::ScratchFile;

/// Memory budget of a reader. Data beyond it goes to temporary files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Memory for data that grows with the input, in bytes.
    pub bytes: usize,
    /// Folder for temporary files. `None`: the system's.
    pub scratch: Option<PathBuf>,
}

impl Default for Budget {
    fn default() -> Self {
        Self { bytes: Self::DEFAULT_BYTES, scratch: None }
    }
}

impl Budget {
    /// Default budget of a reader.
    pub const DEFAULT_BYTES: usize = 64 << 20;

    /// Additional memory for messages and other parts of a file that can only be read as a whole.
    #[cfg(any(feature = "las", feature = "e57", feature = "ros"))]
    const WHOLE_BYTES: u64 = 12 << 20;

    /// Returns the maximum size of a part of a file to hold in memory as a whole.
    #[cfg(any(feature = "las", feature = "e57", feature = "ros"))]
    pub(crate) fn whole_bytes(&self) -> u64 {
        Self::WHOLE_BYTES.saturating_add(self.bytes as u64)
    }

    /// Returns the base-2 logarithm of the largest accepted zstd window. Every decoder supports 8 MiB.
    #[cfg(feature = "ros")]
    pub(crate) fn window_log(&self) -> u32 {
        self.bytes.saturating_mul(2).checked_ilog2().unwrap_or(0).clamp(23, 27)
    }

    /// Creates an unnamed temporary file, which is freed with its last handle.
    pub(crate) fn file(&self) -> Result<File> {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        tempfile::tempfile_in(&folder).map_err(|error| self.cannot("make", error))
    }

    /// Creates a temporary file that is read through memory mappings.
    pub(crate) fn scratch_file(&self) -> Result<ScratchFile> {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        ScratchFile::in_folder(&folder).map_err(|error| self.cannot("make", error))
    }

    /// Creates the error for a temporary file.
    pub(crate) fn cannot(&self, what: &'static str, error: std::io::Error) -> Error {
        let folder = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        cannot(&folder, what, error)
    }
}

/// Creates the error for a temporary file in a folder.
pub(super) fn cannot(folder: &Path, what: &'static str, error: std::io::Error) -> Error {
    let action = match what {
        "make" => "make a temporary file in",
        "write" => "write a temporary file in",
        _ => "read a temporary file in",
    };
    Error::io(folder, action, error)
}
