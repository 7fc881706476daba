use super::City;
use super::route::level_pose;
use std::f64::consts::FRAC_PI_2;
use voxtile::maths;
use voxtile::scan::Pose;

/// From one crossing's far side, along a street of a [`City`], through the next crossing; on the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// The crossing that it begins at, in blocks.
    from: [i64; 2],
    /// Along x or y, as a unit vector.
    heading: [i64; 2],
    /// At the crossing at its end.
    turn: Turn,
}

/// What a car does at a crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    Ahead,
    Left,
    Right,
}

/// Height of the sensor above the ground, in metres.
pub(super) const SENSOR_HEIGHT_M: f64 = 1.8;
/// Lane, in metres to the right of the street's middle line.
const LANE_M: f64 = 2.0;
/// Half the edge of the square of a crossing, in metres: within it the car turns.
const CROSSING_M: f64 = 8.0;

impl Leg {
    /// Metres from one crossing's far side to the next crossing.
    pub(super) const STREET_M: f64 = City::BLOCK_M - 2.0 * CROSSING_M;

    pub(super) fn new(from: [i64; 2], heading: [i64; 2], turn: Turn) -> Self {
        Self { from, heading, turn }
    }

    /// The leg after this one, with the turn at its own end.
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

    /// The pose so many metres after the leg's beginning.
    pub(super) fn pose(&self, driven_m: f64) -> Pose {
        let [hx, hy] = self.heading.map(|h| h as f64);
        let in_crossing_m = driven_m - Self::STREET_M;
        // Ahead and to the right of the crossing that the leg begins at, and how far it has turned left.
        let (ahead, right, turned_rad) = if in_crossing_m <= 0.0 || self.turn == Turn::Ahead {
            (CROSSING_M + driven_m, LANE_M, 0.0)
        } else {
            let before = CROSSING_M + Self::STREET_M;
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
