use std::time::Instant;
use voxtile_formats::RigidPose;

/// A `sensor_msgs/PointCloud2` that waits for its pose, its points still in CDR.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Number of its topic.
    pub topic: usize,
    pub stamp_ns: i64,
    pub frame: String,
    pub cdr: Vec<u8>,
    /// Bytes of memory that its points take on top, once they are decoded.
    pub points_bytes: usize,
    pub arrived: Instant,
    /// Where its sensor was, if that had to be found before it is mapped.
    pub pose: Option<RigidPose>,
}
