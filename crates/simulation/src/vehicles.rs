use super::block::BLOCK_M;
use super::body::{Place, car, cyclist, tram};
use super::{Label, Random, Solid};
use voxtile::space::Point;

/// Speed of cars and trams in metres per second.
pub(super) const CAR_MPS: f64 = 8.0;
/// Half as fast, so that cyclists and cars pass a crossing in the same phase.
const CYCLIST_MPS: f64 = 4.0;
/// Distances of the middle of cars and of cyclists from the centre line of the street, in metres.
const LANE_M: f64 = 2.0;
const CYCLISTS_M: f64 = 3.55;
/// Position on its street of slot 0 of the cars at time 0, in metres: where drives start.
const START_M: f64 = 8.0;

/// Distance between two slots of a lane in metres. A slot has room for two cars or a tram.
///
/// Slots pass the crossings of a street at the same time. Those of crossing streets pass them half a period later, so
/// vehicles need not stop.
const CARS_EVERY_M: f64 = BLOCK_M;
const CYCLISTS_EVERY_M: f64 = 0.5 * BLOCK_M;
/// Distance of the middle of a car from the middle of its slot, in metres.
const CAR_IN_SLOT_M: f64 = 6.5;
/// Half the length of the longest slot's content, in metres.
const REACH_M: f64 = 10.0;

/// One direction of a street.
#[derive(Clone, Copy, Debug)]
struct Lane {
    /// Axis of the street: 0 along x, 1 along y.
    axis: usize,
    /// Number of the street: its centre line is at this multiple of the block's size.
    street: i64,
    /// 1 for traffic towards larger coordinates, -1 for the other direction.
    sign: i64,
}

/// Adds the vehicles and cyclists that may overlap a square with half an edge of `radius_m` metres around a point at a
/// time in seconds, one list of boxes for each.
pub(super) fn within(seed: u64, center: Point, radius_m: f64, time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
    for axis in 0..2 {
        // Casts to i64 saturate.
        let street_of = |x: f64| (x / BLOCK_M).round() as i64;
        let across = center[1 - axis];
        for street in street_of(across - radius_m)..=street_of(across + radius_m) {
            for sign in [1, -1] {
                let lane = Lane { axis, street, sign };
                let range_m = [center[axis] - radius_m - REACH_M, center[axis] + radius_m + REACH_M];
                lane.cars(seed, range_m, time_s, bodies);
                lane.cyclists(seed, range_m, time_s, bodies);
            }
        }
    }
}

impl Lane {
    fn cars(self, seed: u64, range_m: [f64; 2], time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
        let has_trams = self.axis == 0 && self.street.rem_euclid(3) == 0;
        let shift_m = START_M + self.axis as f64 * 0.5 * CARS_EVERY_M + CAR_MPS * time_s;
        self.each_slot(range_m, CARS_EVERY_M, shift_m, |slot, along_m| {
            let is_of_sensor = self.axis == 0 && self.street == 0 && self.sign == 1 && slot == 0;
            if is_of_sensor {
                return;
            }
            let mut random = self.random(seed, 20, slot);
            let place = self.place(along_m, LANE_M);
            if has_trams && random.chance(0.3) {
                bodies.push(place.body(tram(), Label::Moving));
                return;
            }
            for ahead_m in [-CAR_IN_SLOT_M, CAR_IN_SLOT_M] {
                let (is_present, is_van, paint) =
                    (random.chance(0.65), random.chance(0.18), random.between(0.15, 0.9));
                if is_present {
                    let place = place.shifted(ahead_m + random.between(-0.5, 0.5), 0.0);
                    bodies.push(place.body(car(is_van, paint), Label::Moving));
                }
            }
        });
    }

    fn cyclists(self, seed: u64, range_m: [f64; 2], time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
        // Half of the shift of the cars, because the speed is half of theirs.
        let shift_m = 0.5 * START_M + self.axis as f64 * 0.5 * CYCLISTS_EVERY_M + CYCLIST_MPS * time_s;
        self.each_slot(range_m, CYCLISTS_EVERY_M, shift_m, |slot, along_m| {
            let mut random = self.random(seed, 21, slot);
            if random.chance(0.4) {
                let place = self.place(along_m, CYCLISTS_M);
                bodies.push(place.body(cyclist(random.between(0.2, 0.9)), Label::Moving));
            }
        });
    }

    /// Calls a function with the number and the position of each slot whose middle is in a range of the street, in
    /// metres.
    fn each_slot(self, range_m: [f64; 2], every_m: f64, shift_m: f64, mut visit: impl FnMut(i64, f64)) {
        let moved_m = self.sign as f64 * shift_m;
        let [first, last] = range_m.map(|x| (x - moved_m) / every_m);
        for slot in first.ceil() as i64..=last.floor() as i64 {
            visit(slot, slot as f64 * every_m + moved_m);
        }
    }

    /// Returns the place at a position along the street, at a distance to the right of its centre line.
    fn place(self, along_m: f64, right_m: f64) -> Place {
        let sign = self.sign as f64;
        let ahead = if self.axis == 0 { [sign, 0.0] } else { [0.0, sign] };
        let center_m = self.street as f64 * BLOCK_M;
        let at_m = if self.axis == 0 { [along_m, center_m] } else { [center_m, along_m] };
        Place { at_m, ahead, ground_m: 0.0 }.shifted(0.0, -right_m)
    }

    fn random(self, seed: u64, kind: i64, slot: i64) -> Random {
        Random::of(seed, &[kind, self.axis as i64, self.street, self.sign, slot])
    }
}
