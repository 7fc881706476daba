use voxtile_formats::RigidPose;

/// Finds the points of a cloud that lie on the ground: a nearly horizontal plane near z = 0 of the base frame. As
/// octomap_server, it takes the plane with most points (RANSAC), and sets planes at other heights aside, such as tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundFilter {
    /// Largest distance of a point from its plane.
    pub distance_m: f64,
    /// Largest angle between the plane and the horizontal.
    pub angle_rad: f64,
    /// Largest distance between the plane and the origin of the base frame.
    pub plane_distance_m: f64,
}

/// Clouds with fewer points have no ground, as in octomap_server.
const MIN_POINTS: usize = 50;
/// The search for another plane ends when so few points are left, as in octomap_server.
const MIN_LEFT: usize = 11;
/// Number of candidate planes, as in octomap_server.
const CANDIDATES: usize = 200;
/// Candidates are drawn again if they are too steep, up to so many times in total.
const MAX_DRAWS: usize = 20 * CANDIDATES;
/// Candidates are rated by at most so many points, which are spread over the cloud.
const MAX_RATED: usize = 5000;

/// Points with `normal * point = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// Of length 1, upwards.
    normal: [f64; 3],
    offset_m: f64,
}

impl GroundFilter {
    /// Returns whether each point is on the ground. Points at the sensor's origin or not finite are none.
    pub fn ground(&self, positions_m: &[[f64; 3]], base_from_sensor: &RigidPose) -> Vec<bool> {
        let is_point = |m: &[f64; 3]| *m != [0.0; 3] && m.iter().all(|m| m.is_finite());
        let (numbers, points): (Vec<usize>, Vec<[f64; 3]>) = positions_m
            .iter()
            .enumerate()
            .filter(|(_, position_m)| is_point(position_m))
            .map(|(number, position_m)| (number, base_from_sensor.apply(*position_m)))
            .unzip();
        let mut is_ground = vec![false; positions_m.len()];
        if points.len() < MIN_POINTS {
            return is_ground;
        }
        let ground = self.plane(&points);
        for (number, point) in numbers.into_iter().zip(&points) {
            is_ground[number] = match &ground {
                Some(plane) => plane.distance_m(point) <= self.distance_m,
                None => point[2].abs() <= self.plane_distance_m,
            };
        }
        is_ground
    }

    /// Returns the plane of the ground.
    fn plane(&self, points: &[[f64; 3]]) -> Option<Plane> {
        let mut left = points.to_vec();
        while left.len() >= MIN_LEFT {
            let plane = self.largest_plane(&left)?;
            if plane.offset_m.abs() < self.plane_distance_m {
                return Some(plane);
            }
            let before = left.len();
            left.retain(|point| plane.distance_m(point) > self.distance_m);
            if left.len() == before {
                return None;
            }
        }
        None
    }

    /// Returns the plane with most points, fitted to these.
    fn largest_plane(&self, points: &[[f64; 3]]) -> Option<Plane> {
        let step = points.len().div_ceil(MAX_RATED);
        let rated: Vec<[f64; 3]> = points.iter().copied().step_by(step).collect();
        let count = |plane: &Plane| self.members(plane, &rated).count();
        let (mut best, mut candidates) = (None, 0);
        // The same cloud gives the same draws.
        let mut draws = Draws(points.len() as u64);
        for _ in 0..MAX_DRAWS {
            let plane = Plane::through(draws.three(&rated));
            let Some(plane) = plane.filter(|plane| self.is_level(plane)) else { continue };
            let members = count(&plane);
            if best.is_none_or(|(most, _)| members > most) {
                best = Some((members, plane));
            }
            candidates += 1;
            if candidates == CANDIDATES {
                break;
            }
        }
        let (members, plane) = best?;
        let fitted = Plane::fitted(self.members(&plane, points)).filter(|plane| self.is_level(plane));
        Some(fitted.filter(|fitted| count(fitted) >= members).unwrap_or(plane))
    }

    fn members<'p>(
        &self,
        plane: &Plane,
        points: &'p [[f64; 3]],
    ) -> impl Iterator<Item = &'p [f64; 3]> + Clone + use<'p> {
        let (plane, distance_m) = (*plane, self.distance_m);
        points.iter().filter(move |point| plane.distance_m(point) <= distance_m)
    }

    fn is_level(&self, plane: &Plane) -> bool {
        let [x, y, z] = plane.normal;
        // The angle from its tangent: exact enough where the cosine is nearly 1.
        (x * x + y * y).sqrt().atan2(z) <= self.angle_rad
    }
}

impl Plane {
    /// The plane through three points, unless they are on a line.
    fn through([a, b, c]: [[f64; 3]; 3]) -> Option<Self> {
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|point| std::array::from_fn(|k| point[k] - a[k]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        Self::of(normal, a)
    }

    /// The plane with the least sum of squared vertical distances.
    fn fitted<'p>(points: impl Iterator<Item = &'p [f64; 3]> + Clone) -> Option<Self> {
        let count = points.clone().count() as f64;
        let sum = |of: &dyn Fn(&[f64; 3]) -> f64| points.clone().map(of).sum::<f64>();
        let mean: [f64; 3] = std::array::from_fn(|k| sum(&|point| point[k]) / count);
        let product = |a: usize, b: usize| sum(&|point| (point[a] - mean[a]) * (point[b] - mean[b]));
        let [xx, yy, xy, xz, yz] =
            [product(0, 0), product(1, 1), product(0, 1), product(0, 2), product(1, 2)];
        let determinant = xx * yy - xy * xy;
        let [slope_x, slope_y] = [xz * yy - yz * xy, yz * xx - xz * xy].map(|part| part / determinant);
        Self::of([-slope_x, -slope_y, 1.0], mean)
    }

