use serde::{Deserialize, Serialize};
use std::fmt;

/// Storage of the tiles of a map, chosen at its creation. It does not affect content, query results or digest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Storage {
    /// Two files per tile, the original format: `iwlo_meta.bin` (18 bytes per voxel), and `octree.bt`, which OctoMap
    /// programs can read.
    #[default]
    OctoMap,
    /// One file per tile, `tile.vxt`: the table in the compact form, 20 to 40 times smaller.
    Compact,
}

impl fmt::Display for Storage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OctoMap => "octomap",
            Self::Compact => "compact",
        })
    }
}

impl Storage {
    /// Returns whether this is the original storage, which metadata omits.
    pub(crate) fn is_octomap(&self) -> bool {
        *self == Self::OctoMap
    }
}
