use super::{Hit, Scene};
use voxtile::space::Point;

/// Synthetic world for ray casting.
pub trait World {
    /// Returns the objects within `radius_m` metres of a point (world frame), indexed for many rays.
    ///
    /// The radius is at most [`Scene::MAX_RADIUS_M`], which bounds the size of a scene.
    fn scene(&self, center: Point, radius_m: f64) -> Scene;

    /// Returns the first hit of a ray up to and including `max_range_m` metres.
    ///
    /// The direction (world frame) need not have unit length. For many rays from one position, create a
    /// [`scene`](Self::scene) once and cast into it.
    fn cast(&self, origin: Point, direction: Point, max_range_m: f64) -> Option<Hit> {
        self.scene(origin, max_range_m).cast(origin, direction, max_range_m)
    }
}
