/// Distance in metres, up to the cap of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// Not known: never observed, outside of the field, or next to a damaged tile of the map.
    Unknown,
    /// Distance in metres, negative inside obstacles of a signed field.
    Within(f64),
    /// Farther from all obstacles than the cap.
    Beyond,
    /// Inside an obstacle, farther from all free voxels than the cap. Only in signed fields.
    DeepInside,
}

impl Distance {
    /// Returns the distance in metres, limited to the cap; `None` if unknown.
    pub fn capped_m(self, max_distance_m: f64) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Within(distance_m) => Some(distance_m),
            Self::Beyond => Some(max_distance_m),
            Self::DeepInside => Some(-max_distance_m),
        }
    }

    /// Returns whether the distance is unknown.
    pub const fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown)
    }
}

/// Distance at a point, and its gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceAndGradient {
    /// Distance, as of [`DistanceField::distance_at`](crate::DistanceField::distance_at).
    pub distance: Distance,
    /// Change of the distance per metre along x, y and z: points away from obstacles. Zero if the distance is not
    /// [`Distance::Within`].
    pub gradient: [f64; 3],
}
