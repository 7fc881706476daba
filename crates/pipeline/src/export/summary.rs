use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use voxtile::space::{Aabb, Point, VoxelIndex};

/// What an export has written.
#[derive(Debug, Serialize)]
pub struct ExportSummary {
    /// The file or folder; `-` is standard output.
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub file: PathBuf,
    /// Voxels in it.
    pub voxels: u64,
    /// Largest resident memory of the process.
    pub peak_rss_bytes: Option<u64>,
    /// What else there is to say, by what was written.
    #[serde(flatten)]
    pub written: Written,
}

/// What was written.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Written {
    /// One stream of bytes: voxels or an octree.
    Stream {
        /// Where in the map its coordinates begin, in metres.
        origin_m: Point,
        /// The voxel whose lower corner that is.
        origin_voxel: VoxelIndex,
        /// The file that says so, if coordinates are not the map's.
        #[serde(serialize_with = "path_if_any")]
        origin_file: Option<PathBuf>,
        /// The origin that was asked for, if that is no corner of a voxel, in metres.
        #[serde(skip)]
        asked_m: Option<Point>,
    },
    /// A file or a folder, and files beside it.
    Files {
        /// Name of the format.
        format: &'static str,
        /// A box around the centers of all voxels, in metres.
        bounds_m: Option<Aabb>,
        /// Files beside the output.
        #[serde(serialize_with = "paths")]
        files_beside: Vec<PathBuf>,
    },
    /// A folder of 3D Tiles.
    Tileset {
        /// Name of the format.
        format: &'static str,
        /// Nodes of all levels.
        nodes: u64,
    },
}

fn path_if_any<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_deref().map(text).serialize(serializer)
}

fn paths<S: Serializer>(paths: &[PathBuf], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(paths.iter().map(|path| text(path)))
}

fn text(path: &Path) -> String {
    path.display().to_string()
}
