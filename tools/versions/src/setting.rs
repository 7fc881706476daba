use crate::versions::Versions;
use std::path::PathBuf;

/// What all questions are put to.
pub struct Setting {
    /// Both versions.
    pub versions: Versions,
    /// The folder of recorded data sets.
    pub data: PathBuf,
    /// An empty folder for streams and maps.
    pub work: PathBuf,
    /// Whether it is only to be seen that everything works.
    pub is_short: bool,
}
