use serde::{Deserialize, Serialize};
use std::fmt;

/// How the tiles of a map are stored. It belongs to the map from its beginning; content, answers and digest do not
/// depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Storage {
    /// Two files per tile, the original format: `iwlo_meta.bin` (18 bytes per voxel) and `octree.bt`, which OctoMap
    /// programs read.
    #[default]
    OctoMap,
    /// One file a tile, `tile.vxt`: the table in the compact form, in a twentieth to a fortieth of the bytes.
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
    /// Whether this is the storage of a map that does not say.
    pub(crate) fn is_octomap(&self) -> bool {
        *self == Self::OctoMap
    }
}
