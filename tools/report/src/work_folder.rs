use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder for the maps and streams of a benchmark, empty at first and removed at the end.
#[derive(Debug)]
pub struct WorkFolder(PathBuf);

/// Tells a folder that a run left from one that somebody needs.
const MARKER: &str = ".benchmark";

impl WorkFolder {
    /// Takes a folder that does not exist yet or that an earlier run left.
    ///
    /// # Errors
    ///
    /// A folder with something else in it, and one that cannot be emptied.
    pub fn create(path: PathBuf) -> Result<Self> {
        ensure!(
            !path.exists() || path.join(MARKER).exists(),
            "{}: there is something else already; remove it, or name another target folder",
            path.display()
        );
        let folder = Self(path);
        folder.empty()?;
        Ok(folder)
    }

    /// Removes what is in it.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
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

    /// Where it is.
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
