use crate::poses::RigidPose;
use voxtile::Result;

/// What is known of a cloud before its points are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudHead {
    /// Its name in its source: a file name or a number.
    pub name: String,
    /// When it was taken, in nanoseconds since the epoch of its source.
    pub stamp_ns: Option<i64>,
    /// The frame of its points, as a recording names it.
    pub frame: Option<String>,
    /// Where the sensor was, if the source knows it.
    pub world_from_sensor: Option<RigidPose>,
    /// Its points are in the world frame already; `world_from_sensor` says from where they were seen.
    pub is_in_world: bool,
    /// Number of points, if it is known before they are read. It may lie: it never sizes an allocation unchecked.
    pub points: Option<u64>,
    /// Names of the fields, in the words of the source.
    pub fields: Vec<String>,
    /// Whether points come with intensities.
    pub has_intensities: bool,
    /// Whether points come with times of their own.
    pub has_times: bool,
}

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Where it is, in metres in the frame of the cloud. Not finite where nothing came back and no direction is known.
    pub position_m: [f64; 3],
    /// Intensity in the sensor's unit; 0 if there is none.
    pub intensity: f32,
    /// When it was measured, in seconds after the stamp of its cloud; 0 if that is not known.
    pub time_s: f64,
    /// Whether something was hit. Otherwise nothing came back along the direction of `position_m`, of any length.
    pub is_return: bool,
}

impl CloudPoint {
    /// A point that was hit, without more.
    pub fn hit(position_m: [f64; 3]) -> Self {
        Self { position_m, intensity: 0.0, time_s: 0.0, is_return: true }
    }
}

/// Where a sensor was at a time in nanoseconds, if that is known. It may have to read a file.
pub type PoseAt = Box<dyn Fn(i64) -> Result<Option<RigidPose>> + Send>;

/// Clouds one at a time, in order. Memory does not grow with their number, nor with the points of a cloud where the
/// format allows it.
pub trait CloudSource: Send {
    /// Name of the format, for people: `LAZ`, `ROS 2 bag (MCAP)`.
    fn format(&self) -> &str;

    /// Number of clouds, if known before they are read.
    fn len_hint(&self) -> Option<u64> {
        None
    }

    /// Names of the first and the last cloud, if known before any is read.
    fn ends(&self) -> Option<[String; 2]> {
        None
    }

    /// Moves to the next cloud, whether or not the points of the last were read. `None` after the last one.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is invalid. The call after that moves on to the cloud behind the bad one, if the
    /// format allows it, and says that there is none otherwise.
    fn next_cloud(&mut self) -> Result<Option<CloudHead>>;

    /// Visits the points of the cloud that [`CloudSource::next_cloud`] moved to, in order, once.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is invalid; the first error of `visit`.
    fn read_points(&mut self, visit: &mut dyn FnMut(CloudPoint) -> Result<()>) -> Result<()>;

    /// Where the sensor of the cloud at hand was at other times, if the source knows. It may be asked while the points
    /// of that cloud are read.
    fn poses(&self) -> Option<PoseAt> {
        None
    }

    /// What a person should know of this input beside its clouds: parts that were cut off, messages without an index.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// The coordinate reference system of the points as they are given, in metres, if the source names one: as
    /// well-known text, or as `EPSG:25832`. One in other units, whose coordinates were converted, is none of theirs.
    fn crs(&self) -> Option<&str> {
        None
    }
}
