use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Pose of a child frame in a parent frame: `parent = R(quaternion) * child + position`.
///
/// Numbers are stored as read, so that a pose that is not transformed keeps its bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPose {
    /// Origin of the child in the parent frame, in metres.
    pub position_m: [f64; 3],
    /// Rotation as x y z w, with length about 1.
    pub quaternion: [f64; 4],
}

impl RigidPose {
    /// Identity: both frames coincide.
    pub const IDENTITY: Self = Self { position_m: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] };

    /// Returns whether all numbers are finite and the quaternion has a nonzero length.
    pub fn is_valid(&self) -> bool {
        let numbers = self.position_m.iter().chain(&self.quaternion);
        let square: f64 = self.quaternion.iter().map(|q| q * q).sum();
        numbers.copied().all(f64::is_finite) && square.is_finite() && square > 1e-12
    }

    /// Composes two poses: the pose of `other`'s child in this pose's parent. The identity preserves all bits of
    /// `other`.
    pub fn then(&self, other: &Self) -> Self {
        if *self == Self::IDENTITY {
            return *other;
        }
        if *other == Self::IDENTITY {
            return *self;
        }
        let rotation = self.rotation();
        let moved = rotation * Vector3::from(other.position_m) + Vector3::from(self.position_m);
        Self { position_m: moved.into(), quaternion: coordinates(&(rotation * other.rotation())) }
    }

    /// Returns the pose of the parent in the child.
    pub fn inverse(&self) -> Self {
        if *self == Self::IDENTITY {
            return *self;
        }
        let back = self.rotation().inverse();
        let position = -(back * Vector3::from(self.position_m));
        Self { position_m: position.into(), quaternion: coordinates(&back) }
    }

    /// Transforms a point from the child frame to the parent frame.
    pub fn apply(&self, point: [f64; 3]) -> [f64; 3] {
        if *self == Self::IDENTITY {
            return point;
        }
        (self.rotation() * Vector3::from(point) + Vector3::from(self.position_m)).into()
    }

    /// Interpolates between this pose (share 0) and another (share 1): positions linearly, rotations by slerp.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        if share <= 0.0 {
            return *self;
        }
        if share >= 1.0 {
            return *other;
        }
        let position = |k: usize| self.position_m[k] + share * (other.position_m[k] - self.position_m[k]);
        let (from, to) = (self.rotation(), other.rotation());
        // Take the shorter arc: q and -q are the same rotation.
        let to = if from.coords.dot(&to.coords) < 0.0 {
            UnitQuaternion::new_unchecked(-to.into_inner())
        } else {
            to
        };
        let rotation = from.try_slerp(&to, share, 1e-12).unwrap_or(if share < 0.5 { from } else { to });
        Self { position_m: std::array::from_fn(position), quaternion: coordinates(&rotation) }
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        let [x, y, z, w] = self.quaternion;
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
    }
}

fn coordinates(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let [x, y, z, w]: [f64; 4] = rotation.coords.into();
    [x, y, z, w]
}
