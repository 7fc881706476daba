use super::bag2_metadata::Bag2Metadata;
use super::open::open_file;
use super::recording::{Message, Recording, Topic};
use super::sequence::Sequence;
use crate::read::inside::is_inside;
use crate::spill::Budget;
use std::collections::HashSet;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// rosbag2 folder: `metadata.yaml` and the files listed in it, in order. Without that file, all recordings of the
/// folder in natural order of their names, as written by `rosbag record --split`.
pub struct Bag2Folder {
    files: Sequence,
    remarks: Vec<String>,
}

/// Limit for the size of `metadata.yaml`.
const MAX_METADATA_BYTES: u64 = 8 << 20;

impl Bag2Folder {
    /// Opens a folder.
    ///
    /// # Errors
    ///
    /// The folder contains no recording, or a file cannot be read or is invalid.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, &Budget::default())
    }

    /// As [`Bag2Folder::open`], within a memory budget. Compressed files are decompressed into the folder for temporary
    /// files.
    ///
    /// # Errors
    ///
    /// As for [`Bag2Folder::open`].
    pub fn open_within(path: &Path, budget: &Budget) -> Result<Self> {
        let mut remarks = Vec::new();
        let metadata_path = path.join("metadata.yaml");
        let (metadata, files) = if metadata_path.is_file() {
            let file =
                File::open(&metadata_path).map_err(|error| Error::io(&metadata_path, "read", error))?;
            let mut text = Vec::new();
            let read = file.take(MAX_METADATA_BYTES + 1).read_to_end(&mut text);
            read.map_err(|error| Error::io(&metadata_path, "read", error))?;
            if text.len() as u64 > MAX_METADATA_BYTES {
                let reason = format!(
                    "it is longer than {MAX_METADATA_BYTES} bytes; use the recordings in the folder \
                                      as inputs instead"
                );
                return Err(FormatError::at_offset(MAX_METADATA_BYTES, reason).in_input(&metadata_path));
            }
            let metadata = Bag2Metadata::of(&String::from_utf8_lossy(&text));
            let files = metadata.files.iter().map(|name| find(path, name)).collect::<Result<Vec<_>>>()?;
            (metadata, files)
        } else {
            (Bag2Metadata::default(), Vec::new())
        };
        let mut files = if files.is_empty() { files_of(path)? } else { files };
        // Drop repeated names: a damaged list could name one file a million times.
        let (named, mut seen) = (files.len(), HashSet::new());
        files.retain(|file| seen.insert(file.clone()));
        if files.len() < named {
            let again = named - files.len();
            remarks.push(format!(
                "{}: file names are repeated ({again} times); each file is read once",
                metadata_path.display()
            ));
        }
        // ROS 1 bags have no metadata file.
        if !metadata_path.is_file() && !files.iter().all(|file| is_bag1(file)) {
            let path = path.display();
            remarks.push(format!("{path} has no metadata.yaml: its files are read in order of their names"));
        }
        if files.is_empty() {
            let reason =
                "the folder contains no .mcap, .db3 or .bag file, and no metadata.yaml that lists one";
            return Err(Error::argument(path.display().to_string(), reason));
        }
        let format = metadata.compression_format.as_str();
        if !matches!(format, "" | "zstd") {
            let reason = format!("compression_format `{format}` is not supported; supported: zstd");
            return Err(FormatError::at_offset(0, reason).in_input(&metadata_path));
        }
        let mut recordings = Sequence::default();
        files.iter().try_for_each(|file| open_file(file, budget).map(|file| recordings.push(file)))?;
        Ok(Self { files: recordings, remarks })
    }
}

/// Detected by name. A bag that the recorder did not close ends with `.bag.active`.
fn is_bag1(file: &Path) -> bool {
    let name = file.to_string_lossy().to_lowercase();
    name.ends_with(".bag") || name.ends_with(".bag.active")
}

/// Finds a file listed in the metadata: in the folder, possibly with the folder's name prepended, possibly compressed
/// later. For a path outside of the folder only its last component is used.
fn find(folder: &Path, name: &str) -> Result<PathBuf> {
    let is_inside = is_inside(Path::new(name));
    let whole = is_inside.then(|| folder.join(name));
    let last = Path::new(name).file_name().map(|name| folder.join(name));
    let candidates = [whole, last];
    let candidates = candidates.into_iter().flatten().flat_map(|path| {
        let packed = PathBuf::from(format!("{}.zstd", path.display()));
        [path, packed]
    });
    candidates.into_iter().find(|path| path.is_file()).ok_or_else(|| {
        let reason = match is_inside {
            true => format!(
                "metadata.yaml lists {name}, which does not exist; use the existing files as inputs instead"
            ),
            false => format!(
                "metadata.yaml lists {name}, which is outside of the folder and is not read; move the file into the \
                 folder"
            ),
        };
        Error::argument(folder.display().to_string(), reason)
    })
}

/// Returns the recordings in a folder, in natural order of their names.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let wrong = |error| Error::io(folder, "read", error);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        let name = path.to_string_lossy().to_lowercase();
        let name = [".zstd", ".zst"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(&name);
        if path.is_file()
            && (is_bag1(Path::new(name)) || [".mcap", ".db3"].iter().any(|known| name.ends_with(known)))
        {
            files.push(path);
        }
    }
    alphanumeric_sort::sort_path_slice(&mut files);
    Ok(files)
}

impl Recording for Bag2Folder {
    fn format(&self) -> &str {
        self.files.format()
    }

    fn topics(&self) -> &[Topic] {
        self.files.topics()
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.files.begin(topics)
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        self.files.next_message()
    }

    fn close_files(&mut self) {
        self.files.close_files();
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.iter().cloned().chain(self.files.remarks()).collect()
    }
}
