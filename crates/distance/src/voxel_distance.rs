use crate::cap::MAX_CAP_VOXELS;
use crate::distance::Distance;

/// Distance of a voxel, exact: the squared distance in voxels between its center and that of the nearest obstacle.
///
/// Stored as a 16-bit number: `0..=32761` is the squared distance, 32766 a distance beyond the cap, 32767 unknown.
/// Negative numbers are inside obstacles, in signed fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VoxelDistance(pub(crate) i16);

/// Stored number of a distance beyond the cap.
pub(crate) const BEYOND: i16 = i16::MAX - 1;
/// Stored number of an unknown distance.
pub(crate) const UNKNOWN: i16 = i16::MAX;

impl VoxelDistance {
    /// Distance that is not known.
    pub const UNKNOWN: Self = Self(UNKNOWN);
    /// Distance beyond the cap.
    pub const BEYOND: Self = Self(BEYOND);
    /// Deep inside an obstacle: the nearest free voxel is beyond the cap.
    pub const DEEP_INSIDE: Self = Self(-BEYOND);

    /// Creates the distance with a squared distance in voxels, negative inside obstacles. Numbers beyond the largest cap
    /// are [`VoxelDistance::BEYOND`] or [`VoxelDistance::DEEP_INSIDE`].
    pub const fn within(squared_voxels: i16) -> Self {
        const MAX: i16 = (MAX_CAP_VOXELS * MAX_CAP_VOXELS) as i16;
        match squared_voxels {
            number if number > MAX => Self::BEYOND,
            number if number < -MAX => Self::DEEP_INSIDE,
            number => Self(number),
        }
    }

    /// Returns the stored number.
    pub const fn to_bits(self) -> i16 {
        self.0
    }

    /// Squared distance in voxels, negative inside obstacles; `None` if it is unknown or beyond the cap.
    pub const fn squared_voxels(self) -> Option<i16> {
        if self.0 < BEYOND && self.0 > -BEYOND { Some(self.0) } else { None }
    }

    /// Returns whether the distance is unknown.
    pub const fn is_unknown(self) -> bool {
        self.0 == UNKNOWN
    }

    /// Returns whether the distance is known to be beyond the cap, outside or inside of obstacles.
    pub const fn is_beyond(self) -> bool {
        self.0 == BEYOND || self.0 == -BEYOND
    }

    /// Converts to metres.
    pub fn in_metres(self, resolution_m: f64) -> Distance {
        match self.0 {
            UNKNOWN => Distance::Unknown,
            BEYOND => Distance::Beyond,
            number if number <= -BEYOND => Distance::DeepInside,
            number => {
                let voxels = f64::from(number.unsigned_abs()).sqrt();
                Distance::Within(if number < 0 { -voxels } else { voxels } * resolution_m)
            }
        }
    }
}
