use super::leg::Leg;
use super::plan::Plan;
use super::route::{Route, sound_spacing};
use voxtile::scan::Pose;

/// Endless seeded drive through the streets of a [`City`](super::City), on the right-hand side.
///
/// Memory is constant; skipping ahead costs about ten nanoseconds per street. The iterator yields the sensor's poses
/// (`world_from_sensor`) without end. Every drive begins at the world's origin, along x.
#[derive(Clone, Debug)]
pub struct Drive {
    spacing_m: f64,
    next: u64,
    /// Turns from the start of the drive, to restart from when an earlier pose is requested.
    plan: Plan,
    /// Turns after the current leg.
    ahead: Plan,
    leg: Leg,
    /// Distance driven before the leg, in metres.
    start_m: f64,
}

/// Distance at which the car stops, in metres, so that finding any index takes bounded time.
const FARTHEST_M: f64 = 1e9;

impl Drive {
    /// Returns a random drive. One in four manoeuvres is a loop around a block, the others are random turns, so the
    /// drive visits streets again in both directions.
    ///
    /// There is a pose every `spacing_m` metres (1 m if that is not a positive length).
    pub fn new(seed: u64, spacing_m: f64) -> Self {
        Self::by(Plan::wander(seed), spacing_m)
    }

    /// Returns a drive on mostly new streets.
    ///
    /// It consists of stages of 2 to 11 streets, which lead east and north in turn. After one stage in four the car
    /// drives around a rectangle of blocks, 2 to 7 blocks wide, partly on streets of earlier stages, and then repeats
    /// the stage. In a drive of any length about a fifth of the distance is on streets driven one or two kilometres
    /// before; the rest is new.
    pub fn tour(seed: u64, spacing_m: f64) -> Self {
        Self::by(Plan::tour(seed), spacing_m)
    }

    /// Returns endless laps around a square of `edge_blocks` (at least 1) blocks per side, with left turns.
    pub fn laps(edge_blocks: u64, spacing_m: f64) -> Self {
        Self::by(Plan::laps(edge_blocks), spacing_m)
    }

    fn by(plan: Plan, spacing_m: f64) -> Self {
        let mut ahead = plan.clone();
        let leg = Leg::new([0, 0], [1, 0], ahead.next_turn());
        Self { spacing_m: sound_spacing(spacing_m), next: 0, plan, ahead, leg, start_m: 0.0 }
    }

    /// Returns the distance between two poses along the route, in metres.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }
}

impl Route for Drive {
    fn pose(&mut self, index: u64) -> Pose {
        let driven_m = (index as f64 * self.spacing_m).min(FARTHEST_M);
        if driven_m < self.start_m {
            let next = self.next;
            *self = Self { next, ..Self::by(self.plan.clone(), self.spacing_m) };
        }
        while driven_m >= self.start_m + self.leg.length_m() {
            self.start_m += self.leg.length_m();
            self.leg = self.leg.following(self.ahead.next_turn());
        }
        self.leg.pose(driven_m - self.start_m)
    }
}

impl Iterator for Drive {
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
    use std::collections::BTreeSet;

    fn drives(seed: u64, spacing_m: f64) -> [Drive; 3] {
        [Drive::new(seed, spacing_m), Drive::tour(seed, spacing_m), Drive::laps(seed, spacing_m)]
    }

    #[test]
    fn poses_have_the_requested_spacing() {
        drives(4, 1.0).into_iter().for_each(check_spacing);
    }

    fn check_spacing(drive: Drive) {
        let poses: Vec<_> = drive.take(3_000).collect();
        for (index, pair) in poses.windows(2).enumerate() {
            let step_m =
                (pair[1].isometry().translation.vector - pair[0].isometry().translation.vector).norm();
            assert!((0.98..1.0 + 1e-9).contains(&step_m), "{step_m} m after {index}");
            let ahead = pair[0].isometry().rotation * nalgebra::Vector3::x();
            assert!(
                (pair[1].isometry().translation.vector - pair[0].isometry().translation.vector).dot(&ahead)
                    > 0.9
            );
        }
    }

    #[test]
    fn a_single_pose_equals_the_pose_in_sequence() {
        for mut drive in drives(9, 1.0) {
            let sequence: Vec<_> = drive.clone().take(2_000).collect();
            assert_eq!(drive.clone().nth(1_500), Some(sequence[1_500]));
            for index in [1_999, 3, 700, 699, 0, 1_234] {
                assert_eq!(drive.pose(index), sequence[index as usize]);
            }
            assert_eq!(drive.next(), Some(sequence[0]));
        }
    }

    /// Returns the percentage of new streets among the first `streets` of a drive.
    fn new_streets(drive: Drive, streets: usize) -> usize {
        let mut seen = BTreeSet::new();
        let mut taken = 0;
        let places = drive.map(|pose| {
            [pose.isometry().translation.x, pose.isometry().translation.y].map(|x| x / City::BLOCK_M)
        });
        let mut before = None;
        for place in places {
            // A street is identified by the middle between its crossings, in half blocks.
            let street = place.map(|x| (2.0 * x).round() as i64);
            let in_street = street.iter().filter(|half| *half % 2 != 0).count() == 1;
            if !in_street || before == Some(street) {
                continue;
            }
            before = Some(street);
            taken += 1;
            seen.insert(street);
            if taken == streets {
                break;
            }
        }
        seen.len() * 100 / taken
    }

    #[test]
    fn a_drive_has_old_and_new_streets() {
        let new = new_streets(Drive::new(2, 5.0), 200);
        assert!((30..95).contains(&new), "{new} % are new");
    }

    #[test]
    fn a_tour_of_any_length_has_mostly_new_streets() {
        for seed in [1, 2, 3] {
            for streets in [400, 4_000] {
                let new = new_streets(Drive::tour(seed, 5.0), streets);
                assert!((65..92).contains(&new), "{new} % of {streets} streets of tour {seed} are new");
            }
        }
    }

    #[test]
    fn laps_repeat_the_same_streets() {
        assert_eq!(new_streets(Drive::laps(2, 5.0), 800), 1);
        assert_eq!(new_streets(Drive::laps(25, 5.0), 100), 100);
    }

    #[test]
    fn a_drive_has_no_collisions() {
        let city = City::new(6);
        for pose in drives(6, 2.0).into_iter().flat_map(|drive| drive.take(1_000)) {
            let at = pose.isometry().translation;
            let scene = city.scene([at.x, at.y, at.z], 5.0);
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                for z in [0.1, 1.0, 1.8] {
                    assert!(!scene.is_solid([at.x + dx, at.y + dy, z]), "at {at}");
                }
            }
        }
    }
}
