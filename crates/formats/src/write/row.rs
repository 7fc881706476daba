use super::Result;

/// Voxel to write.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRow {
    /// Index in the map along x, y and z.
    pub index: [i32; 3],
    /// Center in the coordinates of the file, in metres: the map's coordinates minus the file's origin.
    pub center_m: [f64; 3],
    /// Probability of being occupied.
    pub probability: f64,
    /// Exact log-odds.
    pub log_odds: f64,
    /// Number of updates.
    pub observation_count: i32,
    /// Index of its tile; 0 0 0 if there are no tiles.
    pub tile: [i32; 3],
}

/// Properties of a file that are needed before its first voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelsHead {
    /// Exact number of voxels.
    pub voxels: u64,
    /// Edge of a voxel, in metres.
    pub resolution_m: f64,
    /// Bounding box of the voxel centers in the map's coordinates, in metres.
    pub bounds_m: [[f64; 3]; 2],
    /// Minimum log-odds of an occupied voxel. The probability is not sufficient: decayed log-odds can give exactly 0.5.
    pub occupied_log_odds: f64,
}

impl VoxelsHead {
    /// Creates the head for a stream format, which ignores the bounding box and the occupancy threshold.
    pub fn of_stream(voxels: u64, resolution_m: f64) -> Self {
        Self { voxels, resolution_m, bounds_m: [[0.0; 3]; 2], occupied_log_odds: 0.0 }
    }
}

/// Sink for voxels, which arrive tile by tile, in Morton order within each tile.
pub trait VoxelSink {
    /// Appends a voxel.
    ///
    /// # Errors
    ///
    /// An I/O error occurs, or the format cannot represent the voxel.
    fn put(&mut self, voxel: &VoxelRow) -> Result<()>;

    /// Completes the file.
    ///
    /// # Errors
    ///
    /// An I/O error occurs, or the number of voxels differs from the announced one.
    fn finish(self: Box<Self>) -> Result<()>;
}
