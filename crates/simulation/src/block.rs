use super::body::car;
use super::{Label, Random, Solid};
use voxtile::space::Point;

/// Distance between the centre lines of two parallel streets in metres: a block and half a street on either side.
pub(super) const BLOCK_M: f64 = 60.0;

// Distances from the centre line of a street, in metres. Traffic stays within 4 m of it.
const CAR_MIDDLE_M: f64 = 5.75;
const KERB_M: f64 = 7.0;
const LAMP_M: f64 = 7.6;
const TREE_M: f64 = 8.6;
pub(super) const FRONT_M: f64 = 10.0;
/// Number of parking spaces on each side of a block.
const SPACES: i64 = 6;

/// Maximum depth of a house, in metres from the building line.
const DEEPEST_M: f64 = 15.0;

/// Returns the indices of the blocks that overlap a square with half an edge of `radius_m` metres around a point. All
/// boxes of a block are inside it.
pub(super) fn within(center: Point, radius_m: f64) -> impl Iterator<Item = [i64; 2]> {
    let range = move |k: usize| {
        // Casts to i64 saturate at distances at which f64 no longer resolves metres.
        let block_of = |x: f64| (x / BLOCK_M).floor() as i64;
        block_of(center[k] - radius_m)..=block_of(center[k] + radius_m)
    };
    range(1).flat_map(move |y| range(0).map(move |x| [x, y]))
}

/// Parking space at the kerb.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    /// Index of the block along x and y.
    pub block: [i64; 2],
    /// Number of the space in its block.
    pub number: i64,
}

/// Front door of a house.
#[derive(Clone, Copy, Debug)]
pub(super) struct Door {
    /// Middle of the threshold on the front of the house in metres, world frame.
    pub at_m: [f64; 2],
    /// Unit vector from the door to the street.
    pub outwards: [f64; 2],
    /// Distance in metres from the middle of the door to either end of the house's front.
    pub half_front_m: f64,
}

/// Adds all boxes of one block, given by its index along x and y, and returns the doors of its houses. No box extends
/// beyond the block.
///
/// `parked` returns the label of the car in a parking space, or `None` if the car has left. It is not called for empty
/// spaces.
pub(super) fn build(
    seed: u64,
    block: [i64; 2],
    parked: &dyn Fn(Space) -> Option<Label>,
    solids: &mut Vec<Solid>,
) -> Vec<Door> {
    let mut random = Random::of(seed, &block);
    let corner_m = block.map(|i| i as f64 * BLOCK_M);
    let is_park = random.chance(0.12);
    let mut sides = [Side::South, Side::North, Side::West, Side::East].map(|side| Edge {
        side,
        corner_m,
        solids: Vec::new(),
        doors: Vec::new(),
    });
    let mut doors = Vec::new();
    let [south, _, west, _] = &mut sides;
    south.add([KERB_M, BLOCK_M - KERB_M], [KERB_M, BLOCK_M - KERB_M], [0.0, 0.15], 0.38);
    if is_park {
        park(&mut random, west);
    }
    for (number, edge) in (0..).zip(&mut sides) {
        if !is_park {
            houses(&mut random, edge);
        }
        furniture(&mut random, edge);
        parked_cars(&mut random, edge, &|slot| parked(Space { block, number: SPACES * number + slot }));
        solids.append(&mut edge.solids);
        doors.append(&mut edge.doors);
    }
    doors
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    South,
    North,
    West,
    East,
}

/// One side of a block, in coordinates `along` its street and `off` the street's centre line.
struct Edge {
    side: Side,
    corner_m: [f64; 2],
    solids: Vec<Solid>,
    doors: Vec<Door>,
}

impl Edge {
    fn add(&mut self, along_m: [f64; 2], off_m: [f64; 2], z_m: [f64; 2], reflectivity: f64) {
        let corner = |i: usize| {
            let [x, y] = self.in_world(along_m[i], off_m[i]);
            [x, y, z_m[i]]
        };
        self.solids.push(Solid::new(corner(0), corner(1), reflectivity));
    }

