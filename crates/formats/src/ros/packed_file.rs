use super::chunk::unpacker;
use super::open::open_plain_file;
use super::recording::{Message, Recording, Topic};
use crate::read::listing::extension_of;
use crate::read::open_input;
use crate::spill::{Budget, SpillFile};
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use voxtile::{Error, FormatError, Result};

/// Recording file that is compressed as a whole (`a.mcap.zstd`). It is decompressed into a temporary folder, which is
/// removed with this value.
pub(super) struct PackedFile {
    recording: Box<dyn Recording>,
    remark: Option<String>,
    _unpacked: TempDir,
}

/// Extensions of such files.
const EXTENSIONS: [&str; 2] = ["zstd", "zst"];
/// Zstandard signature.
pub(super) const MAGIC: &[u8] = b"\x28\xb5\x2f\xfd";

/// Returns whether the extension marks a file as compressed.
pub(super) fn is_packed(path: &Path) -> bool {
    EXTENSIONS.contains(&extension_of(path).as_str())
}

impl PackedFile {
    pub(super) fn open(path: &Path, budget: &Budget) -> Result<Self> {
        let scratch = budget.scratch.clone().unwrap_or_else(std::env::temp_dir);
        let folder = tempfile::tempdir_in(&scratch)
            .map_err(|error| Error::io(&scratch, "unpack a recording into", error))?;
        let (plain, damage) = unpack(path, folder.path(), budget)?;
        let damaged = damage.map(|damage| format!("it is truncated or damaged ({damage})"));
        // The name of the temporary file would not help the user.
        let recording = open_plain_file(&plain, budget).map_err(|error| {
            let damaged = damaged.as_deref().unwrap_or("it was unpacked");
            let reason = format!("{damaged}, but its contents cannot be read: {error:#}");
            FormatError::at_offset(0, reason).in_input(path)
        })?;
        let remark =
            damaged.map(|damaged| format!("{}: {damaged}; the readable part is used", path.display()));
        Ok(Self { recording, remark, _unpacked: folder })
    }
}

/// Decompresses a file. If it is damaged, the readable part is kept and the reason is returned.
fn unpack(file: &Path, folder: &Path, budget: &Budget) -> Result<(PathBuf, Option<String>)> {
    let target = folder.join(file.file_stem().unwrap_or_default());
    let input = open_input(file)?;
    let mut output = File::create(&target).map_err(|error| Error::io(&target, "write", error))?;
    let spill = SpillFile::new(budget);
    let mut decoder =
        unpacker(BufReader::new(input), &spill).map_err(|error| Error::io(file, "unpack", error))?;
    let mut bytes = vec![0; 1 << 16];
    loop {
        match decoder.read(&mut bytes) {
            Ok(0) => return Ok((target, None)),
            Ok(count) => {
                let taken = bytes.get(..count).unwrap_or_default();
                output.write_all(taken).map_err(|error| Error::io(&target, "write", error))?;
            }
            Err(error) => return Ok((target, Some(error.to_string()))),
        }
    }
}

impl Recording for PackedFile {
    fn format(&self) -> &str {
        self.recording.format()
    }

    fn topics(&self) -> &[Topic] {
        self.recording.topics()
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.recording.begin(topics)
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        self.recording.next_message()
    }

    fn close_files(&mut self) {
        self.recording.close_files();
    }

    fn remarks(&self) -> Vec<String> {
        self.remark.iter().cloned().chain(self.recording.remarks()).collect()
    }
}
