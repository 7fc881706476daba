use crate::error::{Error, Result};
use crate::space::{Aabb, Grid, Point, VoxelBox, VoxelIndex};
use nalgebra::Isometry3;

/// Solid body for collision queries; touching counts as collision. All coordinates are in metres in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Sphere.
    Sphere {
        /// Center of the sphere.
        center: Point,
        /// Radius in metres.
        radius_m: f64,
    },
    /// Axis-aligned box, including both corners.
    Box(Aabb),
    /// Oriented box, such as the body of a robot.
    OrientedBox {
        /// Pose of the center of the box.
        world_from_box: Isometry3<f64>,
        /// Half of its length along each of its own axes.
        half_extents_m: Point,
    },
    /// Volume that a sphere covers along a straight line between two points: a capsule.
    SweptSphere {
        /// Center at the start.
        from: Point,
        /// Center at the end.
        to: Point,
        /// Radius in metres.
        radius_m: f64,
    },
}

impl Shape {
    /// Returns the smallest axis-aligned box around the body.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::InvalidArgument`] if the body is not finite, a length is negative, or the upper corner of a
    /// box is below the lower one.
    pub fn bounds(&self) -> Result<Aabb> {
        // `min` and `max` ignore NaN, so the ends are checked here.
        if let Self::SweptSphere { from, to, .. } = self
            && !from.iter().chain(to).all(|coordinate| coordinate.is_finite())
        {
            return Err(Error::argument("body", format!("the path from {from:?} to {to:?} m is not finite")));
        }
        let bounds = match *self {
            Self::Sphere { center, radius_m } => grown(center, center, checked_radius(radius_m)?),
            Self::SweptSphere { from, to, radius_m } => {
                let Aabb { min, max } = Aabb::from_corners(from, to);
                grown(min, max, checked_radius(radius_m)?)
            }
            Self::Box(bounds) => {
                if (0..3).any(|k| bounds.min[k] > bounds.max[k]) {
                    return Err(Error::argument(
                        "body",
                        format!("{bounds} has its upper corner below the lower one"),
                    ));
                }
                bounds
            }
            Self::OrientedBox { world_from_box, half_extents_m } => {
                if half_extents_m.iter().any(|extent| extent.is_nan() || *extent < 0.0) {
                    let reason = format!("{half_extents_m:?} m must not be negative");
                    return Err(Error::argument("half extents", reason));
                }
                let (center, axes) = axes_of(&world_from_box);
                let reach: Point =
                    std::array::from_fn(|k| (0..3).map(|a| axes[a][k].abs() * half_extents_m[a]).sum());
                Aabb {
                    min: std::array::from_fn(|k| center[k] - reach[k]),
                    max: std::array::from_fn(|k| center[k] + reach[k]),
                }
            }
        };
        let finite = bounds.min.iter().chain(&bounds.max).all(|coordinate| coordinate.is_finite());
        if finite { Ok(bounds) } else { Err(Error::argument("body", format!("{bounds} is not finite"))) }
    }

    /// Point from which distances to touched voxels are measured: the center, or the start of a swept body.
    pub(crate) fn reference_point(&self) -> Point {
        match self {
            Self::Sphere { center, .. } => *center,
            Self::SweptSphere { from, .. } => *from,
            Self::Box(bounds) => std::array::from_fn(|k| 0.5 * bounds.min[k] + 0.5 * bounds.max[k]),
            Self::OrientedBox { world_from_box, .. } => world_from_box.translation.vector.into(),
        }
    }

    /// Returns whether the body touches a voxel.
    pub(crate) fn touches_voxel(&self, grid: &Grid, voxel: VoxelIndex) -> bool {
        let end = voxel.map(|index| index.saturating_add(1));
        self.touches_voxels(grid, &VoxelBox { min: voxel, end })
    }

    /// Returns whether the body touches a box of voxels.
    pub(crate) fn touches_voxels(&self, grid: &Grid, voxels: &VoxelBox) -> bool {
        let corner = |index: i32| f64::from(index) * grid.resolution_m();
        self.touches(&Aabb { min: voxels.min.map(corner), max: voxels.end.map(corner) })
    }

