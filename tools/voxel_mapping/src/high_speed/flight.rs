use super::PlannersMap;
use super::forest::{Forest, GOAL, START};
use crate::planner::{distance_m, plan};
use std::fmt;
use std::time::Instant;
use voxtile::space::Point;
use voxtile::{Queries, Result, UnknownAs};
use voxtile_local::{LocalView, Obstacle};

/// Limit in the paper.
const MAX_SPEED_M_S: f64 = 9.3;
/// Acceleration of a quadrotor tilted by 38 degrees.
const MAX_ACCELERATION_M_S2: f64 = 7.5;
/// Planning horizon of the paper.
const HORIZON_M: f64 = 25.0;
const RADIUS_M: f64 = 0.2;
/// Distance ahead within which obstacles limit the speed; longer than the braking distance.
const BRAKING_LOOK_M: f64 = 12.0;
/// Interval of scans, each of which is followed by a plan.
const SCAN_EVERY_S: f64 = 0.1;
const STEP_S: f64 = 0.01;
const MAX_TIME_S: f64 = 120.0;

pub struct Flight {
    pub path: Vec<Point>,
    pub length_m: f64,
    pub time_s: f64,
    /// Mean duration of a plan.
    pub planning_ms: f64,
    pub has_collided: bool,
    pub has_arrived: bool,
    pub map_bytes: usize,
}

impl fmt::Display for Flight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = match (self.has_arrived, self.has_collided) {
            (true, _) => "arrived",
            (_, true) => "collided",
            _ => "stuck",
        };
        let Self { length_m, time_s, planning_ms, .. } = self;
        write!(f, "{end} after {length_m:.0} m, {time_s:.1} s, plans of {planning_ms:.2} ms")
    }
}

/// Flies from the start to the goal: scans, plans and follows the path until it arrives, collides or exceeds the time.
pub fn fly(forest: &Forest, map: &mut impl PlannersMap) -> Result<Flight> {
    let (mut at, mut velocity) = (START, [0.0; 3]);
    let mut yaw_rad = 0.0;
    let (mut plans, mut planning_s) = (0_u32, 0.0);
    let mut flight = Flight {
        path: vec![at],
        length_m: 0.0,
        time_s: 0.0,
        planning_ms: 0.0,
        has_collided: false,
        has_arrived: false,
        map_bytes: 0,
    };
    while flight.time_s < MAX_TIME_S && !flight.has_collided && !flight.has_arrived {
        map.insert(&forest.scan(at, yaw_rad, u64::from(plans)))?;
        flight.map_bytes = flight.map_bytes.max(map.bytes());
        let begin = Instant::now();
        let path = plan(map.view(), at, local_goal(at));
        planning_s += begin.elapsed().as_secs_f64();
        plans += 1;
        for _ in 0..(SCAN_EVERY_S / STEP_S).round() as usize {
            let wanted = path.as_deref().map_or([0.0; 3], |path| wanted_velocity(path, at, velocity));
            let wanted = braked(map.view(), wanted, at, velocity);
            step(&mut at, &mut velocity, wanted);
            flight.length_m += speed(velocity) * STEP_S;
            flight.time_s += STEP_S;
            flight.has_collided |= forest.collides(at, RADIUS_M);
        }
        flight.path.push(at);
        flight.has_arrived = at[0] >= GOAL[0] - 1.0 && !flight.has_collided;
        if velocity[0].hypot(velocity[1]) > 0.5 {
            yaw_rad = velocity[1].atan2(velocity[0]);
        }
    }
    flight.planning_ms = planning_s * 1e3 / f64::from(plans.max(1));
    Ok(flight)
}

/// The point within the horizon towards the goal.
fn local_goal(at: Point) -> Point {
    let left_m = distance_m(at, GOAL);
    let share = (HORIZON_M / left_m).min(1.0);
    std::array::from_fn(|k| at[k] + (GOAL[k] - at[k]) * share)
}

