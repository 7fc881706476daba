use super::bag1::Bag1;
use super::bag2_folder::Bag2Folder;
use super::mcap_file::McapFile;
use super::packed_file::{MAGIC, PackedFile, is_packed};
use super::packed_messages::PackedMessages;
use super::recording::Recording;
use super::sequence::Sequence;
use crate::read::glance::first_bytes;
use crate::read::listing::extension_of;
use crate::registry::Registry;
use crate::spill::Budget;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Opens a recording: a file, a ROS 2 bag folder, or several recordings that follow each other in time.
///
/// # Errors
///
/// `paths` is empty, or a file cannot be read or is not a recording.
pub fn open_recording(paths: &[PathBuf]) -> Result<Box<dyn Recording>> {
    open_recording_within(paths, &Budget::default())
}

/// As [`open_recording`], within a memory budget.
///
/// # Errors
///
/// As for [`open_recording`].
pub fn open_recording_within(paths: &[PathBuf], budget: &Budget) -> Result<Box<dyn Recording>> {
    let open = |path: &PathBuf| -> Result<Box<dyn Recording>> {
        match path.is_dir() {
            true => Ok(Box::new(Bag2Folder::open_within(path, budget)?)),
            false => open_file(path, budget),
        }
    };
    match paths {
        [] => Err(Error::argument("recording", "no file was given")),
        [path] => open(path),
        paths => {
            let mut parts = Sequence::default();
            paths.iter().try_for_each(|path| open(path).map(|part| parts.push(part)))?;
            Ok(Box::new(parts))
        }
    }
}

/// Opens a file, which may be compressed as a whole.
pub(super) fn open_file(path: &Path, budget: &Budget) -> Result<Box<dyn Recording>> {
    match is_packed(path) || first_bytes(path)?.starts_with(MAGIC) {
        true => Ok(Box::new(PackedFile::open(path, budget)?)),
        false => open_plain_file(path, budget),
    }
}

/// Opens an uncompressed file. Its format is detected from the first bytes or, if these are damaged, from the
/// extension.
pub(super) fn open_plain_file(path: &Path, budget: &Budget) -> Result<Box<dyn Recording>> {
    let formats = Registry::default();
    let (start, extension) = (first_bytes(path)?, extension_of(path));
    let recordings = ["bag", "mcap", "db3"];
    let by_start =
        formats.of_start(&start).map(|format| format.name).filter(|name| recordings.contains(name));
    let mut named = formats.formats().iter().filter(|format| format.has_extension(&extension));
    match by_start.or_else(|| named.next().map(|format| format.name)) {
        Some("bag") => Ok(Box::new(Bag1::open_within(path, budget)?)),
        Some("mcap") => Ok(Box::new(PackedMessages::new(McapFile::open_within(path, budget)?, path, budget))),
        Some("db3") => open_db3(path, budget),
        _ => {
            let reason = "it is not a supported recording; supported: .bag, .mcap, .db3, or a folder with \
                          metadata.yaml";
            Err(Error::argument(path.display().to_string(), reason))
        }
    }
}

#[cfg(feature = "sqlite")]
fn open_db3(path: &Path, budget: &Budget) -> Result<Box<dyn Recording>> {
    Ok(Box::new(PackedMessages::new(super::db3::Db3::open_within(path, budget)?, path, budget)))
}

#[cfg(not(feature = "sqlite"))]
fn open_db3(path: &Path, _: &Budget) -> Result<Box<dyn Recording>> {
    let reason =
        "this build does not support SQLite (feature `sqlite`): convert it to .mcap with `ros2 bag convert`";
    Err(Error::argument(path.display().to_string(), reason))
}
