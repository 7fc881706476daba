use anyhow::{Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The programs of one version.
pub struct Programs {
    folder: PathBuf,
}

impl Programs {
    /// The programs in a folder.
    ///
    /// # Errors
    ///
    /// A program that is missing.
    pub fn in_folder(folder: &Path) -> Result<Self> {
        for name in ["voxtile", "voxtile_contender", "questions"] {
            let program = folder.join(name);
            ensure!(program.is_file(), "{}: missing; tools/bench.sh versions builds it", program.display());
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// A program of this version with its arguments, on so many threads.
    pub fn command(&self, name: &str, threads: usize) -> Command {
        let mut command = Command::new(self.folder.join(name));
        command.env("RAYON_NUM_THREADS", threads.to_string());
        command
    }
}
