use super::foreign;
use super::format::{Format, extension_of};
use super::intrinsics::Intrinsics;
use crate::clouds::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs::{DirEntry, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// What a folder holds, in the natural order of names: `scan2` before `scan10`.
pub(super) struct Listing {
    pub(super) files: Vec<PathBuf>,
    folders: Vec<PathBuf>,
}

/// Names, without their ends, of texts that lie beside clouds and are none: poses, times, cameras.
const BESIDE_CLOUDS: [&str; 12] = [
    "calib",
    "camera-intrinsics",
    "depth",
    "groundtruth",
    "intrinsics",
    "odometry",
    "poses",
    "poses_kitti",
    "poses_tum",
    "readme",
    "rgb",
    "times",
];

/// How much of a `metadata.yaml` is read to see whether it is rosbag2's.
const MARK_WITHIN_BYTES: u64 = 1 << 20;
/// The key of all others in it.
const BAG2_MARK: &[u8] = b"rosbag2_bagfile_information";

impl Listing {
    /// Lists a folder, without files that are known to be no clouds, by whatever path they were named.
    pub(super) fn read(folder: &Path, not_clouds: &[PathBuf]) -> Result<Self> {
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

    fn has(&self, name: &str) -> Option<&PathBuf> {
        self.files.iter().find(|path| path.file_name().is_some_and(|found| found == name))
    }

    /// The files of a format.
    pub(super) fn of(&self, format: Format) -> Vec<PathBuf> {
        let is_of = |path: &&PathBuf| {
            format.extensions().contains(&extension_of(path).as_str()) && !is_beside_clouds(path)
        };
        let files: Vec<PathBuf> = self.files.iter().filter(is_of).cloned().collect();
        // Beside colours, depths say that they are depths.
        if format == Format::DepthImages && files.iter().any(|path| is_named_depth(path)) {
            return files.into_iter().filter(|path| is_named_depth(path)).collect();
        }
        files
    }

    /// The format of a folder.
    pub(super) fn format(&self, folder: &Path) -> Result<Format> {
        let what = || folder.display().to_string();
        if let Some(metadata) = self.has("metadata.yaml")
            && metadata.is_file()
            && start_of(metadata)
                .is_ok_and(|text| text.windows(BAG2_MARK.len()).any(|window| window == BAG2_MARK))
        {
            return Ok(Format::Bag2Folder);
        }
        if self.has("depth.txt").is_some() {
            return Ok(Format::DepthTum);
        }
        let mut counts = BTreeMap::new();
        for path in self.files.iter().filter(|path| !is_beside_clouds(path)) {
            let extension = extension_of(path);
            if let Some(format) = of_extension(&extension) {
                counts.entry(format.name()).or_insert((format, path, 0_u64)).2 += 1;
            }
        }
        // Lists, times and poses lie beside clouds, and so do pictures. Between the two, a camera decides.
        let are_depths = self.files.iter().any(|path| is_named_depth(path)) || Intrinsics::is_in(&self.files);
        let sides = if are_depths {
            [Format::Text, Format::DepthImages]
        } else {
            [Format::DepthImages, Format::Text]
        };
        for side in sides {
            if counts.len() > 1 {
                counts.remove(side.name());
            }
        }
        let mut found = counts.values();
        match (found.next(), found.next()) {
            (Some((Format::DepthImages, ..)), None) => Ok(Format::DepthImages),
            // The first file tells LAS from LAZ, and is checked early.
            (Some((_, path, _)), None) => Format::guess(path),
            (Some((one, _, count)), Some((other, _, others))) => {
                let (one, other) = (one.name(), other.name());
                let reason = format!(
                    "holds {count} files of {one} and {others} of {other}; name the format that is meant"
                );
                Err(Error::argument(what(), reason))
            }
            (None, _) => Err(Error::argument(what(), self.why_nothing())),
        }
    }

    /// Why a folder has no clouds, and where they may be.
    fn why_nothing(&self) -> String {
        let foreign = self.files.iter().find_map(|path| {
            let known = foreign::of_extension(&extension_of(path))?;
            Some(known.error(path))
        });
        if let Some(foreign) = foreign {
            return format!("no file that is read: {foreign}");
        }
        let names: Vec<String> = (self.folders.iter().take(5))
            .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
            .collect();
        let hint = if names.is_empty() {
            String::new()
        } else {
            format!("; is one of its folders meant ({})?", names.join(", "))
        };
        format!("no file of a known format ({}){hint}", Format::names())
    }
}

/// The first bytes of a file, among which the mark of rosbag2 is.
fn start_of(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(path)?.take(MARK_WITHIN_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

/// What an entry of a folder is called elsewhere, too. Only links are looked up: a folder may have a million files.
fn place_of(entry: &DirEntry, folder: &Path) -> PathBuf {
    let is_link = entry.file_type().is_ok_and(|kind| kind.is_symlink());
    let target = is_link.then(|| entry.path().canonicalize().ok()).flatten();
    target.unwrap_or_else(|| folder.join(entry.file_name()))
}

fn is_named_depth(path: &Path) -> bool {
    path.to_string_lossy().to_lowercase().ends_with(".depth.png")
}

fn of_extension(extension: &str) -> Option<Format> {
    Some(match extension {
        "las" | "laz" => Format::Las,
        "png" => Format::DepthImages,
        "db3" => Format::Db3,
        _ => Format::ALL.into_iter().find(|format| format.extensions().contains(&extension))?,
    })
}

/// Whether a file is a text beside clouds, by its name.
fn is_beside_clouds(path: &Path) -> bool {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()).unwrap_or_default();
    BESIDE_CLOUDS.contains(&stem.as_str())
}
