use super::City;
use super::route::level_pose;
use std::f64::consts::FRAC_PI_2;
use voxtile::maths;
use voxtile::scan::Pose;

/// Leg of a drive on the right-hand side: from the end of one crossing of a [`City`], along a street, through the next
/// crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// Crossing at the start, in blocks.
    from: [i64; 2],
    /// Unit vector along x or y.
    heading: [i64; 2],
    /// Turn at the crossing at the end.
    turn: Turn,
}

/// Manoeuvre at a crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    Ahead,
    Left,
    Right,
}

/// Height of the sensor above the ground, in metres.
pub(super) const SENSOR_HEIGHT_M: f64 = 1.8;
/// Distance of the lane to the right of the street's centre line, in metres.
const LANE_M: f64 = 2.0;
/// Half the edge length of a crossing, in metres; cars turn inside it.
const CROSSING_M: f64 = 8.0;

impl Leg {
    /// Distance between two crossings along a street, in metres.
    pub(super) const STREET_M: f64 = City::BLOCK_M - 2.0 * CROSSING_M;

    pub(super) fn new(from: [i64; 2], heading: [i64; 2], turn: Turn) -> Self {
        Self { from, heading, turn }
    }

    /// Returns the next leg, with the turn at its end.
    pub(super) fn following(&self, turn: Turn) -> Self {
        let [hx, hy] = self.heading;
        let heading = match self.turn {
            Turn::Ahead => [hx, hy],
            Turn::Left => [-hy, hx],
            Turn::Right => [hy, -hx],
        };
        Self { from: [self.from[0] + hx, self.from[1] + hy], heading, turn }
    }

    pub(super) fn length_m(&self) -> f64 {
        Self::STREET_M
            + match self.turn {
                Turn::Ahead => 2.0 * CROSSING_M,
                Turn::Left => FRAC_PI_2 * (CROSSING_M + LANE_M),
                Turn::Right => FRAC_PI_2 * (CROSSING_M - LANE_M),
            }
    }

    /// Returns the pose at a distance from the leg's start, in metres.
    pub(super) fn pose(&self, driven_m: f64) -> Pose {
        let [hx, hy] = self.heading.map(|h| h as f64);
        let in_crossing_m = driven_m - Self::STREET_M;
        // Position ahead and to the right of the first crossing, and the left turn so far.
        let (ahead, right, turned_rad) = if in_crossing_m <= 0.0 || self.turn == Turn::Ahead {
            (CROSSING_M + driven_m, LANE_M, 0.0)
        } else {
            let before = CROSSING_M + Self::STREET_M;
            // Arc around the crossing's corner on the side of the turn.
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
