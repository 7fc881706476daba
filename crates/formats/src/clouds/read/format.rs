use super::foreign;
use super::glance::{first_bytes, looks_like_text_points};
use super::listing::Listing;
use crate::clouds::error::{Error, Result};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What a file or a folder is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// PCD of the Point Cloud Library. Voxtile itself reads it.
    Pcd,
    /// PLY, the Polygon File Format.
    Ply,
    /// Points as text, one a line: XYZ, CSV, PTS.
    Text,
    /// Floats of four bytes without a header: KITTI, nuScenes.
    Bin,
    /// LAS.
    Las,
    /// LAZ: compressed LAS.
    Laz,
    /// COPC: LAZ with an index.
    Copc,
    /// E57.
    E57,
    /// Depth images as TUM RGB-D has them: a folder with `depth.txt`.
    DepthTum,
    /// Depth images in the order of their names: a folder of PNG files, 7-Scenes.
    DepthImages,
    /// Recording of ROS 1.
    Bag1,
    /// MCAP file.
    Mcap,
    /// SQLite file of rosbag2.
    Db3,
    /// Folder of rosbag2 with `metadata.yaml`.
    Bag2Folder,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 14] = [
        Self::Pcd,
        Self::Ply,
        Self::Text,
        Self::Bin,
        Self::Las,
        Self::Laz,
        Self::Copc,
        Self::E57,
        Self::DepthTum,
        Self::DepthImages,
        Self::Bag1,
        Self::Mcap,
        Self::Db3,
        Self::Bag2Folder,
    ];

    /// The name by which a person asks for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pcd => "pcd",
            Self::Ply => "ply",
            Self::Text => "xyz",
            Self::Bin => "bin",
            Self::Las => "las",
            Self::Laz => "laz",
            Self::Copc => "copc",
            Self::E57 => "e57",
            Self::DepthTum => "tum-rgbd",
            Self::DepthImages => "depth",
            Self::Bag1 => "bag",
            Self::Mcap => "mcap",
            Self::Db3 => "db3",
            Self::Bag2Folder => "rosbag2",
        }
    }

    /// Names of all formats, for messages.
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }

    /// Endings of file names, in lower case without the dot.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Pcd => &["pcd"],
            Self::Ply => &["ply"],
            Self::Text => &["xyz", "txt", "csv", "pts", "asc", "xyzi", "tsv"],
            Self::Bin => &["bin"],
            // One may be called the other; the header says which it is.
            Self::Las | Self::Laz | Self::Copc => &["las", "laz"],
            Self::E57 => &["e57"],
            Self::DepthTum | Self::DepthImages => &["png"],
            // A recorder that is killed leaves `.bag.active`.
            Self::Bag1 => &["bag", "active"],
            Self::Mcap => &["mcap"],
            Self::Db3 | Self::Bag2Folder => &["db3"],
        }
    }

    /// What a file or folder is: by its content first, by its name second.
    ///
    /// # Errors
    ///
    /// It cannot be read; it is of no known format, or of one that must be converted first.
    pub fn guess(path: &Path) -> Result<Self> {
        Self::guess_without(path, &[])
    }

    /// As [`Format::guess`]; files of a folder that are known to be no clouds do not count.
    ///
    /// # Errors
    ///
    /// As for [`Format::guess`].
    pub fn guess_without(path: &Path, not_clouds: &[PathBuf]) -> Result<Self> {
        let meta = std::fs::metadata(path).map_err(|error| Error::io(path, "read", error))?;
        if meta.is_dir() {
            return Listing::read(path, not_clouds)?.format(path);
        }
        let start = first_bytes(path)?;
        if start.is_empty() {
            return Err(Error::argument(path.display().to_string(), "the file is empty"));
        }
        if let Some(known) = Self::of_bytes(&start) {
            return Ok(known);
        }
        if let Some(foreign) = foreign::of_bytes(&start) {
            return Err(foreign.error(path));
        }
        let extension = extension_of(path);
        if matches!(extension.as_str(), "bin" | "velodyne") {
            return Ok(Self::Bin);
        }
        if let Some(foreign) = foreign::of_extension(&extension) {
            return Err(foreign.error(path));
        }
        if looks_like_text_points(&start) {
            return Ok(Self::Text);
        }
        if Self::Text.extensions().contains(&extension.as_str()) {
            let reason = "is no text of points: the first lines are neither three numbers and more, nor names with x, \
                          y and z";
            return Err(Error::argument(path.display().to_string(), reason));
        }
        if Self::ALL.iter().any(|format| format.extensions().contains(&extension.as_str())) {
            let reason =
                format!("is called .{extension}, but does not start like such a file: is it damaged?");
            return Err(Error::argument(path.display().to_string(), reason));
        }
        let reason = format!("is of no known format; known are {}", Self::names());
        Err(Error::argument(path.display().to_string(), reason))
    }

    /// What a file is by its content alone, if that tells it.
    #[cfg(feature = "ros")]
    pub(crate) fn of_content(path: &Path) -> Result<Option<Self>> {
        Ok(Self::of_bytes(&first_bytes(path)?))
    }

    /// What starts with these bytes.
    fn of_bytes(start: &[u8]) -> Option<Self> {
        let starts = |magic: &[u8]| start.starts_with(magic);
        if starts(b"ply\n") || starts(b"ply\r") {
            return Some(Self::Ply);
        }
        if starts(b"LASF") {
            // The first record is COPC's own; a format number above 127 is compressed.
            let is_copc = start.get(377..382) == Some(b"copc\0");
            let is_laz = start.get(104).is_some_and(|format| format & 0x80 != 0);
            return Some(if is_copc {
                Self::Copc
            } else if is_laz {
                Self::Laz
            } else {
                Self::Las
            });
        }
        let known: [(&[u8], Self); 7] = [
            (b"ASTM-E57", Self::E57),
            (b"#ROSBAG V2.0", Self::Bag1),
            (b"\x89MCAP0\r\n", Self::Mcap),
            (b"SQLite format 3\0", Self::Db3),
            (b"# .PCD", Self::Pcd),
            (b"VERSION ", Self::Pcd),
            (b"# .pcd", Self::Pcd),
        ];
        known.iter().find(|(magic, _)| starts(magic)).map(|&(_, format)| format)
    }
}

/// The ending of a file's name, in lower case.
pub(super) fn extension_of(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pcd => "PCD",
            Self::Ply => "PLY",
            Self::Text => "text of points",
            Self::Bin => "raw floats (KITTI .bin)",
            Self::Las => "LAS",
            Self::Laz => "LAZ",
            Self::Copc => "COPC",
            Self::E57 => "E57",
            Self::DepthTum => "depth images (TUM RGB-D)",
            Self::DepthImages => "depth images",
            Self::Bag1 => "ROS 1 bag",
            Self::Mcap => "MCAP",
            Self::Db3 => "ROS 2 bag (SQLite)",
            Self::Bag2Folder => "ROS 2 bag",
        })
    }
}

impl FromStr for Format {
    type Err = Error;

    /// The format of a name, see [`Format::name`].
    fn from_str(name: &str) -> Result<Self> {
        let lower = name.to_lowercase();
        let alias = match lower.as_str() {
            "txt" | "csv" | "pts" | "asc" => "xyz",
            "kitti" | "nuscenes" => "bin",
            "7scenes" | "png" => "depth",
            other => other,
        };
        Self::ALL.into_iter().find(|format| format.name() == alias).ok_or_else(|| {
            Error::argument(format!("format `{name}`"), format!("is not known; known are {}", Self::names()))
        })
    }
}
