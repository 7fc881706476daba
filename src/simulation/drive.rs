use super::route::{Route, level_pose, sound_spacing};
use super::{City, Random};
use crate::maths;
use nalgebra::Isometry3;
use std::f64::consts::FRAC_PI_2;

/// An endless seeded drive through the streets of a [`City`], on the right, with turns, loops and revisits.
///
/// A quarter of the time the car goes once around a block, otherwise it turns as it likes, so it comes back to
/// streets it knows from both sides. It keeps nothing but where it is; skipping ahead costs some ten nanoseconds
/// a street. As an iterator it yields the sensor's poses (`world_from_sensor`) and never ends.
#[derive(Clone, Debug)]
pub struct Drive {
    seed: u64,
    spacing_m: f64,
    next: u64,
    leg: Leg,
}

/// Height of the sensor above the ground, in metres.
const SENSOR_HEIGHT_M: f64 = 1.8;
/// Lane, in metres to the right of the street's middle line.
const LANE_M: f64 = 2.0;
/// Half the edge of the square of a crossing, in metres: within it the car turns.
const CROSSING_M: f64 = 8.0;
/// After a million kilometres the car parks, so that no index takes forever to find.
const FARTHEST_M: f64 = 1e9;
/// Turns are decided so many at a time, so that a drive around the block is one decision.
const TURNS_A_MANOEUVRE: u64 = 4;

/// From one crossing's far side, along a street, through the next crossing.
#[derive(Clone, Debug, PartialEq)]
struct Leg {
    number: u64,
    /// Metres driven before it.
    start_m: f64,
    /// The crossing that it begins at, in blocks.
    from: [i64; 2],
    /// Along x or y, as a unit vector.
    heading: [i64; 2],
    /// At the crossing at its end.
    turn: Turn,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Turn {
    Ahead,
    Left,
    Right,
}

impl Drive {
    /// A drive that begins at the world's origin, along x, with a pose every `spacing_m` metres (1 m if that is
    /// not a positive length).
    pub fn new(seed: u64, spacing_m: f64) -> Self {
        Self { seed, spacing_m: sound_spacing(spacing_m), next: 0, leg: Leg::first(seed) }
    }

    /// Metres from one pose to the next, along the way.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }
}

impl Route for Drive {
    fn pose(&mut self, index: u64) -> Isometry3<f64> {
        let driven_m = (index as f64 * self.spacing_m).min(FARTHEST_M);
        if driven_m < self.leg.start_m {
            self.leg = Leg::first(self.seed);
        }
        while driven_m >= self.leg.start_m + self.leg.length_m() {
            self.leg = self.leg.following(self.seed);
        }
        self.leg.pose(driven_m - self.leg.start_m)
    }
}

impl Iterator for Drive {
    type Item = Isometry3<f64>;

    fn next(&mut self) -> Option<Self::Item> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<Self::Item> {
        let index = self.next.saturating_add(skipped as u64);
        self.next = index.saturating_add(1);
        Some(self.pose(index))
    }
}

impl Leg {
    fn first(seed: u64) -> Self {
        Self { number: 0, start_m: 0.0, from: [0, 0], heading: [1, 0], turn: Turn::at(seed, 0) }
    }

    fn following(&self, seed: u64) -> Self {
        let [hx, hy] = self.heading;
        let number = self.number + 1;
        Self {
            number,
            start_m: self.start_m + self.length_m(),
            from: [self.from[0] + hx, self.from[1] + hy],
            heading: match self.turn {
                Turn::Ahead => [hx, hy],
                Turn::Left => [-hy, hx],
                Turn::Right => [hy, -hx],
            },
            turn: Turn::at(seed, number),
        }
    }

    fn street_m() -> f64 {
        City::BLOCK_M - 2.0 * CROSSING_M
    }

    fn length_m(&self) -> f64 {
        Self::street_m()
            + match self.turn {
                Turn::Ahead => 2.0 * CROSSING_M,
                Turn::Left => FRAC_PI_2 * (CROSSING_M + LANE_M),
                Turn::Right => FRAC_PI_2 * (CROSSING_M - LANE_M),
            }
    }

