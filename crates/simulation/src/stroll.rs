use super::Route;
use super::round::{PAVEMENT_M, Round};
use super::route::{level_pose, sound_spacing};
use std::f64::consts::{FRAC_PI_2, PI};
use voxtile::maths;
use voxtile::scan::Pose;

/// Endless walk around the block of a [`City`](super::City) at the world's origin, on the pavement near the kerb,
/// counter-clockwise.
///
/// The sensor is 1.2 m above the pavement and turns left and right while it walks. The iterator yields its poses
/// (`world_from_sensor`) without end.
#[derive(Clone, Debug)]
pub struct Stroll {
    spacing_m: f64,
    next: u64,
}

const SENSOR_HEIGHT_M: f64 = PAVEMENT_M + 1.2;
/// Maximum yaw to either side, and the distance walked while the sensor turns left and right once.
const LOOK_RAD: f64 = 0.4;
const LOOK_EVERY_M: f64 = 7.3;

impl Stroll {
    /// Returns a walk with a pose every `spacing_m` metres (1 m if that is not a positive length).
    pub fn new(spacing_m: f64) -> Self {
        Self { spacing_m: sound_spacing(spacing_m), next: 0 }
    }
}

impl Route for Stroll {
    fn pose(&mut self, index: u64) -> Pose {
        let walked_m = (index as f64 * self.spacing_m).min(f64::MAX);
        let place = Round::OUTER.place([0, 0], walked_m);
        let heading_rad = match place.ahead {
            [1.0, _] => 0.0,
            [_, 1.0] => FRAC_PI_2,
            [-1.0, _] => PI,
            _ => -FRAC_PI_2,
        };
        let (look, _) = maths::sin_cos(walked_m % LOOK_EVERY_M * (2.0 * PI / LOOK_EVERY_M));
        let [x, y] = place.at_m;
        level_pose([x, y, SENSOR_HEIGHT_M], heading_rad + LOOK_RAD * look)
    }
}

impl Iterator for Stroll {
    type Item = Pose;

    fn next(&mut self) -> Option<Self::Item> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<Self::Item> {
        let index = self.next.saturating_add(skipped as u64);
        self.next = index.saturating_add(1);
        Some(self.pose(index))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{City, World};
    use super::*;

    #[test]
    fn a_stroll_has_no_collisions() {
        for seed in 0..5 {
            let scene = City::new(seed).scene([30.0, 30.0, 1.0], 40.0);
            for pose in Stroll::new(0.25).take(800) {
                let [x, y, z] = pose.position_m();
                for (dx, dy) in [(0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2)] {
                    assert!(!scene.is_solid([x + dx, y + dy, z]), "at {x} {y}");
                }
            }
        }
    }

    #[test]
    fn every_spacing_and_index_gives_a_finite_pose() {
        for spacing_m in [0.0, -1.0, f64::NAN, 1e300, f64::MIN_POSITIVE] {
            let pose = Stroll::new(spacing_m).pose(u64::MAX);
            assert!(pose.position_m().iter().all(|x| x.is_finite()));
        }
    }
}
