use crate::cloud_poses::CloudPoses;
use std::time::Instant;
use voxtile_formats::SweepPeriods;

/// A `sensor_msgs/PointCloud2` that waits for its pose. Its points are still encoded as CDR.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Index of its topic.
    pub topic: usize,
    pub stamp_ns: i64,
    pub frame: String,
    pub cdr: Vec<u8>,
    /// Additional memory of the decoded points.
    pub points_bytes: usize,
    pub arrived: Instant,
    /// Periods in which its points were measured, if it is deskewed.
    pub periods: Option<SweepPeriods>,
    /// Poses, if they were looked up before mapping.
    pub poses: Option<CloudPoses>,
}

impl Cloud {
    /// A cloud that arrives now.
    pub fn new(topic: usize, stamp_ns: i64, frame: String, cdr: Vec<u8>) -> Self {
        Self {
            topic,
            stamp_ns,
            frame,
            cdr,
            points_bytes: 0,
            arrived: Instant::now(),
            periods: None,
            poses: None,
        }
    }
}
