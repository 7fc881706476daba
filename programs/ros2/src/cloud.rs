use std::time::Instant;

/// A `sensor_msgs/PointCloud2` that waits for its pose, its points still in CDR.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Number of its topic.
    pub topic: usize,
    pub stamp_ns: i64,
    pub frame: String,
    pub cdr: Vec<u8>,
    pub arrived: Instant,
}
