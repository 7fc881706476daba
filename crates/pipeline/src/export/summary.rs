use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};
use voxtile::space::{Aabb, Point, VoxelIndex};

/// Result of an export.
#[derive(Debug, Serialize)]
pub struct ExportSummary {
    /// File or folder written; `-` is standard output.
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub file: PathBuf,
    /// Number of voxels written.
    pub voxels: u64,
    /// Peak resident memory of the process.
    pub peak_rss_bytes: Option<u64>,
    /// Further results, by kind of output.
    #[serde(flatten)]
    pub written: Written,
}

/// Results by kind of output.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Written {
    /// One stream of bytes: voxels or an octree.
    Stream {
        /// Origin of its coordinates in the map, in metres.
        origin_m: Point,
        /// Voxel with its lower corner at the origin.
        origin_voxel: VoxelIndex,
        /// File that stores the origin, if it is not the map's.
        #[serde(serialize_with = "path_if_any")]
        origin_file: Option<PathBuf>,
        /// Requested origin, if it is not a voxel corner, in metres.
        #[serde(skip)]
        requested_m: Option<Point>,
    },
    /// A file or a folder, with companion files.
    Files {
        /// Name of the format.
        format: &'static str,
        /// Bounding box of all voxel centers, in metres.
        bounds_m: Option<Aabb>,
        /// Companion files.
        #[serde(serialize_with = "paths")]
        files_beside: Vec<PathBuf>,
    },
    /// A folder of 3D Tiles.
    Tileset {
        /// Name of the format.
        format: &'static str,
        /// Number of nodes of all levels.
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
