use super::companions::{self, Texts};
use super::foreign;
use super::intrinsics::Intrinsics;
use crate::input_format::InputFormat;
use std::fs::{DirEntry, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Contents of a folder, in natural order of names: `scan2` before `scan10`.
pub(crate) struct Listing {
    files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

/// Number of bytes of a `metadata.yaml` that are searched for the key of rosbag2.
const MARK_WITHIN_BYTES: u64 = 1 << 20;
/// Top-level key of a rosbag2 description.
const BAG2_MARK: &[u8] = b"rosbag2_bagfile_information";

impl Listing {
    /// Lists a folder, except files known not to be clouds (compared by resolved path).
    pub(crate) fn read(folder: &Path, not_clouds: &[PathBuf]) -> Result<Self> {
        let fail = |error| Error::io(folder, "read", error);
        let (mut files, mut folders) = (Vec::new(), Vec::new());
        let not_clouds: Vec<PathBuf> = not_clouds.iter().flat_map(|path| path.canonicalize().ok()).collect();
        let here = folder.canonicalize().map_err(fail)?;
        for entry in std::fs::read_dir(folder).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let path = entry.path();
            let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
            if is_hidden || (!not_clouds.is_empty() && not_clouds.contains(&place_of(&entry, &here))) {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push(path);
            }
        }
        alphanumeric_sort::sort_path_slice(&mut files);
        alphanumeric_sort::sort_path_slice(&mut folders);
        Ok(Self { files, folders })
    }

    /// Returns the files that may be clouds by their names.
    pub(crate) fn clouds(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().filter(|path| !companions::is_surely_named(path))
    }

    /// Returns the files of a format.
    pub(crate) fn with_extension(&self, format: &InputFormat) -> Vec<PathBuf> {
        self.clouds().filter(|path| format.has_extension(&extension_of(path))).cloned().collect()
    }

    /// Returns the files of a text format, separated into clouds and others such as lists, logs and cameras.
    pub(crate) fn texts(&self, format: &InputFormat) -> Texts {
        companions::sort_out(self.with_extension(format))
    }

    /// Returns whether there are images named as depth, or a camera file.
    pub(crate) fn has_depths(&self) -> bool {
        self.files.iter().any(|path| is_named_depth(path)) || Intrinsics::is_in(&self.files)
    }

    /// Explains why a folder has no clouds and suggests where they may be. `others` describes its other text files.
    pub(crate) fn why_nothing(&self, known: &str, others: &[String]) -> String {
        if let Some(list) = self.files.iter().find_map(|path| companions::depth_list_of(path)) {
            return list;
        }
        let foreign = self.files.iter().find_map(|path| {
            let known = foreign::of_extension(&extension_of(path))?;
            Some(known.error(path))
        });
        if let Some(foreign) = foreign {
            return format!("contains no supported file: {foreign:#}");
        }
        let names: Vec<String> = (self.folders.iter().take(5))
            .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
            .collect();
        let hint = if names.is_empty() {
            String::new()
        } else {
            format!("; did you mean one of its subfolders ({})?", names.join(", "))
        };
        if others.is_empty() {
            return format!("contains no file of a known format ({known}){hint}");
        }
        format!("contains no clouds: {}{hint}", others.join(", "))
    }
}

/// Returns whether a folder contains the description of a rosbag2 recording.
pub(crate) fn is_rosbag2(folder: &Path) -> bool {
    let path = folder.join("metadata.yaml");
    let mut start = Vec::new();
    let mut read = || File::open(&path)?.take(MARK_WITHIN_BYTES).read_to_end(&mut start);
    path.is_file() && read().is_ok() && start.windows(BAG2_MARK.len()).any(|window| window == BAG2_MARK)
}

/// Returns the extension of a file in lower case.
pub(crate) fn extension_of(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Returns the resolved path of a folder entry. Only symbolic links are resolved, because a folder may have a million
/// files.
fn place_of(entry: &DirEntry, folder: &Path) -> PathBuf {
    let is_link = entry.file_type().is_ok_and(|kind| kind.is_symlink());
    let target = is_link.then(|| entry.path().canonicalize().ok()).flatten();
    target.unwrap_or_else(|| folder.join(entry.file_name()))
}

pub(super) fn is_named_depth(path: &Path) -> bool {
    path.to_string_lossy().to_lowercase().ends_with(".depth.png")
}
