use crate::space::{Aabb, Point};
use nalgebra::Isometry3;
use rustc_hash::FxHashMap;

/// A world to be seen: its solids, and a way through it.
pub trait World {
    /// What can be seen from within `radius_m` of a place.
    fn scene(&self, center: Point, radius_m: f64) -> Scene;

    /// Where the sensor is after so many metres of the way: `world_from_sensor`, clear of every solid.
    fn pose_at(&self, distance_m: f64) -> Isometry3<f64>;
}

/// A box that reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Its extent in metres.
    pub bounds: Aabb,
    /// How strongly it reflects, from 0 to 1.
    pub reflectivity: f64,
}

/// Where a ray met a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Distance from the origin in metres.
    pub distance_m: f64,
    /// How strongly the surface reflects, from 0 to 1.
    pub reflectivity: f64,
    /// Cosine of the angle between ray and surface normal.
    pub incidence_cos: f64,
}

/// Solids on a flat ground, in a grid of columns so that a ray meets only those on its way.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    columns: FxHashMap<[i32; 2], Vec<Solid>>,
}

const COLUMN_M: f64 = 8.0;
const GROUND_REFLECTIVITY: f64 = 0.35;

impl Scene {
    /// Adds a solid.
    pub fn add(&mut self, solid: Solid) {
        let low = column_of(solid.bounds.min);
        let high = column_of(solid.bounds.max);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                self.columns.entry([x, y]).or_default().push(solid);
            }
        }
    }

    /// Whether a place is inside a solid or below the ground.
    pub fn is_inside(&self, place: Point) -> bool {
        let solids = self.columns.get(&column_of(place)).into_iter().flatten();
        place[2] < 0.0 || solids.into_iter().any(|solid| solid.bounds.contains(place))
    }

    /// The nearest surface on a ray; `direction` has length 1.
    pub fn cast(&self, origin: Point, direction: Point, max_range_m: f64) -> Option<Echo> {
        let mut nearest = ground(origin, direction).filter(|echo| echo.distance_m <= max_range_m);
        let mut column = column_of(origin);
        // Distance at which the ray leaves the column along x and along y.
        let exit = |column: [i32; 2], axis: usize| {
            let border = f64::from(column[axis]) + f64::from(u8::from(direction[axis] > 0.0));
            match direction[axis] == 0.0 {
                true => f64::INFINITY,
                false => (border * COLUMN_M - origin[axis]) / direction[axis],
            }
        };
        let mut entered_m = 0.0;
        while entered_m <= nearest.map_or(max_range_m, |echo| echo.distance_m) {
            for solid in self.columns.get(&column).into_iter().flatten() {
                if let Some(echo) = solid.cast(origin, direction) {
                    let limit_m = nearest.map_or(max_range_m, |nearest| nearest.distance_m);
                    if echo.distance_m <= limit_m {
                        nearest = Some(echo);
                    }
                }
            }
            let axis = usize::from(exit(column, 1) < exit(column, 0));
            entered_m = exit(column, axis);
            if !entered_m.is_finite() {
                break;
            }
            column[axis] += if direction[axis] > 0.0 { 1 } else { -1 };
        }
        nearest
    }
}

impl Solid {
    /// Where a ray from outside enters the box (the slab test).
    fn cast(&self, origin: Point, direction: Point) -> Option<Echo> {
        let (mut enter, mut leave, mut axis) = (0.0, f64::INFINITY, None);
        for k in 0..3 {
            if direction[k] == 0.0 {
                if origin[k] < self.bounds.min[k] || origin[k] > self.bounds.max[k] {
                    return None;
                }
                continue;
            }
            let a = (self.bounds.min[k] - origin[k]) / direction[k];
            let b = (self.bounds.max[k] - origin[k]) / direction[k];
            if a.min(b) > enter {
                (enter, axis) = (a.min(b), Some(k));
            }
            leave = a.max(b).min(leave);
        }
        let axis = axis.filter(|_| enter <= leave)?;
        let incidence_cos = direction[axis].abs();
        Some(Echo { distance_m: enter, reflectivity: self.reflectivity, incidence_cos })
    }
}

fn ground(origin: Point, direction: Point) -> Option<Echo> {
    let distance_m = -origin[2] / direction[2];
    (direction[2] < 0.0 && distance_m > 0.0).then_some(Echo {
        distance_m,
        reflectivity: GROUND_REFLECTIVITY,
        incidence_cos: -direction[2],
    })
}

fn column_of(place: Point) -> [i32; 2] {
    [0, 1].map(|axis| (place[axis] / COLUMN_M).floor() as i32)
}