    fn touches(&self, other: &Aabb) -> bool {
        match self {
            Self::Sphere { center, radius_m } => other.distance_squared(*center) <= radius_m * radius_m,
            Self::SweptSphere { from, to, radius_m } => {
                distance_squared_to_segment(other, *from, *to) <= radius_m * radius_m
            }
            Self::Box(body) => (0..3).all(|k| body.min[k] <= other.max[k] && other.min[k] <= body.max[k]),
            Self::OrientedBox { world_from_box, half_extents_m } => {
                boxes_touch(world_from_box, half_extents_m, other)
            }
        }
    }
}

fn checked_radius(radius_m: f64) -> Result<f64> {
    if radius_m < 0.0 || radius_m.is_nan() {
        return Err(Error::argument("radius", format!("{radius_m} m is not a length of at least 0")));
    }
    Ok(radius_m)
}

fn grown(min: Point, max: Point, by_m: f64) -> Aabb {
    Aabb { min: min.map(|c| c - by_m), max: max.map(|c| c + by_m) }
}

/// Returns the center of an oriented box, and its three axes.
fn axes_of(world_from_box: &Isometry3<f64>) -> (Point, [Point; 3]) {
    let rotation = world_from_box.rotation.to_rotation_matrix();
    let axis = |a: usize| std::array::from_fn(|k| rotation[(k, a)]);
    (world_from_box.translation.vector.into(), [axis(0), axis(1), axis(2)])
}

/// Returns the squared distance between a box and a segment.
///
/// Along the segment the squared distance to the box is convex, and a parabola between the points where a coordinate
/// passes a face of the box: the minimum of each piece is exact.
fn distance_squared_to_segment(bounds: &Aabb, from: Point, to: Point) -> f64 {
    let along: Point = std::array::from_fn(|k| to[k] - from[k]);
    let mut pieces = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for k in 0..3 {
        for (side, face) in [bounds.min[k], bounds.max[k]].into_iter().enumerate() {
            let time = (face - from[k]) / along[k];
            pieces[2 + 2 * k + side] = if time > 0.0 && time < 1.0 { time } else { 0.0 };
        }
    }
    pieces.sort_unstable_by(f64::total_cmp);
    let at = |time: f64| bounds.distance_squared(std::array::from_fn(|k| from[k] + time * along[k]));
    let min_between = |begin: f64, end: f64| {
        // The segment is outside of the same faces along the whole piece. The squared distance is the sum of (offset +
        // time * along)^2 over the coordinates of these faces.
        let middle = 0.5 * (begin + end);
        let (mut slope, mut square) = (0.0, 0.0);
        for k in 0..3 {
            let coordinate = from[k] + middle * along[k];
            let face = if coordinate < bounds.min[k] {
                bounds.min[k]
            } else if coordinate > bounds.max[k] {
                bounds.max[k]
            } else {
                continue;
            };
            slope += along[k] * (from[k] - face);
            square += along[k] * along[k];
        }
        let lowest = if square > 0.0 { (-slope / square).clamp(begin, end) } else { begin };
        at(lowest)
    };
    let inner = pieces.windows(2).map(|piece| min_between(piece[0], piece[1]));
    inner.fold(at(0.0).min(at(1.0)), f64::min)
}

/// Returns whether an oriented box touches an axis-aligned one: none of the 15 candidate axes separates them
/// (Gottschalk, Lin and Manocha, "OBBTree", SIGGRAPH 1996).
fn boxes_touch(world_from_box: &Isometry3<f64>, half_extents_m: &Point, other: &Aabb) -> bool {
    let (center, axes) = axes_of(world_from_box);
    let other_half: Point = std::array::from_fn(|k| 0.5 * (other.max[k] - other.min[k]));
    let apart: Point = std::array::from_fn(|k| 0.5 * (other.min[k] + other.max[k]) - center[k]);
    let separates = |axis: Point| {
        let reach = (0..3).map(|a| half_extents_m[a] * dot(axes[a], axis).abs()).sum::<f64>();
        let other_reach = (0..3).map(|k| other_half[k] * axis[k].abs()).sum::<f64>();
        dot(apart, axis).abs() > reach + other_reach
    };
    let world_axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    !(world_axes.into_iter().any(separates)
        || axes.into_iter().any(separates)
        || world_axes.iter().any(|world| axes.iter().any(|own| separates(cross(*world, *own)))))
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