/// Velocity along the path: towards a point ahead on it, as fast as its corners permit.
fn wanted_velocity(path: &[Point], at: Point, velocity: Point) -> Point {
    let lookahead_m = 0.6 + 0.18 * speed(velocity);
    let (mut left_m, mut target) = (lookahead_m, path[path.len() - 1]);
    let first = nearest_leg(path, at);
    let mut from = at;
    for &to in &path[first + 1..] {
        let leg_m = distance_m(from, to);
        if leg_m >= left_m {
            target = std::array::from_fn(|k| from[k] + (to[k] - from[k]) * left_m / leg_m);
            break;
        }
        left_m -= leg_m;
        from = to;
    }
    let limit = speed_limit(&path[first..], at);
    let length_m = distance_m(at, target).max(1e-6);
    std::array::from_fn(|k| (target[k] - at[k]) / length_m * limit)
}

/// Limits the velocity so that the drone can stop before the first obstacle straight ahead.
fn braked(view: &LocalView, wanted: Point, at: Point, velocity: Point) -> Point {
    let ahead = |m: f64| std::array::from_fn(|k| at[k] + velocity[k] / speed(velocity).max(1e-9) * m);
    let obstacles = view.obstacles(Obstacle::Inflated);
    let clear_m = match obstacles.cast_segment(at, ahead(BRAKING_LOOK_M), UnknownAs::Free) {
        Ok(Some(hit)) => distance_m(at, hit.center_m),
        _ => BRAKING_LOOK_M,
    };
    // Reserves part of the acceleration for steering.
    let limit = (2.0 * 0.7 * MAX_ACCELERATION_M_S2 * clear_m).sqrt().max(0.8);
    let share = (limit / speed(wanted).max(1e-9)).min(1.0);
    wanted.map(|x| x * share)
}

/// The nearest leg of the path.
fn nearest_leg(path: &[Point], at: Point) -> usize {
    let to_leg_m = |k: usize| {
        let (a, b) = (path[k], path[k + 1]);
        let length = distance_m(a, b).max(1e-9);
        let along = (0..3).map(|k| (at[k] - a[k]) * (b[k] - a[k])).sum::<f64>() / (length * length);
        distance_m(at, std::array::from_fn(|k| a[k] + (b[k] - a[k]) * along.clamp(0.0, 1.0)))
    };
    (0..path.len().saturating_sub(1)).min_by(|&a, &b| to_leg_m(a).total_cmp(&to_leg_m(b))).unwrap_or(0)
}

/// Maximum speed at which the drone can still slow down for each corner.
fn speed_limit(path: &[Point], at: Point) -> f64 {
    let mut limit = MAX_SPEED_M_S;
    let mut left_m = path.get(1).map_or(0.0, |corner| distance_m(at, *corner));
    for corner in path.windows(3) {
        let [before, after]: [Point; 2] =
            [0, 1].map(|leg| std::array::from_fn(|k| corner[leg + 1][k] - corner[leg][k]));
        let dot: f64 = (0..3).map(|k| before[k] * after[k]).sum();
        let turn_rad = (dot / (speed(before) * speed(after)).max(1e-9)).clamp(-1.0, 1.0).acos();
        // A sharp corner is rounded within about a metre.
        let through = (MAX_ACCELERATION_M_S2 * 1.2 / turn_rad.max(1e-3)).sqrt().max(1.5);
        limit = limit.min((through * through + MAX_ACCELERATION_M_S2 * left_m).sqrt());
        left_m += speed(after);
    }
    limit
}

/// Moves for one step, with limited acceleration.
fn step(at: &mut Point, velocity: &mut Point, wanted: Point) {
    let change: Point = std::array::from_fn(|k| wanted[k] - velocity[k]);
    let share = (MAX_ACCELERATION_M_S2 * STEP_S / speed(change).max(1e-9)).min(1.0);
    for k in 0..3 {
        velocity[k] += change[k] * share;
        at[k] += velocity[k] * STEP_S;
    }
}

fn speed([x, y, z]: Point) -> f64 {
    (x * x + y * y + z * z).sqrt()
}
