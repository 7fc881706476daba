use super::{Random, Scene, Solid, World};
use voxtile::space::Point;

/// Synthetic warehouse of 200 x 100 x 8 m: rows of racks with goods on shelves, and aisles between them.
///
/// One corner is the world's origin; the floor is the plane z = 0. The racks are the same for all seeds, the goods
/// differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warehouse {
    seed: u64,
}

const WALL_M: f64 = 0.3;
/// Depth of a row: two racks back to back.
const ROW_M: f64 = 2.4;
/// Distance between the middles of two rows.
const ROW_EVERY_M: f64 = 8.0;
/// Extents along x of the two blocks of racks in a row. The gap between them is the cross aisle.
const BLOCKS_M: [[f64; 2]; 2] = [[12.0, 94.0], [106.0, 188.0]];
/// Length of a bay of a rack, from upright to upright.
const BAY_M: f64 = 4.1;
/// Heights of the shelves.
const BOARDS_M: [f64; 3] = [0.15, 2.1, 4.0];
const RACK_HEIGHT_M: f64 = 6.0;

const WALL: f64 = 0.7;
const FLOOR: f64 = 0.4;
const STEEL: f64 = 0.6;
const GOODS: f64 = 0.5;

impl Warehouse {
    /// Length, depth and height in metres.
    pub const SIZE_M: [f64; 3] = [200.0, 100.0, 8.0];

    /// Returns the warehouse of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Returns the middles of the rows, in metres along y.
    fn rows_m() -> impl Iterator<Item = f64> {
        (1..12).map(|row| ROW_EVERY_M * f64::from(row) + 2.0)
    }

    /// Returns the middles of the aisles between rows, in metres along y, ascending.
    pub(super) fn aisles_m() -> impl Iterator<Item = f64> {
        (0..12).map(|aisle| ROW_EVERY_M * f64::from(aisle) + 0.5 * ROW_EVERY_M + 2.0)
    }

    /// Ends of the aisles beyond the racks, in metres along x.
    pub(super) const AISLE_ENDS_M: [f64; 2] = [8.0, 192.0];

    fn solids(self) -> Vec<Solid> {
        let [length, depth, height] = Self::SIZE_M;
        let mut solids = vec![
            Solid::new([0.0; 3], [length, WALL_M, height], WALL),
            Solid::new([0.0, depth - WALL_M, 0.0], Self::SIZE_M, WALL),
            Solid::new([0.0; 3], [WALL_M, depth, height], WALL),
            Solid::new([length - WALL_M, 0.0, 0.0], Self::SIZE_M, WALL),
            Solid::new([0.0, 0.0, height], [length, depth, height + 0.3], WALL),
        ];
        for (number, row_m) in (0..).zip(Self::rows_m()) {
            let mut random = Random::of(self.seed, &[5, number]);
            for [from_m, to_m] in BLOCKS_M {
                let bays = ((to_m - from_m) / BAY_M) as u32;
                (0..bays).for_each(|bay| {
                    build_bay(&mut random, from_m + BAY_M * f64::from(bay), row_m, &mut solids);
                });
            }
        }
        solids
    }
}

impl World for Warehouse {
    fn scene(&self, center: Point, radius_m: f64) -> Scene {
        Scene::new(self.solids(), FLOOR, center, radius_m)
    }
}

fn build_bay(random: &mut Random, x_m: f64, row_m: f64, solids: &mut Vec<Solid>) {
    let [near, far] = [row_m - 0.5 * ROW_M, row_m + 0.5 * ROW_M];
    for y_m in [near, far - 0.1] {
        solids.push(Solid::new([x_m, y_m, 0.0], [x_m + 0.1, y_m + 0.1, RACK_HEIGHT_M], STEEL));
    }
    for board_m in BOARDS_M {
        solids.push(Solid::new([x_m, near, board_m - 0.1], [x_m + BAY_M, far, board_m], STEEL));
        for side in [near, row_m] {
            // Some storage places are empty.
            if random.below(4) > 0 {
                let (begin, end) = (random.between(0.2, 0.6), random.between(3.2, 3.9));
                let height_m = random.between(0.6, 1.6);
                let (min, max) =
                    ([x_m + begin, side + 0.1, board_m], [x_m + end, side + 1.0, board_m + height_m]);
                solids.push(Solid::new(min, max, GOODS));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warehouse_is_closed() {
        let origin = [100.0, 50.0, 7.0];
        let scene = Warehouse::new(3).scene(origin, 300.0);
        let mut random = Random::of(1, &[]);
        for _ in 0..10_000 {
            let direction = std::array::from_fn(|_| random.between(-1.0, 1.0));
            let hit = scene.cast(origin, direction, 300.0);
            assert!(hit.is_some_and(|hit| hit.distance_m < 130.0), "{direction:?} {hit:?}");
        }
    }

    #[test]
    fn goods_differ_by_seed_and_stay_out_of_the_aisles() {
        let [some, others] = [1, 2].map(|seed| Warehouse::new(seed).solids());
        assert_ne!(some, others);
        let is_free = |y_m: f64| {
            let mut inside = some.iter().filter(|solid| solid.bounds.min[2] < 7.9);
            inside.all(|solid| !solid.bounds.contains([50.0, y_m, 1.0]))
        };
        assert!(Warehouse::aisles_m().all(is_free));
        assert!(Warehouse::rows_m().any(|row_m| !is_free(row_m - 0.25 * ROW_M)));
    }
}