    fn of(normal: [f64; 3], point: [f64; 3]) -> Option<Self> {
        let length = normal.iter().map(|k| k * k).sum::<f64>().sqrt();
        let upwards = if normal[2] < 0.0 { -length } else { length };
        let normal = normal.map(|k| k / upwards);
        let offset_m = dot(&normal, &point);
        (normal.iter().all(|k| k.is_finite()) && offset_m.is_finite()).then_some(Self { normal, offset_m })
    }

    fn distance_m(&self, point: &[f64; 3]) -> f64 {
        (dot(&self.normal, point) - self.offset_m).abs()
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Reproducible random numbers (SplitMix64).
struct Draws(u64);

impl Draws {
    fn three(&mut self, points: &[[f64; 3]]) -> [[f64; 3]; 3] {
        std::array::from_fn(|_| points[(self.next() % points.len() as u64) as usize])
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::random_scans::Random;

    const FILTER: GroundFilter = GroundFilter { distance_m: 0.04, angle_rad: 0.15, plane_distance_m: 0.07 };
    /// The sensor is 1 m above the base.
    const MOUNT: RigidPose = RigidPose { position_m: [0.2, 0.0, 1.0], ..RigidPose::IDENTITY };

    /// Points of the base frame in the sensor frame.
    fn in_sensor(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        points.iter().map(|point| MOUNT.inverse().apply(*point)).collect()
    }

    /// A rectangle with noise of 1 cm.
    fn level(random: &mut Random, count: usize, [x, y]: [[f64; 2]; 2], height_m: f64) -> Vec<[f64; 3]> {
        let mut point = || {
            [random.between(x[0], x[1]), random.between(y[0], y[1]), height_m + random.between(-0.01, 0.01)]
        };
        (0..count).map(|_| point()).collect()
    }

    #[test]
    fn the_ground_is_found_below_a_larger_table_and_walls() {
        let mut random = Random(3);
        let ground = level(&mut random, 2000, [[0.5, 6.0], [-3.0, 3.0]], 0.02);
        let table = level(&mut random, 3000, [[1.0, 2.0], [-0.5, 0.5]], 0.7);
        let wall: Vec<_> =
            (0..4000).map(|_| [6.0, random.between(-3.0, 3.0), random.between(0.1, 2.0)]).collect();
        let points = [&ground[..], &table, &wall].concat();
        let found = FILTER.ground(&in_sensor(&points), &MOUNT);
        let share = |range: std::ops::Range<usize>| {
            found[range.clone()].iter().filter(|is_ground| **is_ground).count() as f64 / range.len() as f64
        };
        assert!(share(0..2000) > 0.999, "{}", share(0..2000));
        assert_eq!(share(2000..9000), 0.0);
        assert_eq!(FILTER.ground(&in_sensor(&points), &MOUNT), found);
    }

    #[test]
    fn the_slope_of_the_ground_may_have_the_angle_but_not_more() {
        let mut random = Random(5);
        for (slope, is_found) in [(0.0, true), (0.1, true), (0.3, false)] {
            let mut ground = level(&mut random, 1000, [[-4.0, 4.0], [-4.0, 4.0]], 0.0);
            ground.iter_mut().for_each(|point| point[2] += slope * point[0]);
            let found = FILTER.ground(&in_sensor(&ground), &MOUNT).into_iter().filter(|found| *found).count();
            assert_eq!(found > 950, is_found, "slope {slope}: {found}");
        }
    }

    #[test]
    fn without_a_plane_points_near_the_height_of_the_base_are_ground() {
        let mut random = Random(7);
        let wall: Vec<_> =
            (0..500).map(|_| [3.0, random.between(-2.0, 2.0), random.between(-0.5, 2.0)]).collect();
        let found = FILTER.ground(&in_sensor(&wall), &MOUNT);
        assert!(wall.iter().zip(&found).all(|(point, found)| *found == (point[2].abs() <= 0.07)));
        assert!(found.contains(&true));
    }

    #[test]
    fn few_invalid_or_equal_points_are_no_ground() {
        let mut random = Random(9);
        let few = level(&mut random, 49, [[1.0, 4.0], [-1.0, 1.0]], 0.0);
        assert_eq!(FILTER.ground(&in_sensor(&few), &MOUNT), [false; 49]);
        let mut invalid = vec![[0.0; 3]; 100];
        invalid.extend([[f64::NAN, 1.0, 1.0], [f64::INFINITY, 1.0, 1.0]]);
        assert!(!FILTER.ground(&invalid, &MOUNT).contains(&true));
        let equal = in_sensor(&vec![[2.0, 1.0, 0.0]; 200]);
        assert_eq!(FILTER.ground(&equal, &MOUNT), [true; 200]);
        let huge: Vec<_> = (0..200).map(|k| [1e300 * f64::from(k), 1e300, -1e300]).collect();
        assert_eq!(FILTER.ground(&huge, &MOUNT).len(), 200);
    }
}
