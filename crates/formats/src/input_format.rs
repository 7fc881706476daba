use crate::read::Points;
use crate::read_options::ReadOptions;
use crate::scans::ScanSource;
use crate::{CloudHead, CloudSource};
use std::path::Path;

/// A format of input: a row of the [`Registry`](crate::Registry).
#[derive(Clone, Copy, Debug)]
pub struct InputFormat {
    /// Its name in options and messages: `e57`.
    pub name: &'static str,
    /// Other names for it in options.
    pub aliases: &'static [&'static str],
    /// What people call it: `ROS 2 bag (SQLite)`.
    pub title: &'static str,
    /// Endings of the names of its files, in lower case without the dot. Those in a folder of clouds go by them.
    pub extensions: &'static [&'static str],
    /// How a file is recognised.
    pub mark: Mark,
    /// Recognises a folder, whatever other files are in it.
    pub is_folder: fn(&Path) -> bool,
    /// Whether such files lie beside clouds of other formats, as lists and pictures do.
    pub is_aside: bool,
    /// Whether the input has poses of its own. A file of poses is looked for otherwise.
    pub has_poses: fn(&Path) -> bool,
    /// Opens an input.
    pub open: Open,
}

impl InputFormat {
    /// A row to start from: a name, a title and `open` make a format that has to be asked for.
    pub const UNNAMED: Self = Self {
        name: "",
        aliases: &[],
        title: "",
        extensions: &[],
        mark: Mark::None,
        is_folder: |_| false,
        is_aside: false,
        has_poses: |_| false,
        open: Open::LeftOut(""),
    };

    /// Whether the file has an extension of this format.
    pub(crate) fn has_extension(&self, extension: &str) -> bool {
        self.extensions.contains(&extension)
    }
}

/// How a file is recognised. All formats are asked for the first of these, then all for the next.
#[derive(Clone, Copy, Debug)]
pub enum Mark {
    /// By its extension, whatever is in it.
    Name,
    /// By its first bytes.
    Start(fn(&[u8]) -> bool),
    /// By its first bytes or, where they tell nothing, by its extension.
    StartOrName(fn(&[u8]) -> bool),
    /// By what its first bytes look like, where nothing else tells; the flag is whether its extension is one of the
    /// format's. An error is why it is none.
    Look(fn(&[u8], bool) -> Result<(), String>),
    /// Not by the file: folders are recognised, or the format is named.
    None,
}

/// Opens one cloud: what is known of it, begun by its file's name, and its points.
pub type OpenCloud = fn(&Path, CloudHead, &ReadOptions) -> voxtile::Result<(CloudHead, Box<dyn Points>)>;
/// Opens clouds.
pub type OpenClouds = fn(&Path, &ReadOptions) -> voxtile::Result<Box<dyn CloudSource>>;
/// Opens scans.
pub type OpenScans = fn(&Path, &ReadOptions) -> voxtile::Result<Box<dyn ScanSource + Send>>;

/// How an input is opened.
#[derive(Clone, Copy, Debug)]
pub enum Open {
    /// A file is a cloud. Folders are read file by file.
    Cloud(OpenCloud),
    /// The same, and a file is read in one pass: a FIFO will do.
    Stream(OpenCloud),
    /// A file has several clouds. Folders are read file by file.
    Clouds(OpenClouds),
    /// A folder has clouds.
    Folder(OpenClouds),
    /// A file or a folder is a recording, which knows where its sensors were.
    Recording(OpenClouds),
    /// A file or a folder has scans, and finds their poses.
    Scans(OpenScans),
    /// This build leaves the format out, for want of this feature.
    LeftOut(&'static str),
}