    fn in_world(&self, along_m: f64, off_m: f64) -> [f64; 2] {
        let [x, y] = match self.side {
            Side::South => [along_m, off_m],
            Side::North => [along_m, BLOCK_M - off_m],
            Side::West => [off_m, along_m],
            Side::East => [BLOCK_M - off_m, along_m],
        };
        [self.corner_m[0] + x, self.corner_m[1] + y]
    }

    /// Returns the unit vector from the block to the street.
    fn outwards(&self) -> [f64; 2] {
        match self.side {
            Side::South => [0.0, -1.0],
            Side::North => [0.0, 1.0],
            Side::West => [-1.0, 0.0],
            Side::East => [1.0, 0.0],
        }
    }

    /// Adds a box, given by its middle and size along and off the street.
    fn add_at(&mut self, middle_m: [f64; 2], size_m: [f64; 2], z_m: [f64; 2], reflectivity: f64) {
        let span = |k: usize| [middle_m[k] - 0.5 * size_m[k], middle_m[k] + 0.5 * size_m[k]];
        self.add(span(0), span(1), z_m, reflectivity);
    }
}

/// Adds a row of houses. South and north rows reach from corner to corner; west and east rows fill the gap between
/// them.
fn houses(random: &mut Random, edge: &mut Edge) {
    let between = matches!(edge.side, Side::West | Side::East);
    let inset_m = FRONT_M + if between { DEEPEST_M + 0.5 } else { 0.0 };
    let end = BLOCK_M - inset_m;
    let mut along = inset_m;
    if between && random.chance(0.3) {
        // Open yard behind a wall.
        edge.add([along, end], [FRONT_M, FRONT_M + 0.25], [0.15, random.between(0.8, 2.0)], 0.5);
        return;
    }
    while along < end - 4.0 {
        let mut width = random.between(7.0, 15.0);
        if end - along - width < 7.0 {
            width = end - along;
        }
        let setback = if random.chance(0.4) { random.between(0.2, 1.8) } else { 0.0 };
        house(random, edge, [along, along + width], FRONT_M + setback);
        along += width + if random.chance(0.25) { random.between(1.5, 4.0) } else { 0.0 };
    }
}

fn house(random: &mut Random, edge: &mut Edge, along_m: [f64; 2], front_m: f64) {
    let storeys = 2 + random.below(6);
    let height = 0.6 + storeys as f64 * 3.1;
    let back = FRONT_M + random.between(10.0, DEEPEST_M);
    let reflectivity = random.between(0.3, 0.8);
    edge.add(along_m, [front_m, back], [0.0, height], reflectivity);
    if random.chance(0.5) {
        let roof = [along_m[0] + 1.5, along_m[1] - 1.5];
        edge.add(roof, [front_m + 2.0, back - 2.0], [height, height + random.between(1.0, 3.0)], 0.3);
    }
    let middle = 0.5 * (along_m[0] + along_m[1]);
    edge.doors.push(Door {
        at_m: edge.in_world(middle, front_m),
        outwards: edge.outwards(),
        half_front_m: 0.5 * (along_m[1] - along_m[0]),
    });
    // Steps to the door.
    edge.add_at([middle, front_m - 0.3], [1.6, 0.6], [0.15, 0.55], 0.45);
    if random.chance(0.5) {
        for storey in 1..storeys {
            let floor = 0.6 + storey as f64 * 3.1;
            for side in [-0.27, 0.27] {
                let at = middle + side * (along_m[1] - along_m[0]);
                edge.add_at([at, front_m - 0.5], [2.4, 1.0], [floor, floor + 0.15], 0.5);
                edge.add_at([at, front_m - 0.97], [2.4, 0.06], [floor + 0.15, floor + 1.1], 0.6);
            }
        }
    }
}

