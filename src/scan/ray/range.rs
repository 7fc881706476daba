use crate::config::RayConfig;
use crate::scan::SkippedPoints;
use crate::space::Point;

/// Result of the range rule for a point.
pub(crate) enum Ranged {
    /// The ray ends in the point, which is a hit.
    Hit(Point),
    /// The ray is clipped at the max range, without a hit.
    Cut(Point),
    Skipped,
}

/// Distance in metres from which a point counts as a ray without return, if such rays are used. No sensor measures so
/// far.
pub(crate) const NO_RETURN_M: f64 = 1e9;

/// Returns the point that represents a ray without return: a distant point in the given direction, which need not be
/// normalized. `None` if the direction is zero or not finite. [`RayConfig::no_return_range_m`] sets the length of the
/// ray that counts as free.
///
/// ```
/// use voxtile::scan::no_return;
///
/// assert_eq!(no_return([1.0, 2.0, 3.0], [0.0, 0.5, 0.0]), Some([1.0, 2.0 + 1e12, 3.0]));
/// assert_eq!(no_return([1.0, 2.0, 3.0], [0.0; 3]), None);
/// ```
pub fn no_return(origin: Point, direction: Point) -> Option<Point> {
    const FAR_M: f64 = 1e12;
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let point = std::array::from_fn(|k| origin[k] + direction[k] / length * FAR_M);
    (length.is_normal() && point.iter().all(|coordinate| coordinate.is_finite())).then_some(point)
}

/// Returns whether a point is a hit by the range rule: finite, neither too near nor cut at the max range, and not a ray
/// without return. Both points are in metres, world frame.
pub fn is_hit(rays: &RayConfig, origin: Point, point: Point) -> bool {
    matches!(RangeRule::new(rays, origin).apply(point, &mut SkippedPoints::default()), Ranged::Hit(_))
}

/// Range rule for points seen from one origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RangeRule {
    /// In metres.
    origin: Point,
    min_range_m: f64,
    max_range_m: Option<f64>,
    no_return_range_m: Option<f64>,
    /// Squared distances between which a point is certainly a hit.
    certain_m2: [f64; 2],
}

impl RangeRule {
    /// Creates the rule of `rays` for points seen from `origin`, in metres and finite.
    pub(crate) fn new(rays: &RayConfig, origin: Point) -> Self {
        let RayConfig { min_range_m, max_range_m, no_return_range_m, .. } = *rays;
        // Far above the rounding error of squares and square roots.
        const MARGIN: f64 = 1e-12;
        let nearest = min_range_m * min_range_m * (1.0 + MARGIN);
        let farthest = max_range_m.map_or(f64::MAX, |max_m| (max_m * max_m * (1.0 - MARGIN)).min(f64::MAX));
        let nothing = no_return_range_m.map_or(f64::MAX, |_| NO_RETURN_M * NO_RETURN_M * (1.0 - MARGIN));
        let certain_m2 = [nearest, farthest.min(nothing)];
        Self { origin, min_range_m, max_range_m, no_return_range_m, certain_m2 }
    }

    /// Applies the rule to a point in metres.
    #[inline]
    pub(crate) fn apply(&self, point: Point, skipped: &mut SkippedPoints) -> Ranged {
        match self.is_certainly_hit(point) {
            true => Ranged::Hit(point),
            false => self.apply_exactly(point, skipped),
        }
    }

    /// Returns whether a point in metres is a hit, if that needs no square root. Also `false` for points that are not
    /// finite and for the origin.
    #[inline]
    pub(crate) fn is_certainly_hit(&self, point: Point) -> bool {
        let [dx, dy, dz]: Point = std::array::from_fn(|k| point[k] - self.origin[k]);
        let squared = dx * dx + dy * dy + dz * dz;
        (squared > self.certain_m2[0]) & (squared < self.certain_m2[1])
    }

    /// A point at exactly the max range is a hit, as in OctoMap.
    #[cold]
    fn apply_exactly(&self, point: Point, skipped: &mut SkippedPoints) -> Ranged {
        let origin = self.origin;
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
        if length_m < self.min_range_m {
            skipped.too_near += 1;
            return Ranged::Skipped;
        }
        let cut_m = match self.no_return_range_m {
            Some(range_m) if length_m >= NO_RETURN_M => {
                Some(self.max_range_m.map_or(range_m, |max| max.min(range_m)))
            }
            _ => self.max_range_m,
        };
        match cut_m {
            Some(cut_m) if length_m > cut_m => {
                let share = cut_m / length_m;
                Ranged::Cut([origin[0] + dx * share, origin[1] + dy * share, origin[2] + dz * share])
            }
            _ => Ranged::Hit(point),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_without_a_return_are_clipped_at_their_free_range() {
        let at = |rays: RayConfig| match RangeRule::new(&rays, [1.0; 3])
            .apply(no_return([1.0; 3], [0.0, 0.0, -2.0]).unwrap(), &mut SkippedPoints::default())
        {
            Ranged::Cut(point) => Some(point[2]),
            _ => None,
        };
        let rays = |max_range_m, no_return_range_m| RayConfig {
            max_range_m,
            no_return_range_m,
            ..RayConfig::default()
        };
        assert_eq!(at(rays(None, None)), None);
        assert_eq!(at(rays(None, Some(8.0))), Some(-7.0));
        assert_eq!(at(rays(Some(16.0), Some(8.0))), Some(-7.0));
        assert_eq!(at(rays(Some(4.0), Some(8.0))), Some(-3.0));
        assert_eq!(at(rays(Some(4.0), None)), Some(-3.0));
    }

    /// Result for a point at `x` metres.
    fn at(rule: &RangeRule, x: f64) -> &'static str {
        match rule.apply([x, 0.0, 0.0], &mut SkippedPoints::default()) {
            Ranged::Hit(point) if point == [x, 0.0, 0.0] => "hit",
            Ranged::Cut([2.0, 0.0, 0.0]) => "cut",
            Ranged::Skipped => "skipped",
            _ => "elsewhere",
        }
    }

    #[test]
    fn points_at_exactly_the_ranges_are_hits() {
        let mut rays = RayConfig { min_range_m: 0.3, max_range_m: Some(2.0), ..RayConfig::default() };
        let rule = RangeRule::new(&rays, [0.0; 3]);
        let points =
            [0.0, 0.3_f64.next_down(), 0.3, 1.0, 2.0, 2.0_f64.next_up(), 1e160, f64::NAN, f64::INFINITY];
        let expected = ["skipped", "skipped", "hit", "hit", "hit", "cut", "skipped", "skipped", "skipped"];
        assert_eq!(points.map(|x| at(&rule, x)), expected);
        (rays.min_range_m, rays.max_range_m) = (0.0, None);
        let rule = RangeRule::new(&rays, [0.0; 3]);
        assert_eq!([0.0, 1e-200, 1e9, 1e160].map(|x| at(&rule, x)), ["skipped", "hit", "hit", "skipped"]);
    }
}
