use super::Header;
use super::sequence;
use serde::Serialize;

/// `sensor_msgs/PointField`.
#[derive(Clone, Debug, Serialize)]
pub struct PointField {
    pub name: String,
    pub offset: u32,
    pub datatype: u8,
    pub count: u32,
}

/// `sensor_msgs/PointCloud2`.
#[derive(Clone, Debug, Serialize)]
pub struct PointCloud2 {
    pub header: Header,
    pub height: u32,
    pub width: u32,
    pub fields: Vec<PointField>,
    pub is_bigendian: bool,
    pub point_step: u32,
    pub row_step: u32,
    #[serde(with = "sequence")]
    pub data: Vec<u8>,
    pub is_dense: bool,
}

const FLOAT32: u8 = 7;
const STEP: u32 = 12;

impl PointCloud2 {
    /// A cloud in single precision, as all that reads clouds of ROS takes it.
    pub fn of_points(header: Header, points_m: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let fields = [("x", 0), ("y", 4), ("z", 8)].map(|(name, offset)| PointField {
            name: name.to_owned(),
            offset,
            datatype: FLOAT32,
            count: 1,
        });
        let places = points_m.into_iter().flatten();
        let data: Vec<u8> = places.flat_map(|place| (place as f32).to_le_bytes()).collect();
        let row_step = u32::try_from(data.len()).unwrap_or(u32::MAX);
        Self {
            header,
            height: 1,
            width: row_step / STEP,
            fields: fields.to_vec(),
            is_bigendian: false,
            point_step: STEP,
            row_step,
            data,
            is_dense: true,
        }
    }
}
