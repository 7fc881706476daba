use crate::read::Points;
use crate::read_options::ReadOptions;
use crate::scans::ScanSource;
use crate::{CloudHead, CloudSource};
use std::path::Path;

/// Input format: a row of the [`Registry`](crate::Registry).
#[derive(Clone, Copy, Debug)]
pub struct InputFormat {
    /// Name in options and messages, such as `e57`.
    pub name: &'static str,
    /// Alternative names in options.
    pub aliases: &'static [&'static str],
    /// Name for display, such as `ROS 2 bag (SQLite)`.
    pub title: &'static str,
    /// File name extensions, in lower case without the dot. They select the files of this format in a folder of clouds.
    pub extensions: &'static [&'static str],
    /// How a file is recognised.
    pub detection: Detection,
    /// Returns whether a folder is an input of this format, whatever other files it contains.
    pub is_folder: fn(&Path) -> bool,
    /// Whether files of this format also accompany clouds of other formats, as text lists and pictures do.
    pub is_aside: bool,
    /// Returns whether the input contains its own poses. Otherwise a pose file is searched for.
    pub has_poses: fn(&Path) -> bool,
    /// Opens an input.
    pub open: Open,
}

impl InputFormat {
    /// Defaults for a row. With only a name, a title and `open` set, the format is never detected and must be requested
    /// by name.
    pub const UNNAMED: Self = Self {
        name: "",
        aliases: &[],
        title: "",
        extensions: &[],
        detection: Detection::None,
        is_folder: |_| false,
        is_aside: false,
        has_poses: |_| false,
        open: Open::Disabled(""),
    };

    pub(crate) fn has_extension(&self, extension: &str) -> bool {
        self.extensions.contains(&extension)
    }
}

/// How a file is recognised. Detection tries the variants in this order, each for all formats.
#[derive(Clone, Copy, Debug)]
pub enum Detection {
    /// By the extension alone.
    Name,
    /// By the first bytes.
    Start(fn(&[u8]) -> bool),
    /// By the first bytes, or by the extension if the bytes match no format.
    StartOrName(fn(&[u8]) -> bool),
    /// By inspecting the first bytes, if nothing else matches. The flag is true if the file has one of the format's
    /// extensions. The error is the reason why the file is not of this format.
    Look(fn(&[u8], bool) -> Result<(), String>),
    /// Never recognised as a file: the format is a folder or is requested by name.
    None,
}

/// Opens one cloud. The head passed in is pre-filled from the file name; the returned head is complete.
pub type OpenCloud = fn(&Path, CloudHead, &ReadOptions) -> voxtile::Result<(CloudHead, Box<dyn Points>)>;
/// Opens several clouds.
pub type OpenClouds = fn(&Path, &ReadOptions) -> voxtile::Result<Box<dyn CloudSource>>;
/// Opens scans.
pub type OpenScans = fn(&Path, &ReadOptions) -> voxtile::Result<Box<dyn ScanSource + Send>>;

/// How an input is opened.
#[derive(Clone, Copy, Debug)]
pub enum Open {
    /// A file is one cloud. Folders are read file by file.
    Cloud(OpenCloud),
    /// As `Cloud`, and a file is read in one sequential pass, so a FIFO also works.
    Stream(OpenCloud),
    /// A file contains several clouds. Folders are read file by file.
    Clouds(OpenClouds),
    /// A folder contains the clouds.
    Folder(OpenClouds),
    /// A file or folder is a recording that also contains the sensor poses.
    Recording(OpenClouds),
    /// A file or folder contains scans and provides their poses.
    Scans(OpenScans),
    /// The format is disabled in this build; the value is the Cargo feature that enables it.
    Disabled(&'static str),
}
