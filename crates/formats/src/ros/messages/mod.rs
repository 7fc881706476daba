//! Message types. Each is decoded by one function for ROS 1 and ROS 2.

mod compressed_depth;
mod header;
mod image;
mod kind;
mod laser_scan;
mod livox;
mod packets;
mod point_cloud;
mod point_cloud2;
mod point_field;
mod point_layout;
mod poses;
mod rvl;

pub use compressed_depth::CompressedDepth;
pub use header::Header;
pub use image::{CameraInfo, Image, is_depth_encoding};
pub use kind::MessageKind;
pub use laser_scan::LaserScan;
pub use livox::LivoxCustom;
pub(super) use packets::driver_of;
pub use point_cloud::PointCloud;
pub(super) use point_cloud2::MAX_HEAD_BYTES;
pub use point_cloud2::PointCloud2;
pub use point_field::{FieldType, PointField};
pub(super) use poses::visit_poses;
pub use poses::{StampedPose, decode_poses};
