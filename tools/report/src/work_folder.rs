use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder for the maps and streams of a benchmark, empty at first and removed at the end.
#[derive(Debug)]
pub struct WorkFolder(PathBuf);

/// Marks a folder of a benchmark, which may be removed.
const MARKER: &str = ".benchmark";

impl WorkFolder {
    /// Creates the folder, or empties one of an earlier run.
    ///
    /// # Errors
    ///
    /// Fails if the folder has other content or cannot be emptied.
    pub fn create(path: PathBuf) -> Result<Self> {
        ensure!(
            !path.exists() || path.join(MARKER).exists(),
            "{}: already exists and is not a benchmark folder; remove it or choose another target folder",
            path.display()
        );
        let folder = Self(path);
        folder.empty()?;
        Ok(folder)
    }

    /// Removes the content.
    ///
    /// # Errors
    ///
    /// Fails if the content cannot be removed.
    pub fn empty(&self) -> Result<()> {
        let path = &self.0;
        let emptied = || {
            if path.exists() {
                fs::remove_dir_all(path)?;
            }
            fs::create_dir_all(path)?;
            fs::write(path.join(MARKER), "")
        };
        emptied().with_context(|| format!("{}: cannot empty the folder", path.display()))
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.0) {
            eprintln!("{}: cannot remove the folder: {error}", self.0.display());
        }
    }
}
