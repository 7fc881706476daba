use voxtile::space::VoxelIndex;

/// From where a map is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum View {
    /// From above: x to the right, y up.
    #[default]
    Above,
    /// From above, of a layer alone: voxels whose center is at most half of the thickness from a height.
    Slice {
        /// The middle of the layer in metres.
        z_m: f64,
        /// Its thickness in metres; less than a voxel, such as 0, is the one layer of voxels at that height.
        thickness_m: f64,
    },
    /// From a side, z up.
    Side(SideAxis),
}

/// What runs to the right in a view from a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SideAxis {
    /// x to the right, seen along +y.
    X,
    /// y to the right, seen along -x.
    Y,
}

/// What the color of a cell stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColorBy {
    /// Height in metres of the topmost occupied voxel.
    #[default]
    Height,
    /// Highest probability of an occupied voxel.
    Probability,
    /// Most observations of an occupied voxel; where none is occupied, of a free one.
    Count,
    /// Number of the last scan that its tile was flushed with.
    LastScan,
}

/// What became of a place on the way from one state of a map to another.
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
    /// The axes that run to the right and up.
    pub(super) fn axes(self) -> [usize; 2] {
        match self {
            Self::Above | Self::Slice { .. } => [0, 1],
            Self::Side(SideAxis::X) => [0, 2],
            Self::Side(SideAxis::Y) => [1, 2],
        }
    }

    /// A number of voxels that rises toward who looks.
    pub(super) fn nearness(self, voxel: VoxelIndex) -> i32 {
        match self {
            Self::Above | Self::Slice { .. } => voxel[2],
            // The complement turns the order round, and every index has one.
            Self::Side(SideAxis::X) => !voxel[1],
            Self::Side(SideAxis::Y) => voxel[0],
        }
    }
}
