use super::Result;
use voxtile::{Layers, VoxelLayers};

/// Voxel to write.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRow {
    /// Index in the map along x, y and z.
    pub index: [i32; 3],
    /// Center in the coordinates of the file, in metres: the map's coordinates minus the file's origin. The mean of the
    /// voxel's points in a file of mean points.
    pub center_m: [f64; 3],
    /// Probability of being occupied.
    pub probability: f64,
    /// Exact log-odds.
    pub log_odds: f64,
    /// Number of updates.
    pub observation_count: i32,
    /// Index of its tile; 0 0 0 if there are no tiles.
    pub tile: [i32; 3],
    /// Layers of the voxel.
    pub layers: RowLayers,
}

/// Layers of a voxel, as files store them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowLayers {
    /// Mean colour.
    pub colour: Option<[u8; 3]>,
    /// Mean intensity in the unit of the points.
    pub intensity: Option<f64>,
    /// Mean intensity as a share of the largest, 0 to 65535.
    pub stored_intensity: Option<u16>,
    /// Class of most points.
    pub class: Option<u8>,
    /// Time stamps of the first and last scan with a hit, in nanoseconds.
    pub time_ns: Option<[i64; 2]>,
}

impl RowLayers {
    /// No value.
    pub const NONE: Self =
        Self { colour: None, intensity: None, stored_intensity: None, class: None, time_ns: None };

    /// Converts the layers of a voxel.
    pub fn of(made: &VoxelLayers, layers: &Layers) -> Self {
        let intensity = made.mean_intensity(layers);
        let max = f64::from(layers.intensity_max.unwrap_or(1.0));
        Self {
            colour: made.mean_colour(),
            intensity,
            stored_intensity: intensity.map(|mean| (mean / max * f64::from(u16::MAX)).round() as u16),
            class: made.class(),
            time_ns: made.time.map(|time| [time.first_ns, time.last_ns]),
        }
    }

    /// Value of a field that files call intensity: the mean intensity, NaN without one, or in a map without this layer
    /// the probability.
    pub(super) fn intensity_or_probability(&self, layers: &Layers, probability: f64) -> f64 {
        if layers.intensity_max.is_some() { self.intensity.unwrap_or(f64::NAN) } else { probability }
    }

    /// Time stamps in seconds; NaN without any.
    pub(super) fn times_s(&self) -> [f64; 2] {
        self.time_ns.map_or([f64::NAN; 2], |times| times.map(|ns| ns as f64 * 1e-9))
    }
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
    /// Layers of the map.
    pub layers: Layers,
}

impl VoxelsHead {
    /// Creates the head for a stream format, which ignores the bounding box and the occupancy threshold, without layers.
    pub fn of_stream(voxels: u64, resolution_m: f64) -> Self {
        Self { voxels, resolution_m, bounds_m: [[0.0; 3]; 2], occupied_log_odds: 0.0, layers: Layers::NONE }
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
