use super::Result;

/// A voxel that is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRow {
    /// Its index in the map along x, y and z.
    pub index: [i32; 3],
    /// Its center in the coordinates of the file, in metres: those of the map, less the file's origin.
    pub center_m: [f64; 3],
    /// Probability of being occupied.
    pub probability: f64,
    /// Exact log-odds.
    pub log_odds: f64,
    /// Number of updates.
    pub observation_count: i32,
    /// The tile that it belongs to; 0 0 0 where there are none.
    pub tile: [i32; 3],
}

/// What is known of a file before its first voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelsHead {
    /// Number of voxels, exactly.
    pub voxels: u64,
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// A box around the centers of all voxels in the map's coordinates, in metres.
    pub bounds_m: [[f64; 3]; 2],
    /// Log-odds from which on a voxel is occupied. The probability does not tell: faded log-odds have exactly 0.5.
    pub occupied_log_odds: f64,
}

impl VoxelsHead {
    /// What formats need that are one stream: they look at no box, and not at what is occupied.
    pub fn of_stream(voxels: u64, resolution_m: f64) -> Self {
        Self { voxels, resolution_m, bounds_m: [[0.0; 3]; 2], occupied_log_odds: 0.0 }
    }
}

/// Takes voxels one after the other: tile by tile, in Morton order within each.
pub trait VoxelSink {
    /// Appends a voxel.
    ///
    /// # Errors
    ///
    /// The system refuses; what the format cannot hold.
    fn put(&mut self, voxel: &VoxelRow) -> Result<()>;

    /// Ends the file.
    ///
    /// # Errors
    ///
    /// The system refuses; another number of voxels than was announced.
    fn finish(self: Box<Self>) -> Result<()>;
}
