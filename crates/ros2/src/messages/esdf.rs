use super::Header;
use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// Request of `nvblox_msgs/EsdfAndGradients`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EsdfRequest {
    /// No effect: the answer is always of the current map.
    pub update_esdf: bool,
    /// No effect.
    pub visualize_esdf: bool,
    /// Whether the box below is used, instead of the one around the sensor.
    pub use_aabb: bool,
    /// Frame of the box; empty for that of the map.
    pub frame_id: String,
    /// Minimal corner of the box, in metres.
    pub aabb_min_m: [f64; 3],
    pub aabb_size_m: [f64; 3],
    pub aabbs_to_clear_min_m: Vec<[f64; 3]>,
    pub aabbs_to_clear_size_m: Vec<[f64; 3]>,
    pub spheres_to_clear_center_m: Vec<[f64; 3]>,
    pub spheres_to_clear_radius_m: Vec<f32>,
}

/// Response of `nvblox_msgs/EsdfAndGradients`: signed distances in metres by x, y, z.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EsdfResponse {
    pub header: Header,
    /// Minimal corner of the first voxel.
    pub origin_m: [f64; 3],
    pub voxel_size_m: f32,
    pub esdf_and_gradients: FloatArray,
    pub success: bool,
}

/// `std_msgs/Float32MultiArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FloatArray {
    pub dim: Vec<Dimension>,
    pub data_offset: u32,
    pub data: Vec<f32>,
}

/// `std_msgs/MultiArrayDimension`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Dimension {
    pub label: String,
    pub size: u32,
    pub stride: u32,
}

impl Message for EsdfRequest {}
impl Message for EsdfResponse {}

impl FloatArray {
    /// Returns an array with axes x, y, z; z varies fastest.
    pub fn of_box(size: [u32; 3], data: Vec<f32>) -> Self {
        let stride = |k: usize| size[k..].iter().fold(1_u32, |product, edge| product.saturating_mul(*edge));
        let dim = ["x", "y", "z"].into_iter().enumerate();
        let dim =
            dim.map(|(k, label)| Dimension { label: label.to_owned(), size: size[k], stride: stride(k) });
        Self { dim: dim.collect(), data_offset: 0, data }
    }
}
