use super::leg::{Leg, SENSOR_HEIGHT_M, Turn};
use super::{City, Random, Route};
use voxtile::scan::Pose;

/// Route that jumps at every step to a random position in a street, within some distance of the world's origin.
///
/// Consecutive positions are far apart, the worst case for caches of recent tiles. The iterator yields the sensor's
/// poses (`world_from_sensor`) without end.
#[derive(Clone, Debug)]
pub struct Teleport {
    seed: u64,
    reach_blocks: i64,
    height_m: f64,
    next: u64,
}

/// Maximum distance of a position from the origin, in metres.
const FARTHEST_M: f64 = 1e9;

impl Teleport {
    /// Returns positions in streets at most `reach_m` metres from the origin along either axis, at the height of a
    /// car's sensor.
    pub fn new(seed: u64, reach_m: f64) -> Self {
        // The cast converts NaN to 0.
        let reach_blocks = (reach_m.clamp(0.0, FARTHEST_M) / City::BLOCK_M) as i64;
        Self { seed, reach_blocks, height_m: SENSOR_HEIGHT_M, next: 0 }
    }

    /// Sets the height of the positions above the ground, in metres.
    pub fn at_height(self, height_m: f64) -> Self {
        Self { height_m, ..self }
    }
}

impl Route for Teleport {
    fn pose(&mut self, index: u64) -> Pose {
        let mut random = Random::of(self.seed, &[6, index as i64]);
        let mut crossing = || random.below(2 * self.reach_blocks as u64 + 1) as i64 - self.reach_blocks;
        let from = [crossing(), crossing()];
        let heading = [[1, 0], [-1, 0], [0, 1], [0, -1]][random.below(4) as usize];
        let pose = Leg::new(from, heading, Turn::Ahead).pose(random.between(0.0, Leg::STREET_M));
        let mut pose = *pose.isometry();
        pose.translation.z = self.height_m;
        pose.into()
    }
}

impl Iterator for Teleport {
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
    use super::super::World;
    use super::*;

    #[test]
    fn every_place_is_in_a_street_within_reach() {
        let city = City::new(6);
        let mut farthest_m = 0.0_f64;
        for pose in Teleport::new(6, 3_000.0).take(500) {
            let at = pose.isometry().translation;
            assert!(!city.scene([at.x, at.y, at.z], 5.0).is_solid([at.x, at.y, at.z]), "at {at}");
            farthest_m = farthest_m.max(at.x.abs()).max(at.y.abs());
        }
        assert!((2_000.0..3_000.0 + City::BLOCK_M).contains(&farthest_m));
    }

    #[test]
    fn a_single_pose_equals_the_pose_in_sequence() {
        let sequence: Vec<_> = Teleport::new(2, 500.0).take(50).collect();
        let mut teleport = Teleport::new(2, 500.0);
        for index in [49, 0, 17] {
            assert_eq!(teleport.pose(index), sequence[index as usize]);
        }
        assert_eq!(teleport.at_height(60.0).pose(3).isometry().translation.z, 60.0);
    }

    #[test]
    fn every_reach_gives_a_finite_pose() {
        for reach_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            let pose = Teleport::new(1, reach_m).pose(u64::MAX);
            assert!(pose.isometry().translation.vector.iter().all(|x| x.is_finite()));
        }
    }
}