    /// The pose so many metres after the leg's beginning.
    fn pose(&self, driven_m: f64) -> Isometry3<f64> {
        let [hx, hy] = self.heading.map(|h| h as f64);
        let in_crossing_m = driven_m - Self::street_m();
        // Ahead and to the right of the crossing that the leg begins at, and how far it has turned left.
        let (ahead, right, turned_rad) = if in_crossing_m <= 0.0 || self.turn == Turn::Ahead {
            (CROSSING_M + driven_m, LANE_M, 0.0)
        } else {
            let before = CROSSING_M + Self::street_m();
            // Around the corner of the crossing on the side that the car turns to.
            let (radius, sign) = match self.turn {
                Turn::Left => (CROSSING_M + LANE_M, 1.0),
                _ => (CROSSING_M - LANE_M, -1.0),
            };
            let angle_rad = in_crossing_m / radius;
            let (sin, cos) = maths::sin_cos(angle_rad);
            (before + radius * sin, sign * (radius * cos - CROSSING_M), sign * angle_rad)
        };
        let [x, y] = self.from.map(|i| i as f64 * City::BLOCK_M);
        let heading_rad = match self.heading {
            [1, _] => 0.0,
            [-1, _] => 2.0 * FRAC_PI_2,
            [_, 1] => FRAC_PI_2,
            _ => -FRAC_PI_2,
        };
        let position_m = [x + hx * ahead + hy * right, y + hy * ahead - hx * right, SENSOR_HEIGHT_M];
        level_pose(position_m, heading_rad + turned_rad)
    }
}

impl Turn {
    /// What the drive does at its crossing of a number.
    fn at(seed: u64, number: u64) -> Self {
        let manoeuvre = number / TURNS_A_MANOEUVRE;
        let mut whole = Random::of(seed, &[1, manoeuvre as i64]);
        if whole.chance(0.25) {
            return if whole.chance(0.5) { Self::Left } else { Self::Right };
        }
        match Random::of(seed, &[2, number as i64]).below(4) {
            0 => Self::Left,
            1 => Self::Right,
            _ => Self::Ahead,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::World;
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn poses_follow_each_other_at_the_spacing() {
        let poses: Vec<_> = Drive::new(4, 1.0).take(3_000).collect();
        for (index, pair) in poses.windows(2).enumerate() {
            let step_m = (pair[1].translation.vector - pair[0].translation.vector).norm();
            assert!((0.98..1.0 + 1e-9).contains(&step_m), "{step_m} m after {index}");
            let ahead = pair[0].rotation * nalgebra::Vector3::x();
            assert!((pair[1].translation.vector - pair[0].translation.vector).dot(&ahead) > 0.9);
        }
    }

    #[test]
    fn a_pose_alone_is_the_pose_in_sequence() {
        let sequence: Vec<_> = Drive::new(9, 1.0).take(2_000).collect();
        let mut drive = Drive::new(9, 1.0);
        for index in [1_999, 3, 700, 699, 0, 1_234] {
            assert_eq!(drive.pose(index), sequence[index as usize]);
        }
        assert_eq!(Drive::new(9, 1.0).nth(1_500), Some(sequence[1_500]));
    }

    #[test]
    fn a_drive_comes_back_to_streets_and_finds_new_ones() {
        let visits: Vec<[i64; 2]> = Drive::new(2, 10.0)
            .take(1_000)
            .map(|pose| [pose.translation.x, pose.translation.y].map(|x| (x / 10.0).floor() as i64))
            .collect();
        let distinct = visits.iter().collect::<BTreeSet<_>>().len();
        assert!((300..900).contains(&distinct), "{distinct} of {} places are distinct", visits.len());
    }

    #[test]
    fn a_drive_never_touches_anything() {
        let city = City::new(6);
        for pose in Drive::new(6, 2.0).take(1_000) {
            let at = pose.translation;
            let scene = city.scene([at.x, at.y, at.z], 5.0);
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                for z in [0.1, 1.0, 1.8] {
                    assert!(!scene.is_solid([at.x + dx, at.y + dy, z]), "at {at}");
                }
            }
        }
    }
}
