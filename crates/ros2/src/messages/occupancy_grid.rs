use super::sequence;
use super::{Header, Pose, Time};
use serde::Serialize;

/// `nav_msgs/MapMetaData`.
#[derive(Clone, Debug, Serialize)]
pub struct MapMetaData {
    pub map_load_time: Time,
    /// Cell size in metres.
    pub resolution: f32,
    pub width: u32,
    pub height: u32,
    /// Lower left corner of cell (0, 0).
    pub origin: Pose,
}

/// `nav_msgs/OccupancyGrid`.
#[derive(Clone, Debug, Serialize)]
pub struct OccupancyGrid {
    pub header: Header,
    pub info: MapMetaData,
    /// Rows in the order of increasing y: -1 unknown, 0 free, 100 occupied, as signed bytes.
    #[serde(with = "sequence")]
    pub data: Vec<u8>,
}

impl OccupancyGrid {
    pub const UNKNOWN: u8 = -1_i8 as u8;
    pub const FREE: u8 = 0;
    pub const OCCUPIED: u8 = 100;
}
