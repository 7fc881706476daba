use super::{Hit, Scene};
use voxtile::space::Point;

/// A made-up world that rays can be cast into.
pub trait World {
    /// What stands within `radius_m` metres of a point (world frame), ready for many rays.
    ///
    /// The radius is cut at [`Scene::MAX_RADIUS_M`], so that a scene is bounded whatever is asked for.
    fn scene(&self, center: Point, radius_m: f64) -> Scene;

    /// The first surface on a ray, up to and including `max_range_m` metres.
    ///
    /// The direction, world frame, need not be of unit length. For many rays from one place make a
    /// [`scene`](Self::scene) once and cast into that.
    fn cast(&self, origin: Point, direction: Point, max_range_m: f64) -> Option<Hit> {
        self.scene(origin, max_range_m).cast(origin, direction, max_range_m)
    }
}
