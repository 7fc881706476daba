use super::building::{Building, Room};
use super::route::{Route, level_pose, sound_spacing};
use super::warehouse::Warehouse;
use std::f64::consts::{FRAC_PI_2, PI};
use voxtile::maths;
use voxtile::scan::Pose;

/// Endless walk through a [`Building`], along the corridor, through every door and around every pillar, or through a
/// [`Warehouse`], along every aisle.
///
/// The iterator yields the sensor's poses (`world_from_sensor`) without end.
#[derive(Clone, Debug)]
pub struct Walk {
    spacing_m: f64,
    next: u64,
    /// Corners of the closed path in metres, world frame; all segments are parallel to x or y.
    corners: Vec<[f64; 2]>,
    round_m: f64,
}

const SENSOR_HEIGHT_M: f64 = 1.4;
/// Maximum yaw to either side while walking, and the distance walked while the sensor turns left and right once.
const LOOK_RAD: f64 = 0.4;
const LOOK_EVERY_M: f64 = 7.3;

impl Walk {
    /// Returns a walk through a building with a pose every `spacing_m` metres (1 m if that is not a positive length).
    pub fn new(building: Building, spacing_m: f64) -> Self {
        let middle = 0.5 * Building::SIZE_M[1];
        let mut corners = vec![[0.9, middle]];
        for room in building.rooms() {
            let (near, far) = (Room::DEPTH_M - 1.4, 1.5);
            let (door, other) = (room.door_m(), Room::WIDTH_M - 1.2);
            let [x, _] = room.in_world(door, 0.0);
            corners.push([x, middle]);
            let around = [(door, near), (door, far), (other, far), (other, near), (door, near)];
            corners.extend(around.map(|(along, deep)| room.in_world(along, deep)));
            corners.push([x, middle]);
        }
        corners.push([Building::SIZE_M[0] - 0.9, middle]);
        corners.push([0.9, middle]);
        Self::along(corners, spacing_m)
    }

    /// Returns a round through a warehouse with a pose every `spacing_m` metres (1 m if that is not a positive length).
    pub fn in_warehouse(spacing_m: f64) -> Self {
        let [west, east] = Warehouse::AISLE_ENDS_M;
        let ways = [[west, east], [east, west]].into_iter().cycle();
        let mut corners: Vec<_> =
            Warehouse::aisles_m().zip(ways).flat_map(|(y, ends)| ends.map(|x| [x, y])).collect();
        // The number of aisles is even, so the last one ends opposite the start of the first.
        corners.extend(corners.first().copied());
        Self::along(corners, spacing_m)
    }

    fn along(corners: Vec<[f64; 2]>, spacing_m: f64) -> Self {
        let round_m = corners.windows(2).map(|pair| length_m(pair[0], pair[1])).sum();
        Self { spacing_m: sound_spacing(spacing_m), next: 0, corners, round_m }
    }
}

impl Route for Walk {
    fn pose(&mut self, index: u64) -> Pose {
        let walked_m = (index as f64 * self.spacing_m).min(f64::MAX);
        let mut rest_m = walked_m % self.round_m;
        let mut piece = [self.corners[0]; 2];
        for pair in self.corners.windows(2) {
            piece = [pair[0], pair[1]];
            let length_m = length_m(pair[0], pair[1]);
            if rest_m < length_m {
                break;
            }
            rest_m -= length_m;
        }
        let [from, to] = piece;
        let heading: [f64; 2] = std::array::from_fn(|k| sign(to[k] - from[k]));
        let heading_rad = if heading[0] > 0.0 {
            0.0
        } else if heading[0] < 0.0 {
            PI
        } else {
            FRAC_PI_2 * heading[1]
        };
        let (look, _) = maths::sin_cos(walked_m % LOOK_EVERY_M * (2.0 * PI / LOOK_EVERY_M));
        let at = |k: usize| from[k] + heading[k] * rest_m;
        level_pose([at(0), at(1), SENSOR_HEIGHT_M], heading_rad + LOOK_RAD * look)
    }
}

impl Iterator for Walk {
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

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns the length of a segment parallel to x or y.
fn length_m(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).abs() + (to[1] - from[1]).abs()
}

#[cfg(test)]
mod tests {
    use super::super::World;
    use super::*;

    #[test]
    fn a_walk_has_no_collisions() {
        let building = Building::new(6);
        let scene = building.scene([20.0, 10.0, 1.0], 60.0);
        for pose in Walk::new(building, 0.25).take(2_500) {
            let at = pose.isometry().translation;
            for (dx, dy) in [(0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25)] {
                for z in [0.1, 0.7, 1.4] {
                    assert!(!scene.is_solid([at.x + dx, at.y + dy, z]), "at {at}");
                }
            }
        }
    }

    #[test]
    fn a_round_through_a_warehouse_is_closed_and_free_of_collisions() {
        let scene = Warehouse::new(6).scene([100.0, 50.0, 1.0], 300.0);
        let walk = Walk::in_warehouse(0.5);
        assert_eq!(walk.corners.first(), walk.corners.last());
        for pair in walk.corners.windows(2) {
            assert!(pair[0][0] == pair[1][0] || pair[0][1] == pair[1][1], "{pair:?}");
        }
        let round = (walk.round_m / 0.5) as usize + 2;
        for pose in walk.take(round) {
            let at = pose.isometry().translation;
            for (dx, dy) in [(0.0, 0.0), (0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6)] {
                assert!(!scene.is_solid([at.x + dx, at.y + dy, at.z]), "at {at}");
            }
        }
    }

    #[test]
    fn a_walk_visits_all_rooms_and_repeats() {
        let mut walk = Walk::new(Building::new(6), 0.5);
        let round = (walk.round_m / 0.5) as usize;
        let (mut seen, columns) = ([[false; 2]; 8], Building::SIZE_M[0] / 8.0);
        for pose in walk.clone().take(round) {
            let (x, y) = (pose.isometry().translation.x, pose.isometry().translation.y);
            if (y - 10.0).abs() > 2.0 {
                seen[(x / columns) as usize][usize::from(y > 10.0)] = true;
            }
        }
        assert_eq!(seen, [[true; 2]; 8]);
        let again = walk.nth(round + 1).expect("no end");
        assert!((again.isometry().translation.x - 0.9).abs() < 0.6, "{again:?}");
    }

    #[test]
    fn steps_have_the_requested_length() {
        let poses: Vec<_> = Walk::new(Building::new(1), 0.2).take(4_000).collect();
        for pair in poses.windows(2) {
            let step = pair[1].isometry().translation.vector - pair[0].isometry().translation.vector;
            let length_m = step.x.abs() + step.y.abs();
            assert!(length_m < 0.2 + 1e-9, "{length_m}");
        }
    }

    #[test]
    fn every_spacing_and_index_gives_a_finite_pose() {
        for spacing_m in [0.0, -1.0, f64::NAN, 1e300, f64::MIN_POSITIVE] {
            let pose = Walk::new(Building::new(1), spacing_m).pose(u64::MAX);
            assert!(pose.isometry().translation.vector.iter().all(|x| x.is_finite()));
        }
    }
}
