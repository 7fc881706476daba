use super::SkippedPoints;
use crate::config::RayConfig;
use crate::space::Point;

/// What the range rules make of a point.
pub(super) enum Ranged {
    /// A ray to the point, which is a hit.
    Hit(Point),
    /// A ray to the place where the max range cuts it; nothing is hit.
    Cut(Point),
    /// The point counts for nothing.
    Skipped,
}

/// Applies the range rules of `rays` to a point seen from `origin`, both in metres.
///
/// At exactly the max range a point is a hit, as in OctoMap.
pub(super) fn in_range(rays: &RayConfig, origin: Point, point: Point, skipped: &mut SkippedPoints) -> Ranged {
    if !point.iter().all(|coordinate| coordinate.is_finite()) {
        skipped.not_finite += 1;
        return Ranged::Skipped;
    }
    if point == origin {
        skipped.no_return += 1;
        return Ranged::Skipped;
    }
    let [dx, dy, dz]: Point = std::array::from_fn(|k| point[k] - origin[k]);
    let length_m = (dx * dx + dy * dy + dz * dz).sqrt();
    if !length_m.is_finite() {
        skipped.out_of_range += 1;
        return Ranged::Skipped;
    }
    if length_m < rays.min_range_m {
        skipped.too_near += 1;
        return Ranged::Skipped;
    }
    match rays.max_range_m {
        Some(max_range_m) if length_m > max_range_m => {
            let share = max_range_m / length_m;
            Ranged::Cut([origin[0] + dx * share, origin[1] + dy * share, origin[2] + dz * share])
        }
        _ => Ranged::Hit(point),
    }
}
