use crate::input_format::{Detection, InputFormat, Open};
use crate::read::{self, pcd_scans};
use voxtile::{Error, Result};

#[cfg(feature = "las")]
const LAS: Open = Open::Clouds(read::las::open);
#[cfg(not(feature = "las"))]
const LAS: Open = Open::Disabled("las");
#[cfg(feature = "e57")]
const E57: Open = Open::Clouds(read::e57::open);
#[cfg(not(feature = "e57"))]
const E57: Open = Open::Disabled("e57");
#[cfg(feature = "ros")]
const ROS: Open = Open::Recording(crate::ros::recording_clouds::open);
#[cfg(not(feature = "ros"))]
const ROS: Open = Open::Disabled("ros");

/// All supported input formats. A new format needs a row here and a file that opens it.
const FORMATS: [InputFormat; 17] = [
    InputFormat {
        name: "pcd",
        title: "PCD",
        extensions: &["pcd"],
        detection: Detection::StartOrName(read::pcd_header::is_start),
        is_folder: pcd_scans::is_folder,
        open: Open::Scans(pcd_scans::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "ply",
        title: "PLY",
        extensions: &["ply"],
        detection: Detection::Start(read::ply_header::is_start),
        open: Open::Stream(read::ply::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "xyz",
        aliases: &["txt", "csv", "pts", "asc"],
        title: "text of points",
        extensions: &["xyz", "txt", "csv", "pts", "asc", "xyzi", "tsv"],
        detection: Detection::Look(read::text::check_start),
        is_aside: true,
        open: Open::Stream(read::text::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "bin",
        aliases: &["kitti", "nuscenes"],
        title: "raw floats (KITTI .bin)",
        extensions: &["bin", "velodyne"],
        detection: Detection::StartOrName(|_| false),
        open: Open::Cloud(read::bin::open),
        ..InputFormat::UNNAMED
    },
    // LAS and LAZ files share extensions; the header distinguishes them.
    InputFormat {
        name: "las",
        title: "LAS",
        extensions: &["las", "laz"],
        detection: Detection::Start(|start| is_las(start) && !is_laz(start)),
        open: LAS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "laz",
        title: "LAZ",
        extensions: &["las", "laz"],
        detection: Detection::Start(|start| is_las(start) && is_laz(start) && !is_copc(start)),
        open: LAS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "copc",
        title: "COPC",
        extensions: &["las", "laz"],
        detection: Detection::Start(|start| is_las(start) && is_copc(start)),
        open: LAS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "e57",
        title: "E57",
        extensions: &["e57"],
        detection: Detection::Start(|start| start.starts_with(b"ASTM-E57")),
        has_poses: |_| true,
        open: E57,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "tum-rgbd",
        title: "depth images (TUM RGB-D)",
        is_folder: read::depth_tum::is_folder,
        open: Open::Folder(read::depth_tum::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "depth",
        aliases: &["7scenes", "png"],
        title: "depth images",
        extensions: &["png"],
        is_aside: true,
        has_poses: read::depth_images::has_poses,
        open: Open::Folder(read::depth_images::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "bag",
        title: "ROS 1 bag",
        // A killed recorder leaves `.bag.active`.
        extensions: &["bag", "active"],
        detection: Detection::Start(|start| start.starts_with(b"#ROSBAG V2.0")),
        has_poses: |_| true,
        open: ROS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "mcap",
        title: "MCAP",
        extensions: &["mcap"],
        detection: Detection::Start(|start| start.starts_with(b"\x89MCAP0\r\n")),
        has_poses: |_| true,
        open: ROS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "db3",
        title: "ROS 2 bag (SQLite)",
        extensions: &["db3"],
        detection: Detection::Start(|start| start.starts_with(b"SQLite format 3\0")),
        has_poses: |_| true,
        open: ROS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "rosbag2",
        title: "ROS 2 bag",
        is_folder: read::listing::is_rosbag2,
        has_poses: |_| true,
        open: ROS,
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "graph",
        title: "OctoMap scan graph",
        extensions: &["graph"],
        detection: Detection::Name,
        has_poses: |_| true,
        open: Open::Scans(read::scan_graph::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "log",
        title: "OctoMap scan log",
        extensions: &["log"],
        detection: Detection::Name,
        has_poses: |_| true,
        open: Open::Scans(read::scan_log::open),
        ..InputFormat::UNNAMED
    },
    InputFormat {
        name: "scans",
        title: "scan stream",
        extensions: &["scans"],
        detection: Detection::Name,
        has_poses: |_| true,
        open: Open::Scans(read::scan_stream::open),
        ..InputFormat::UNNAMED
    },
];

fn is_las(start: &[u8]) -> bool {
    start.starts_with(b"LASF")
}

/// Returns whether the points of a LAS file are compressed: bit 7 of the point format is set.
fn is_laz(start: &[u8]) -> bool {
    is_copc(start) || start.get(104).is_some_and(|format| format & 0x80 != 0)
}

/// Returns whether the first record of a LAS file is the COPC record.
fn is_copc(start: &[u8]) -> bool {
    start.get(377..382) == Some(b"copc\0")
}

/// Registry of input formats.
#[derive(Clone, Debug)]
pub struct Registry {
    formats: Vec<InputFormat>,
}

impl Default for Registry {
    /// All formats of this crate.
    fn default() -> Self {
        Self { formats: FORMATS.to_vec() }
    }
}

impl Registry {
    /// Adds a format. It is hidden by an existing format with the same name.
    pub fn with(mut self, format: InputFormat) -> Self {
        self.formats.push(format);
        self
    }

    /// Returns all formats, including those disabled in this build.
    pub fn formats(&self) -> &[InputFormat] {
        &self.formats
    }

    /// Returns the format with this name or alias, in any case.
    ///
    /// # Errors
    ///
    /// There is no such format.
    pub fn named(&self, name: &str) -> Result<&InputFormat> {
        let lower = name.to_lowercase();
        let is_it = |format: &&InputFormat| format.name == lower || format.aliases.contains(&&*lower);
        let unknown = || {
            let reason = format!("is unknown; known formats: {}", self.names(", "));
            Error::argument(format!("format `{name}`"), reason)
        };
        self.formats.iter().find(is_it).ok_or_else(unknown)
    }

    /// Returns the names of all formats.
    pub fn names(&self, separator: &str) -> String {
        self.formats.iter().map(|format| format.name).collect::<Vec<_>>().join(separator)
    }
}
