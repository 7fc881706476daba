use anyhow::{Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The programs of one version.
pub struct Programs {
    folder: PathBuf,
}

impl Programs {
    /// Finds the programs in a folder.
    ///
    /// # Errors
    ///
    /// Fails if a program is missing.
    pub fn in_folder(folder: &Path) -> Result<Self> {
        for name in ["voxtile", "voxtile_contender", "questions"] {
            let program = folder.join(name);
            ensure!(
                program.is_file(),
                "{}: missing; build it with tools/bench.sh versions",
                program.display()
            );
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// A command for a program of this version, with a number of threads.
    pub fn command(&self, name: &str, threads: usize) -> Command {
        let mut command = Command::new(self.folder.join(name));
        command.env("RAYON_NUM_THREADS", threads.to_string());
        command
    }
}
