use super::input_file::open_input;
use super::regular::check_regular;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Classes of the points of a `.bin` file, as in SemanticKITTI: `labels/000000.label` next to the folder of
/// `velodyne/000000.bin`. Each point has 32 bits: the class, then the number of an object.
pub(super) struct LabelFile {
    path: PathBuf,
    input: BufReader<File>,
}

const LABEL_BYTES: u64 = 4;

impl LabelFile {
    /// Opens the label file of a file with this number of points. Returns `None` if there is none.
    ///
    /// # Errors
    ///
    /// The label file cannot be read, or has another number of points.
    pub(super) fn open_for(points_path: &Path, points: u64) -> Result<Option<Self>> {
        let Some(name) = points_path.file_stem() else { return Ok(None) };
        let folder = points_path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).join("..").join("labels");
        let path = folder.join(name).with_extension("label");
        check_regular(&path)?;
        if !path.is_file() {
            return Ok(None);
        }
        let file = open_input(&path)?;
        let bytes = file.metadata().map_err(|error| Error::io(&path, "read", error))?.len();
        if Some(bytes) != points.checked_mul(LABEL_BYTES) {
            let reason = format!(
                "has {bytes} bytes, but the {points} points of {} have {LABEL_BYTES} bytes each: it belongs to another \
                 scan or is truncated",
                points_path.display()
            );
            return Err(FormatError::at_offset(bytes, reason).in_input(&path));
        }
        Ok(Some(Self { path, input: BufReader::with_capacity(1 << 16, file) }))
    }

    /// Returns the class number of the next point.
    pub(super) fn next(&mut self) -> Result<u16> {
        let mut label = [0; LABEL_BYTES as usize];
        self.input.read_exact(&mut label).map_err(|error| Error::io(&self.path, "read", error))?;
        let [low, high, ..] = label;
        Ok(u16::from_le_bytes([low, high]))
    }
}