/// Adds lamps, signs, trees and bins on the pavement.
fn furniture(random: &mut Random, edge: &mut Edge) {
    for slot in 0..3 {
        let along = 12.0 + 18.0 * f64::from(slot);
        edge.add_at([along, LAMP_M], [0.18, 0.18], [0.15, 6.0], 0.7);
        edge.add([along - 0.06, along + 0.06], [LAMP_M - 1.6, LAMP_M], [6.0, 6.15], 0.7);
        if slot < 2 && random.chance(0.6) {
            let at = [along + random.between(5.0, 8.0), TREE_M];
            tree(random, edge, at);
        }
        if random.chance(0.35) {
            edge.add_at([along + random.between(1.0, 3.0), LAMP_M], [0.5, 0.5], [0.15, 1.15], 0.55);
        }
        if random.chance(0.25) {
            let sign = along + random.between(9.5, 12.0);
            if sign < BLOCK_M - FRONT_M {
                edge.add_at([sign, LAMP_M], [0.07, 0.07], [0.15, 2.3], 0.8);
                edge.add_at([sign, LAMP_M], [0.05, 0.6], [2.3, 2.9], 0.95);
            }
        }
    }
}

fn tree(random: &mut Random, edge: &mut Edge, at_m: [f64; 2]) {
    let trunk = random.between(2.2, 3.0);
    let crown = random.between(2.2, 3.0);
    edge.add_at(at_m, [0.32, 0.32], [0.0, trunk], 0.3);
    edge.add_at(at_m, [crown; 2], [trunk, trunk + crown], 0.5);
    edge.add_at(at_m, [0.6 * crown; 2], [trunk + crown, trunk + 1.4 * crown], 0.5);
}

fn parked_cars(random: &mut Random, edge: &mut Edge, parked: &dyn Fn(i64) -> Option<Label>) {
    for slot in 0..SPACES {
        if !random.chance(0.62) {
            continue;
        }
        let at =
            [14.5 + 6.2 * slot as f64 + random.between(-0.4, 0.4), CAR_MIDDLE_M + random.between(-0.1, 0.2)];
        let paint = random.between(0.15, 0.9);
        let is_van = random.chance(0.18);
        let Some(label) = parked(slot) else { continue };
        let first = edge.solids.len();
        for part in car(is_van, paint) {
            edge.add_at([at[0] + part.ahead_m, at[1]], part.size_m, part.z_m, part.reflectivity);
        }
        edge.solids[first..].iter_mut().for_each(|solid| solid.label = label);
    }
}

/// Adds trees on a jittered grid and a pavilion.
fn park(random: &mut Random, edge: &mut Edge) {
    for row in 0..4 {
        for column in 0..4 {
            let (x, y) = (15.0 + 10.0 * f64::from(column), 15.0 + 10.0 * f64::from(row));
            let at = [x + random.between(-2.0, 2.0), y + random.between(-2.0, 2.0)];
            if random.chance(0.75) {
                tree(random, edge, at);
            }
        }
    }
    edge.add_at([random.between(28.0, 32.0), 30.0], [4.0, 5.0], [0.0, 3.2], 0.6);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_box_leaves_its_block_or_blocks_traffic() {
        for index in 0..400 {
            let block = [index % 20 - 10, index / 20 - 10];
            let mut solids = Vec::new();
            build(11, block, &|_| Some(Label::Parked), &mut solids);
            assert!(solids.len() > 20);
            for solid in solids {
                for (k, &coordinate) in block.iter().enumerate() {
                    let low = coordinate as f64 * BLOCK_M;
                    assert!(solid.bounds.min[k] >= low + 4.0, "{solid:?}");
                    assert!(solid.bounds.max[k] <= low + BLOCK_M - 4.0, "{solid:?}");
                }
                assert!(solid.bounds.min[2] >= 0.0);
            }
        }
    }
}
