use crate::poses::RigidPose;
use voxtile::Result;
use voxtile::scan::{AttributeSet, NO_TIME};

/// Properties of a cloud that are known before its points are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudHead {
    /// Name in its source: a file name or a number.
    pub name: String,
    /// Time stamp, in nanoseconds since the epoch of the source.
    pub stamp_ns: Option<i64>,
    /// Frame of the points, as named in a recording.
    pub frame: Option<String>,
    /// Pose of the sensor, if the source has one.
    pub world_from_sensor: Option<RigidPose>,
    /// Whether points are already in the world frame. `world_from_sensor` then only gives the ray origin.
    pub is_in_world: bool,
    /// Number of points, if known in advance. It is untrusted: never allocate by it without a check.
    pub points: Option<u64>,
    /// Names of the fields, as in the source.
    pub fields: Vec<String>,
    /// Whether points have intensities.
    pub has_intensities: bool,
    /// Whether points have individual times.
    pub has_times: bool,
    /// Which of the requested attributes points have.
    pub attributes: AttributeSet,
}

/// Point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Position in the cloud's frame, in metres. Not finite for a point without a return and without a known direction.
    pub position_m: [f64; 3],
    /// Intensity in the sensor's unit; 0 if there is none.
    pub intensity: f32,
    /// Time of the measurement, in seconds after the stamp of the cloud; 0 if unknown.
    pub time_s: f64,
    /// Red, green and blue; `None` if the point has no colour or none was requested.
    pub colour: Option<[u8; 3]>,
    /// Class; `None` if the point has none or none was requested.
    pub class: Option<u8>,
    /// Whether the ray hit a surface. Otherwise `position_m` only gives the direction of the ray.
    pub is_return: bool,
}

impl CloudPoint {
    /// Creates a return without intensity, time and attributes.
    pub fn hit(position_m: [f64; 3]) -> Self {
        Self { position_m, intensity: 0.0, time_s: 0.0, colour: None, class: None, is_return: true }
    }

    /// Returns the time of the measurement in nanoseconds after the stamp, [`NO_TIME`] for a ray without a return: it
    /// stays as measured. A time that is not finite is outside all trajectories.
    pub fn after_stamp_ns(&self) -> i64 {
        match self.is_return {
            // The cast saturates.
            true if self.time_s.is_finite() => ((self.time_s * 1e9).round() as i64).max(NO_TIME + 1),
            true => i64::MAX,
            false => NO_TIME,
        }
    }
}

/// Function that returns the pose of a sensor at a time in nanoseconds, if known. It may read a file.
pub type PoseAt = Box<dyn Fn(i64) -> Result<Option<RigidPose>> + Send>;

/// Source of clouds, read one at a time in order. Memory does not grow with their number, nor with the points of a
/// cloud if the format permits.
pub trait CloudSource: Send {
    /// Returns the display name of the format, such as `LAZ` or `ROS 2 bag (MCAP)`.
    fn format(&self) -> &str;

    /// Returns the number of clouds, if known in advance.
    fn len_hint(&self) -> Option<u64> {
        None
    }

    /// Returns the names of the first and the last cloud, if known in advance.
    fn ends(&self) -> Option<[String; 2]> {
        None
    }

    /// Advances to the next cloud, even if the points of the previous one were not read. Returns `None` at the end.
    ///
    /// # Errors
    ///
    /// A file cannot be read or is invalid. The next call continues after the bad cloud if the format permits, and
    /// otherwise returns `None`.
    fn next_cloud(&mut self) -> Result<Option<CloudHead>>;

    /// Visits the points of the current cloud in order. Call it at most once for each cloud.
    ///
    /// # Errors
    ///
    /// A file cannot be read or is invalid, or `visit` returns an error.
    fn read_points(&mut self, visit: &mut dyn FnMut(CloudPoint) -> Result<()>) -> Result<()>;

    /// Returns a function for the sensor's pose at other times, if the source has poses. It may be called while the
    /// points of the current cloud are read.
    fn poses(&self) -> Option<PoseAt> {
        None
    }

    /// Returns remarks for the user about this input, for instance on truncated parts or a missing index.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns the coordinate reference system of the points as returned (in metres), as well-known text or as
    /// `EPSG:25832`. `None` if the source names none, or if its coordinates were converted from another unit.
    fn crs(&self) -> Option<&str> {
        None
    }
}
