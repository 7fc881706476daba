use super::overlap::Placed;
use voxtile::Result;
use voxtile::scan::Pose;
use voxtile_formats::{PoseSource, RigidPose};

/// Scan selected for the check: some of its points, and the body poses of the scan and its neighbours.
pub(super) struct Pick {
    pub(super) points: Vec<[f32; 3]>,
    pub(super) stamp_ns: Option<i64>,
    pub(super) before: RigidPose,
    pub(super) own: RigidPose,
    /// `None` if there is no next scan.
    pub(super) after: Option<RigidPose>,
}

/// Interpretation of poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    /// The poses as given.
    Given,
    WFirst,
    WLast,
    /// Poses are world to sensor.
    Inverse,
    /// Poses of a camera, with the first image as the world.
    Camera,
    /// Poses of the lidar that were treated as poses of a camera.
    NotCamera,
    Millimetres,
    Centimetres,
    /// All scans at the same place. If they fit there as well, the ground is too flat to distinguish poses.
    Still,
    /// The points are in the world frame.
    WorldFrame,
    /// Each scan has the pose of the next one.
    Next,
    Previous,
}

/// Rotation between the axes of a lidar and of a camera (x right, y down, z forward).
const CAMERA_FROM_LIDAR: RigidPose = RigidPose { position_m: [0.0; 3], quaternion: [0.5, -0.5, 0.5, 0.5] };

impl Reading {
    /// Returns the other interpretations to try for poses from this source.
    pub(super) fn others(source: &PoseSource, has_calib: bool) -> Vec<Self> {
        let any = [Self::Inverse, Self::Next, Self::Previous];
        let own: &[Self] = match source {
            PoseSource::File(_) if has_calib => {
                &[Self::NotCamera, Self::WorldFrame, Self::Millimetres, Self::Centimetres]
            }
            PoseSource::File(_) => &[
                Self::WFirst,
                Self::WLast,
                Self::Camera,
                Self::WorldFrame,
                Self::Millimetres,
                Self::Centimetres,
            ],
            PoseSource::Viewpoint => &[Self::WLast],
            _ => &[],
        };
        any.into_iter().chain(own.iter().copied()).collect()
    }

    /// Returns the points of a scan with their pose under this interpretation.
    pub(super) fn place<'p>(self, pick: &'p Pick, mount: &RigidPose) -> Result<Placed<'p>> {
        let body = self.body(pick);
        let (frame, sensor) = match self {
            Self::WorldFrame => (RigidPose::IDENTITY, body.then(mount).position_m),
            _ => (body.then(mount), [0.0; 3]),
        };
        let world_from_points = Pose::from_quaternion(frame.position_m, frame.quaternion)?;
        Ok(Placed { points: &pick.points, world_from_points, sensor })
    }

    fn body(self, pick: &Pick) -> RigidPose {
        let RigidPose { position_m, quaternion } = pick.own;
        let [x, y, z, w] = quaternion;
        let scaled = |factor: f64| RigidPose { position_m: position_m.map(|c| c * factor), quaternion };
        match self {
            Self::Given | Self::WorldFrame => pick.own,
            Self::WFirst => RigidPose { position_m, quaternion: [y, z, w, x] },
            Self::WLast => RigidPose { position_m, quaternion: [w, x, y, z] },
            Self::Inverse => pick.own.inverse(),
            Self::Camera => CAMERA_FROM_LIDAR.inverse().then(&pick.own).then(&CAMERA_FROM_LIDAR),
            Self::NotCamera => CAMERA_FROM_LIDAR.then(&pick.own).then(&CAMERA_FROM_LIDAR.inverse()),
            Self::Millimetres => scaled(1e-3),
            Self::Centimetres => scaled(1e-2),
            Self::Still => scaled(0.0),
            Self::Next => pick.after.unwrap_or(pick.own),
            Self::Previous => pick.before,
        }
    }

    /// Describes the problem and its solution for a message.
    pub(super) fn advice(self) -> &'static str {
        match self {
            Self::Given | Self::Still => "they are right",
            Self::WFirst => "the quaternions start with w: add a header line, # t tx ty tz qw qx qy qz",
            Self::WLast => "the quaternions end with w, as in x y z w",
            Self::Inverse => {
                "they are the inverse, world to sensor: save the inverse of each, sensor to world"
            }
            Self::Camera => {
                "they are poses of a camera (z forward): convert them with `calib` FILE or `extrinsic`"
            }
            Self::NotCamera => "they are already poses of the lidar: omit `calib`",
            Self::Millimetres => {
                "their positions are in millimetres: add a header line, # t tx[mm] ty[mm] tz[mm] qx qy qz qw"
            }
            Self::Centimetres => {
                "their positions are in centimetres: add a header line, # t tx[cm] ty[cm] tz[cm] qx qy qz qw"
            }
            Self::WorldFrame => "the points are already in the world frame: add `world_frame`",
            Self::Next => {
                "each scan has the pose of the next one: is there an extra scan or pose at the beginning?"
            }
            Self::Previous => {
                "each scan has the pose of the previous one: is a scan or pose missing at the beginning?"
            }
        }
    }
}
