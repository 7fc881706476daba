use std::path::Path;

/// A format that voxels are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum VoxelFileFormat {
    /// Text, a line a voxel: `x y z probability`.
    Xyz,
    /// An archive of NumPy arrays: `xyz`, `log_odds`, `probability`, `count`.
    Npz,
    /// A flat map of navigation for ROS 2: a picture and a `.yaml` beside it. Needs free voxels too.
    Nav2Map,
    /// Heights as a picture of 16 bit with a world file.
    Heightmap,
    /// LAS 1.4.
    Las,
    /// LAS 1.4, compressed.
    Laz,
    /// LAZ with levels of detail, for programs that load what they show.
    Copc,
    /// The surface of the occupied voxels as binary glTF.
    Glb,
    /// E57 of ASTM E2807.
    E57,
    /// A table of Apache Parquet.
    Parquet,
    /// A folder of PCD files, a square each, with the metadata that Autoware loads them by.
    Autoware,
    /// A recording of ROS 2 with clouds of type `sensor_msgs/msg/PointCloud2`.
    Mcap,
}

impl VoxelFileFormat {
    /// All of them, whether or not this program was built to write them.
    pub const ALL: [Self; 12] = [
        Self::Xyz,
        Self::Npz,
        Self::Nav2Map,
        Self::Heightmap,
        Self::Las,
        Self::Laz,
        Self::Copc,
        Self::Glb,
        Self::E57,
        Self::Parquet,
        Self::Autoware,
        Self::Mcap,
    ];

    /// The format that the end of a file's name asks for. Folders say nothing.
    pub fn of_path(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        // `.copc.laz` ends with `.laz`, too.
        if name.ends_with(".copc.laz") {
            return Some(Self::Copc);
        }
        let (_, extension) = name.rsplit_once('.')?;
        Self::ALL.into_iter().find(|format| format.extension() == Some(extension))
    }

    /// The format of a name, as a person types it: `nav2`, `copc`.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name().eq_ignore_ascii_case(name))
    }

    /// Its name, as a person types it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Xyz => "xyz",
            Self::Npz => "npz",
            Self::Nav2Map => "nav2",
            Self::Heightmap => "heightmap",
            Self::Las => "las",
            Self::Laz => "laz",
            Self::Copc => "copc",
            Self::Glb => "glb",
            Self::E57 => "e57",
            Self::Parquet => "parquet",
            Self::Autoware => "autoware",
            Self::Mcap => "mcap",
        }
    }

    /// The end of its files' names without the dot. `None` for a folder.
    pub fn extension(self) -> Option<&'static str> {
        match self {
            Self::Nav2Map => Some("pgm"),
            Self::Heightmap => Some("png"),
            Self::Copc => Some("copc.laz"),
            Self::Autoware => None,
            _ => Some(self.name()),
        }
    }

    /// Whether the output is a folder.
    pub fn is_folder(self) -> bool {
        self == Self::Autoware
    }

    /// Whether it tells free voxels from such that nobody saw, and so needs all observed voxels.
    pub fn needs_free_voxels(self) -> bool {
        self == Self::Nav2Map
    }

    /// The feature of this crate that it needs, if any.
    pub fn feature(self) -> Option<&'static str> {
        match self {
            Self::Las | Self::Laz | Self::Copc => Some("las"),
            Self::E57 => Some("e57"),
            Self::Parquet => Some("parquet"),
            Self::Mcap => Some("ros"),
            _ => None,
        }
    }

    /// Whether this program was built to write it.
    pub fn is_built(self) -> bool {
        let built = [
            ("las", cfg!(feature = "las")),
            ("e57", cfg!(feature = "e57")),
            ("parquet", cfg!(feature = "parquet")),
            ("ros", cfg!(feature = "ros")),
        ];
        self.feature().is_none_or(|feature| built.contains(&(feature, true)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_ask_for_formats() {
        for format in VoxelFileFormat::ALL {
            assert_eq!(VoxelFileFormat::of_name(format.name()), Some(format));
            if let Some(extension) = format.extension() {
                let name = format!("a.b/hall.2.{}", extension.to_ascii_uppercase());
                assert_eq!(VoxelFileFormat::of_path(Path::new(&name)), Some(format));
            }
        }
        assert_eq!(VoxelFileFormat::of_path(Path::new("hall.copc")), None);
        assert_eq!(VoxelFileFormat::of_path(Path::new("laz")), None);
    }
}
