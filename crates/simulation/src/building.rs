use super::{Random, Scene, Solid, World};
use voxtile::space::Point;

/// Synthetic office floor of 40 x 20 x 3 m: a corridor, eight rooms on either side, doors, pillars, furniture.
///
/// One corner is the world's origin; the floor is the plane z = 0. The walls are the same for all seeds, doors and
/// furniture differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Building {
    seed: u64,
}

/// Room of a [`Building`]. Its coordinates start at a corner of its outer wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    column: u32,
    is_south: bool,
    door_m: f64,
}

const OUTER_WALL_M: f64 = 0.2;
/// Half the thickness of the walls between rooms, in metres.
const HALF_WALL_M: f64 = 0.06;
const DOOR_WIDTH_M: f64 = 1.0;
const DOOR_HEIGHT_M: f64 = 2.1;
const CORRIDOR_M: f64 = 2.2;

const WALL: f64 = 0.75;
const FLOOR: f64 = 0.4;
const WOOD: f64 = 0.55;

impl Building {
    /// Length, depth and height in metres.
    pub const SIZE_M: [f64; 3] = [40.0, 20.0, 3.0];

    /// Returns the building of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Returns all rooms in order of a walk along the corridor.
    pub(super) fn rooms(self) -> impl Iterator<Item = Room> {
        (0..2 * Room::COLUMNS).map(move |number| {
            let mut random = Random::of(self.seed, &[3, i64::from(number)]);
            Room { column: number / 2, is_south: number % 2 == 0, door_m: random.between(1.15, 1.9) }
        })
    }

    fn solids(self) -> Vec<Solid> {
        let [length, depth, height] = Self::SIZE_M;
        let mut solids = vec![
            Solid::new([0.0; 3], [length, OUTER_WALL_M, height], WALL),
            Solid::new([0.0, depth - OUTER_WALL_M, 0.0], Self::SIZE_M, WALL),
            Solid::new([0.0; 3], [OUTER_WALL_M, depth, height], WALL),
            Solid::new([length - OUTER_WALL_M, 0.0, 0.0], Self::SIZE_M, WALL),
            Solid::new([0.0, 0.0, height], [length, depth, height + 0.3], WALL),
        ];
        for (number, room) in (0..).zip(self.rooms()) {
            room.build(&mut Random::of(self.seed, &[4, number]), &mut solids);
        }
        solids
    }
}

impl World for Building {
    fn scene(&self, center: Point, radius_m: f64) -> Scene {
        Scene::new(self.solids(), FLOOR, center, radius_m)
    }
}

impl Room {
    const COLUMNS: u32 = 8;
    pub(super) const WIDTH_M: f64 = Building::SIZE_M[0] / Self::COLUMNS as f64;
    pub(super) const DEPTH_M: f64 = 0.5 * (Building::SIZE_M[1] - CORRIDOR_M);

    /// Returns the middle of the door along the room's width, in metres.
    pub(super) fn door_m(&self) -> f64 {
        self.door_m
    }

    /// Converts room coordinates to world x and y: `along_m` along the room's width, `deep_m` from its outer wall to
    /// the corridor.
    pub(super) fn in_world(&self, along_m: f64, deep_m: f64) -> [f64; 2] {
        let y = if self.is_south { deep_m } else { Building::SIZE_M[1] - deep_m };
        [f64::from(self.column) * Self::WIDTH_M + along_m, y]
    }

    fn build(&self, random: &mut Random, solids: &mut Vec<Solid>) {
        let height = Building::SIZE_M[2];
        let mut add = |along_m: [f64; 2], deep_m: [f64; 2], z_m: [f64; 2], reflectivity| {
            let [x0, y0] = self.in_world(along_m[0], deep_m[0]);
            let [x1, y1] = self.in_world(along_m[1], deep_m[1]);
            solids.push(Solid::new([x0, y0, z_m[0]], [x1, y1, z_m[1]], reflectivity));
        };
        let (width, depth) = (Self::WIDTH_M, Self::DEPTH_M);
        // Wall to the next room, and wall to the corridor with the door.
        if self.column + 1 < Self::COLUMNS {
            add([width - HALF_WALL_M, width + HALF_WALL_M], [0.0, depth], [0.0, height], WALL);
        }
        let front = [depth - HALF_WALL_M, depth + HALF_WALL_M];
        let door = [self.door_m - 0.5 * DOOR_WIDTH_M, self.door_m + 0.5 * DOOR_WIDTH_M];
        add([0.0, door[0]], front, [0.0, height], WALL);
        add([door[1], width], front, [0.0, height], WALL);
        add(door, front, [DOOR_HEIGHT_M, height], WALL);
        // Pillar in the middle of the room; `Walk` leads around it.
        let middle = [0.5 * width, 0.5 * depth];
        add([middle[0] - 0.22, middle[0] + 0.22], [middle[1] - 0.22, middle[1] + 0.22], [0.0, height], 0.6);
        // Furniture is at the walls.
        for (wall, inwards) in [(0.25, 1.0), (width - 0.25, -1.0)] {
            let mut deep = 1.6;
            while deep < depth - 2.2 {
                let size = random.between(0.8, 1.8);
                let to = wall + inwards * random.between(0.35, 0.6);
                match random.below(4) {
                    0 => add([wall, to], [deep, deep + size], [0.0, random.between(0.7, 2.2)], WOOD),
                    1 | 2 => {
                        add([wall, to], [deep, deep + size], [0.72, 0.75], WOOD);
                        add([wall, to], [deep, deep + 0.04], [0.0, 0.72], WOOD);
                        add([wall, to], [deep + size - 0.04, deep + size], [0.0, 0.72], WOOD);
                        add([wall, wall + inwards * 0.2], [deep + 0.2, deep + 0.7], [0.75, 1.2], 0.15);
                    }
                    _ => {}
                }
                deep += size + random.between(0.1, 0.6);
            }
        }
        add([1.0, width - 1.0], [OUTER_WALL_M, OUTER_WALL_M + 0.3], [0.0, 0.8], 0.8);
        add([1.2, width - 1.2], [middle[1] - 0.1, middle[1] + 0.1], [height - 0.25, height - 0.15], 0.9);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_building_is_closed() {
        let building = Building::new(3);
        let origin = [20.3, 10.0, 1.4];
        let scene = building.scene(origin, 60.0);
        let mut random = Random::of(1, &[]);
        for _ in 0..10_000 {
            let direction = std::array::from_fn(|_| random.between(-1.0, 1.0));
            let hit = scene.cast(origin, direction, 60.0);
            assert!(hit.is_some_and(|hit| hit.distance_m < 40.0), "{direction:?} {hit:?}");
        }
    }

    #[test]
    fn every_door_is_open() {
        let building = Building::new(3);
        for room in building.rooms() {
            let [x, y] = room.in_world(room.door_m(), Room::DEPTH_M + 1.0);
            let [_, inside] = room.in_world(0.0, 2.0);
            let hit = building.cast([x, y, 1.4], [0.0, inside - y, 0.0], 60.0);
            assert!(hit.is_some_and(|hit| hit.distance_m > (inside - y).abs()), "{room:?}");
        }
    }
}
