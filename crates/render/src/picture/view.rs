use crate::Layer;
use voxtile::space::VoxelIndex;

/// Viewing direction. Up to 0.5 % of the cells or voxels may be beyond each border of the picture of a map, unless a
/// region is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum View {
    /// From above: x to the right, y up.
    #[default]
    Above,
    /// From above, one layer: voxels whose center is at most half of the thickness from a height.
    Slice {
        /// Middle of the layer in metres.
        z_m: f64,
        /// Thickness in metres; less than a voxel, such as 0, selects the single layer of voxels at this height.
        thickness_m: f64,
    },
    /// From a side, z up.
    Side(SideAxis),
    /// From a direction between above and the side, with shades; lengths along the image have one scale. Only occupied
    /// voxels are drawn.
    Oblique {
        /// Direction from the map to the viewer, counterclockwise from x, in degrees.
        azimuth_deg: f64,
        /// Angle of this direction above the horizon, 0 to 90 degrees.
        elevation_deg: f64,
    },
}

/// Axis to the right in a view from a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SideAxis {
    /// x to the right, seen along +y.
    X,
    /// y to the right, seen along -x.
    Y,
}

/// Quantity shown by the color of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColorBy {
    /// Height in metres of the topmost occupied voxel.
    #[default]
    Height,
    /// Highest probability of an occupied voxel.
    Probability,
    /// Highest observation count of an occupied voxel; of a free one if none is occupied.
    Count,
    /// Number of the last scan in the tile's latest flush.
    LastScan,
    /// Layer of the topmost occupied voxel; of a map that has this layer.
    Layer(Layer),
    /// Distance of free voxels to the nearest obstacle; obstacles are light. Only with
    /// [`Picture::start_distances`](crate::Picture::start_distances).
    Distance,
}

/// Change of a voxel between two states of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Occupied before and after.
    Same,
    /// Occupied before, and free or unknown after.
    Vanished,
    /// Free or unknown before, and occupied after.
    Appeared,
}

impl View {
    /// Returns the axes to the right and up.
    pub(super) fn axes(self) -> [usize; 2] {
        match self {
            Self::Above | Self::Slice { .. } | Self::Oblique { .. } => [0, 1],
            Self::Side(SideAxis::X) => [0, 2],
            Self::Side(SideAxis::Y) => [1, 2],
        }
    }

    /// Returns a number that increases towards the viewer.
    pub(super) fn nearness(self, voxel: VoxelIndex) -> i32 {
        match self {
            Self::Above | Self::Slice { .. } | Self::Oblique { .. } => voxel[2],
            // The complement reverses the order and exists for every index.
            Self::Side(SideAxis::X) => !voxel[1],
            Self::Side(SideAxis::Y) => voxel[0],
        }
    }
}
