use crate::versions::Versions;
use std::path::PathBuf;

/// Inputs of all questions.
pub struct Setting {
    pub versions: Versions,
    /// The folder of recorded data sets.
    pub data: PathBuf,
    /// An empty folder for streams and maps.
    pub work: PathBuf,
    /// Whether to check only that everything works.
    pub is_short: bool,
}
