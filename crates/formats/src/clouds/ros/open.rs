use super::bag1::Bag1;
use super::bag2_folder::Bag2Folder;
use super::mcap_file::McapFile;
use super::recording::Recording;
use super::sequence::Sequence;
use crate::clouds::error::{Error, Result};
use crate::clouds::read::Format;
use crate::clouds::spill::Budget;
use std::path::{Path, PathBuf};

/// Opens a recording: a file, the folder of a bag of ROS 2, or several that follow one another in time.
///
/// # Errors
///
/// No path; a file that cannot be read or is no recording.
pub fn open_recording(paths: &[PathBuf]) -> Result<Box<dyn Recording>> {
    open_recording_within(paths, &Budget::default())
}

/// As [`open_recording`], in so much memory.
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
        [] => Err(Error::argument("recording", "no file is given")),
        [path] => open(path),
        paths => {
            let mut parts = Sequence::default();
            paths.iter().try_for_each(|path| open(path).map(|part| parts.push(part)))?;
            Ok(Box::new(parts))
        }
    }
}

/// Opens a file by how it starts; where that is damaged, by the end of its name.
pub(super) fn open_file(path: &Path, budget: &Budget) -> Result<Box<dyn Recording>> {
    let format = match Format::of_content(path)? {
        Some(format @ (Format::Bag1 | Format::Mcap | Format::Db3)) => Some(format),
        _ => of_name(path),
    };
    match format {
        Some(Format::Bag1) => Ok(Box::new(Bag1::open_within(path, budget)?)),
        Some(Format::Mcap) => Ok(Box::new(McapFile::open_within(path, budget)?)),
        Some(Format::Db3) => open_db3(path, budget),
        _ => {
            let reason = "it is no recording by its content or its name; known: .bag, .mcap, .db3, a folder with \
                          metadata.yaml";
            Err(Error::argument(path.display().to_string(), reason))
        }
    }
}

fn of_name(path: &Path) -> Option<Format> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase())?;
    let formats = [Format::Bag1, Format::Mcap, Format::Db3];
    formats.into_iter().find(|format| format.extensions().contains(&extension.as_str()))
}

#[cfg(feature = "sqlite")]
fn open_db3(path: &Path, budget: &Budget) -> Result<Box<dyn Recording>> {
    Ok(Box::new(super::db3::Db3::open_within(path, budget)?))
}

#[cfg(not(feature = "sqlite"))]
fn open_db3(path: &Path, _: &Budget) -> Result<Box<dyn Recording>> {
    let reason =
        "this program was built without SQLite (feature `sqlite`); `ros2 bag convert` makes an .mcap of it";
    Err(Error::argument(path.display().to_string(), reason))
}
