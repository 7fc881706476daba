use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Rule for the voxels that the rays of a scan pass, used with [`InsertMode::PerScan`](crate::InsertMode::PerScan). A
/// map has one rule from its creation on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clearing {
    /// A voxel that a ray passes and no ray hits gets a miss (OctoMap's rule). Rays that graze a surface pass through
    /// its voxels, so the misses of a few scans can outweigh its hits.
    #[default]
    Octomap,
    /// Misses near a surface are weak: they make an unknown voxel free and do not change a known one. See [`Guard`].
    Guarded(Guard),
}

/// Conditions for a miss that counts in full. It does if at least one of these holds, otherwise it is weak:
///
/// - the voxel and its six neighbors are missed, and none of its 26 neighbors is hit;
/// - the cell of 2 x 2 x 2 voxels that contains it and the six adjacent cells are clear, or the same holds for cells of
///   4 x 4 x 4 voxels; a cell is clear if at least one of its voxels is missed and none is hit;
/// - the cell of 2 x 2 x 2 voxels is clear, none of the 26 cells around it has a hit, and the cell below it along z is
///   clear, too; or behind it, seen from the sensor, there is a cell with a hit at a distance of 4 voxels to
///   `approach_voxels`.
///
/// "Hit" and "missed" refer to the same scan; a missed voxel is passed by a ray and not hit. Cells are aligned to even
/// voxel indices, and to multiples of 4. Distances are along the axis on which the cell is farthest from the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Guard {
    /// Maximum distance in voxels of a hit cell behind a clear cell: 0 (the condition is not used), 4, 6 or 8.
    /// Default: 4.
    pub approach_voxels: u8,
}

/// Maximum distance in voxels at which a hit or miss can change whether another miss is weak: the far side of a cell at
/// the largest value of `approach_voxels`.
pub(crate) const GUARD_REACH: i32 = 9;

impl Default for Guard {
    fn default() -> Self {
        Self { approach_voxels: 4 }
    }
}

impl Guard {
    /// Returns a guard with this distance in voxels: 0, 4, 6 or 8.
    ///
    /// # Errors
    ///
    /// Any other number.
    pub fn new(approach_voxels: u8) -> Result<Self> {
        Self { approach_voxels }.validated()
    }

    pub(super) fn validated(self) -> Result<Self> {
        match self.approach_voxels {
            0 | 4 | 6 | 8 => Ok(self),
            other => {
                let reason = format!("its approach must be 0, 4, 6 or 8 voxels, not {other}");
                Err(Error::argument("clearing", reason))
            }
        }
    }

    /// Returns [`Guard::approach_voxels`] in cells of 2 x 2 x 2 voxels.
    pub(crate) fn approach_cells(self) -> u8 {
        self.approach_voxels / 2
    }
}

impl Clearing {
    /// Guarded clearing with the default guard.
    pub fn guarded() -> Self {
        Self::Guarded(Guard::default())
    }

    /// The guard, if misses near surfaces are weak.
    pub fn guard(self) -> Option<Guard> {
        match self {
            Self::Octomap => None,
            Self::Guarded(guard) => Some(guard),
        }
    }
}

impl fmt::Display for Clearing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Octomap => f.write_str("octomap"),
            Self::Guarded(guard) if *guard == Guard::default() => f.write_str("guarded"),
            Self::Guarded(guard) => write!(f, "guarded with an approach of {} voxels", guard.approach_voxels),
        }
    }
}
