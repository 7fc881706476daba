use super::random::{between, unit};
use super::scene::{Scene, Solid, World};
use crate::space::{Aabb, Point};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// An endless city of blocks between straight streets: buildings of all heights, parked cars, poles, trees.
///
/// Streets run along x and y at whole multiples of the block pitch; the drive goes along their middle, in loops that
/// grow and keep coming back to where it began.
#[derive(Clone, Copy, Debug)]
pub struct City {
    seed: u64,
}

/// From street to street.
const PITCH_M: f64 = 60.0;
/// From house to house across the street.
const STREET_M: f64 = 13.0;
const SENSOR_HEIGHT_M: f64 = 1.9;

impl City {
    /// The city of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    fn add_block(&self, scene: &mut Scene, bx: i64, by: i64) {
        let seed = self.seed;
        let corner = [bx as f64 * PITCH_M + STREET_M / 2.0, by as f64 * PITCH_M + STREET_M / 2.0];
        let side = PITCH_M - STREET_M;
        // Three by three plots; the middle one is a yard.
        for plot in (0..9).filter(|&plot| plot != 4) {
            let random = |low, high, what| between(low, high, seed, bx * 16 + plot, by, what);
            if random(0.0, 1.0, 0) < 0.08 {
                self.add_tree(scene, corner, side, plot, random(0.0, 1.0, 9));
                continue;
            }
            let place = |k: i64, axis: usize| corner[axis] + k as f64 * side / 3.0;
            let (px, py) = (plot % 3, plot / 3);
            let setback = random(0.0, 1.5, 1);
            let min = [place(px, 0) + setback, place(py, 1) + random(0.0, 1.5, 2), 0.0];
            let max =
                [place(px + 1, 0) - random(0.0, 1.0, 3), place(py + 1, 1) - setback, random(4.0, 22.0, 4)];
            scene.add(Solid { bounds: Aabb { min, max }, reflectivity: random(0.25, 0.8, 5) });
        }
        for axis in 0..2 {
            self.add_kerb(scene, [bx, by], axis);
        }
    }

    /// Cars and poles on both sides of the street along `axis` that begins at the block's crossing.
    fn add_kerb(&self, scene: &mut Scene, block: [i64; 2], axis: usize) {
        let [bx, by] = block;
        for slot in 0..14 {
            let random = |low, high, what| {
                between(low, high, self.seed ^ 0xcafe, bx * 64 + slot, by * 4 + axis as i64, what)
            };
            let side = if slot % 2 == 0 { 1.0 } else { -1.0 };
            let along = block[axis] as f64 * PITCH_M + STREET_M / 2.0 + 3.0 + (slot / 2) as f64 * 6.0;
            let middle = block[1 - axis] as f64 * PITCH_M;
            let mut add = |from: [f64; 2], to: [f64; 2], height_m, reflectivity| {
                let swap =
                    |[along, across]: [f64; 2]| if axis == 0 { [along, across] } else { [across, along] };
                let ([x0, y0], [x1, y1]) = (swap(from), swap(to));
                let bounds = Aabb::from_corners([x0, y0, 0.0], [x1, y1, height_m]);
                scene.add(Solid { bounds, reflectivity });
            };
            if random(0.0, 1.0, 0) < 0.45 {
                let near = middle + side * 3.8;
                let length_m = random(3.8, 4.8, 1);
                add(
                    [along, near],
                    [along + length_m, near + side * 1.8],
                    random(1.4, 1.9, 2),
                    random(0.3, 0.9, 3),
                );
            }
            if slot % 6 < 2 {
                let near = middle + side * 5.9;
                add([along, near], [along + 0.2, near + side * 0.2], 6.0, 0.6);
            }
        }
    }

    fn add_tree(&self, scene: &mut Scene, corner: [f64; 2], side: f64, plot: i64, size: f64) {
        let middle = |k: i64, axis: usize| corner[axis] + (k as f64 + 0.5) * side / 3.0;
        let (x, y) = (middle(plot % 3, 0), middle(plot / 3, 1));
        let mut add = |radius_m: f64, low_m, high_m, reflectivity| {
            let bounds =
                Aabb { min: [x - radius_m, y - radius_m, low_m], max: [x + radius_m, y + radius_m, high_m] };
            scene.add(Solid { bounds, reflectivity });
        };
        add(0.25, 0.0, 2.5, 0.3);
        add(1.2 + size, 2.5, 5.0 + 2.0 * size, 0.5);
    }

    /// The rectangle of streets of one lap, as signed numbers of blocks along x and y.
    fn lap(&self, number: i64) -> [i64; 2] {
        let size = |axis| 1 + number / 4 + (unit(self.seed ^ 0x1a9, number, axis, 0) * 2.0) as i64;
        let quadrant = number % 4;
        let sign = |is_negative| if is_negative { -1 } else { 1 };
        [size(0) * sign(quadrant == 1 || quadrant == 2), size(1) * sign(quadrant >= 2)]
    }
}

impl World for City {
    fn scene(&self, center: Point, radius_m: f64) -> Scene {
        let mut scene = Scene::default();
        let block = |coordinate: f64| (coordinate / PITCH_M).floor() as i64;
        for bx in block(center[0] - radius_m)..=block(center[0] + radius_m) {
            for by in block(center[1] - radius_m)..=block(center[1] + radius_m) {
                self.add_block(&mut scene, bx, by);
            }
        }
        scene
    }

    fn pose_at(&self, distance_m: f64) -> Isometry3<f64> {
        // Laps begin and end at the crossing at the origin. There are about the cube root of the length of them.
        let mut rest_m = distance_m.max(0.0);
        let mut number = 0;
        let [width, height] = loop {
            let lap = self.lap(number);
            let length_m = 2.0 * (lap[0].abs() + lap[1].abs()) as f64 * PITCH_M;
            if rest_m < length_m {
                break lap.map(|blocks| blocks as f64 * PITCH_M);
            }
            rest_m -= length_m;
            number += 1;
        };
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height], [0.0, 0.0]];
        for side in corners.windows(2) {
            let ([x0, y0], [x1, y1]) = (side[0], side[1]);
            let length_m = (x1 - x0).abs() + (y1 - y0).abs();
            if rest_m <= length_m {
                let (dx, dy) = ((x1 - x0) / length_m, (y1 - y0) / length_m);
                return pose([x0 + dx * rest_m, y0 + dy * rest_m, SENSOR_HEIGHT_M], [dx, dy]);
            }
            rest_m -= length_m;
        }
        pose([0.0, 0.0, SENSOR_HEIGHT_M], [1.0, 0.0])
    }
}

/// A pose whose x axis points along one of the four directions of the streets.
pub(super) fn pose(place: Point, [dx, dy]: [f64; 2]) -> Isometry3<f64> {
    // Half the angle of a heading of 0, 90, 180 or 270 degrees: no rounding of an angle is involved.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (w, z) = match (dx > 0.5, dx < -0.5, dy > 0.5) {
        (true, _, _) => (1.0, 0.0),
        (_, true, _) => (0.0, 1.0),
        (_, _, true) => (half, half),
        _ => (half, -half),
    };
    let rotation = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, 0.0, 0.0, z));
    Isometry3::from_parts(Translation3::new(place[0], place[1], place[2]), rotation)
}
