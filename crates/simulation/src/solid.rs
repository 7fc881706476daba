use super::Label;
use voxtile::space::{Aabb, Point};

/// Reflecting box; all objects of simulated worlds consist of boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Extent in metres, world frame.
    pub bounds: Aabb,
    /// Share of reflected light, 0 to 1.
    pub reflectivity: f64,
    /// Kind of the object that the box is part of.
    pub label: Label,
}

/// Ray prepared for tests against many boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// Origin in metres, world frame.
    pub origin: Point,
    /// Unit vector, world frame.
    pub direction: Point,
    /// Inverse of each coordinate of the direction; infinite for 0.
    inverse: Point,
}

/// Intersection of a ray with a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Contact {
    /// Distance from the ray's origin in metres.
    pub distance_m: f64,
    /// Axis of the face's normal: 0, 1, 2 for x, y, z.
    pub axis: usize,
}

impl Ray {
    /// Returns a ray, or `None` if a number is not finite or the direction is zero.
    pub fn new(origin: Point, direction: Point) -> Option<Self> {
        let length =
            (direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]).sqrt();
        if !(length > 0.0 && length.is_finite() && origin.iter().all(|x| x.is_finite())) {
            return None;
        }
        let direction = direction.map(|x| x / length);
        Some(Self { origin, direction, inverse: direction.map(|x| 1.0 / x) })
    }

    /// Returns the point at a distance from the origin in metres.
    pub fn at(&self, distance_m: f64) -> Point {
        std::array::from_fn(|k| self.origin[k] + self.direction[k] * distance_m)
    }
}

impl Solid {
    /// Returns a static box between two corners in metres.
    pub fn new(min: Point, max: Point, reflectivity: f64) -> Self {
        Self { bounds: Aabb::from_corners(min, max), reflectivity, label: Label::Static }
    }

    /// Sets the label.
    pub fn labelled(self, label: Label) -> Self {
        Self { label, ..self }
    }

    /// Returns the nearest intersection with the surface; from inside, the exit point.
    #[inline]
    pub(super) fn contact(&self, ray: &Ray) -> Option<Contact> {
        let mut enter = Contact { distance_m: f64::NEG_INFINITY, axis: 0 };
        let mut leave = Contact { distance_m: f64::INFINITY, axis: 0 };
        for axis in 0..3 {
            let (min, max) = (self.bounds.min[axis], self.bounds.max[axis]);
            if ray.direction[axis] == 0.0 {
                if ray.origin[axis] < min || max < ray.origin[axis] {
                    return None;
                }
                continue;
            }
            let to_min = (min - ray.origin[axis]) * ray.inverse[axis];
            let to_max = (max - ray.origin[axis]) * ray.inverse[axis];
            let (near, far) = if to_min < to_max { (to_min, to_max) } else { (to_max, to_min) };
            if near > enter.distance_m {
                enter = Contact { distance_m: near, axis };
            }
            if far < leave.distance_m {
                leave = Contact { distance_m: far, axis };
            }
        }
        if leave.distance_m < 0.0 || enter.distance_m > leave.distance_m {
            return None;
        }
        Some(if enter.distance_m >= 0.0 { enter } else { leave })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Solid {
        Solid::new([1.0, -0.5, 0.0], [2.0, 0.5, 1.0], 0.5)
    }

    fn contact(origin: Point, direction: Point) -> Option<Contact> {
        unit_box().contact(&Ray::new(origin, direction)?)
    }

    #[test]
    fn a_ray_hits_the_face_in_front() {
        assert_eq!(contact([0.0, 0.0, 0.5], [3.0, 0.0, 0.0]), Some(Contact { distance_m: 1.0, axis: 0 }));
        assert_eq!(contact([1.5, 0.0, 3.0], [0.0, 0.0, -1.0]), Some(Contact { distance_m: 2.0, axis: 2 }));
    }

    #[test]
    fn a_ray_past_or_away_from_a_box_has_no_hit() {
        assert_eq!(contact([0.0, 0.6, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(contact([0.0, 0.0, 0.5], [-1.0, 0.0, 0.0]), None);
        assert_eq!(contact([0.0, 0.0, 0.5], [1.0, 1.0, 0.0]), None);
    }

    #[test]
    fn a_ray_from_inside_hits_the_exit_face() {
        assert_eq!(contact([1.25, 0.0, 0.5], [1.0, 0.0, 0.0]), Some(Contact { distance_m: 0.75, axis: 0 }));
    }

    #[test]
    fn a_ray_without_direction_is_none() {
        assert!(Ray::new([0.0; 3], [0.0; 3]).is_none());
        assert!(Ray::new([0.0; 3], [f64::NAN, 1.0, 0.0]).is_none());
        assert!(Ray::new([f64::INFINITY, 0.0, 0.0], [1.0, 0.0, 0.0]).is_none());
    }
}
