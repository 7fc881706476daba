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

/// A folder of `ros2 bag`: `metadata.yaml` and the files that it names, in order. Without one, all recordings in the
/// folder in the natural order of their names: the parts of a bag that `rosbag record --split` wrote.
pub struct Bag2Folder {
    files: Sequence,
    remarks: Vec<String>,
}

/// A longer `metadata.yaml` is an error.
const MAX_METADATA_BYTES: u64 = 8 << 20;

impl Bag2Folder {
    /// Opens a folder.
    ///
    /// # Errors
    ///
    /// A folder without files of a recording; a file that cannot be read or is invalid.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, &Budget::default())
    }

    /// As [`Bag2Folder::open`], in so much memory. Compressed files are unpacked into its folder for temporary files.
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
                let reason = format!("it is longer than {MAX_METADATA_BYTES} bytes; name the files instead");
                return Err(FormatError::at_offset(MAX_METADATA_BYTES, reason).in_input(&metadata_path));
            }
            let metadata = Bag2Metadata::of(&String::from_utf8_lossy(&text));
            let files = metadata.files.iter().map(|name| find(path, name)).collect::<Result<Vec<_>>>()?;
            (metadata, files)
        } else {
            (Bag2Metadata::default(), Vec::new())
        };
        let mut files = if files.is_empty() { files_of(path)? } else { files };
        // Each of a million names of one file would be a file of its own.
        let (named, mut seen) = (files.len(), HashSet::new());
        files.retain(|file| seen.insert(file.clone()));
        if files.len() < named {
            let again = named - files.len();
            remarks.push(format!(
                "{}: names of files occur again ({again}); each file is read once",
                metadata_path.display()
            ));
        }
        // Bags of ROS 1 have none.
        if !metadata_path.is_file() && !files.iter().all(|file| is_bag1(file)) {
            let path = path.display();
            remarks
                .push(format!("{path} has no metadata.yaml: its files are read in the order of their names"));
        }
        if files.is_empty() {
            let reason = "the folder holds no .mcap, .db3 or .bag file, and no metadata.yaml names one";
            return Err(Error::argument(path.display().to_string(), reason));
        }
        let format = metadata.compression_format.as_str();
        if !matches!(format, "" | "zstd") {
            let reason = format!("compression_format `{format}` is not read; known: zstd");
            return Err(FormatError::at_offset(0, reason).in_input(&metadata_path));
        }
        let mut recordings = Sequence::default();
        files.iter().try_for_each(|file| open_file(file, budget).map(|file| recordings.push(file)))?;
        Ok(Self { files: recordings, remarks })
    }
}

/// By its name; one that the recorder did not close ends with `.bag.active`.
fn is_bag1(file: &Path) -> bool {
    let name = file.to_string_lossy().to_lowercase();
    name.ends_with(".bag") || name.ends_with(".bag.active")
}

/// A file that the metadata name: beside them, perhaps behind the name of the folder, perhaps compressed since. Of one
/// that leads out of the folder only the last part counts.
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
                "metadata.yaml names {name}, which is not there; give the files that are there instead"
            ),
            false => format!(
                "metadata.yaml names {name}, which leads out of the folder and is not read; move the file into it"
            ),
        };
        Error::argument(folder.display().to_string(), reason)
    })
}

/// The files of recordings in a folder, in the natural order of their names.
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
