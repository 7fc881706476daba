use super::block::Door;
use super::body::{Place, door_leaf, walker};
use super::round::{PAVEMENT_M, Round};
use super::{Label, Random, Solid};
use std::f64::consts::FRAC_PI_2;
use voxtile::maths;

/// Speed on the outer and the inner round of a block, in metres per second. All walkers of a round have the same speed,
/// so none overtakes another.
pub(super) const OUTER_MPS: f64 = 1.25;
const INNER_MPS: f64 = 1.4;
/// Number of slots on a round. A slot has a walker or a group, or is empty.
const SLOTS: i64 = 20;
const OCCUPIED: f64 = 0.5;
/// Distance between members of a group, in metres.
const GROUP_M: f64 = 1.2;

/// Width of a leaf of a double door, in metres.
const LEAF_M: f64 = 0.6;
/// Seconds in which a door opens or closes.
const SWING_S: f64 = 1.5;

/// Adds the walkers on both rounds of a block at a time in seconds, one list of boxes for each walker.
pub(super) fn on_rounds(seed: u64, block: [i64; 2], time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
    for (number, round, speed_mps) in [(0, Round::OUTER, OUTER_MPS), (1, Round::INNER, INNER_MPS)] {
        for slot in 0..SLOTS {
            // Slot of the sensor.
            if block == [0, 0] && number == 0 && slot == 0 {
                continue;
            }
            let mut random = Random::of(seed, &[10, block[0], block[1], number, slot]);
            if !random.chance(OCCUPIED) {
                continue;
            }
            let members = if random.chance(0.4) { 2 + random.below(3) } else { 1 };
            let start_m = round.length_m() * slot as f64 / SLOTS as f64;
            for member in 0..members {
                let walked_m = start_m - GROUP_M * member as f64 + speed_mps * time_s;
                let place = round.place(block, walked_m);
                bodies.push(person(&mut random, place, walked_m));
            }
        }
    }
}

/// Adds a person who walks to and fro close to the wall near a door and stands at both ends for some seconds; houses
/// have one with a probability of 0.4.
pub(super) fn at_wall(seed: u64, door: &Door, time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
    const NEAR_M: f64 = 1.3;
    const SPEED_MPS: f64 = 1.0;
    let mut random = random_of(seed, 11, door);
    let gap_m = random.between(0.2, 0.28);
    let (is_present, is_left) = (random.chance(0.4), random.chance(0.5));
    let walk_m = (door.half_front_m - 0.45).min(4.0) - NEAR_M;
    if !is_present || walk_m < 0.5 {
        return;
    }
    let walk_s = walk_m / SPEED_MPS;
    let pauses_s = [random.between(3.0, 12.0), random.between(3.0, 12.0)];
    let period_s = pauses_s[0] + pauses_s[1] + 2.0 * walk_s;
    let now_s = (time_s + random.between(0.0, period_s)).rem_euclid(period_s);
    // Stand, walk away from the door, stand, walk back.
    let out_s = (now_s - pauses_s[0]).clamp(0.0, walk_s);
    let back_s = (now_s - pauses_s[0] - walk_s - pauses_s[1]).clamp(0.0, walk_s);
    let walked_m = SPEED_MPS * (out_s - back_s);
    let [ox, oy] = door.outwards;
    let side = if is_left { 1.0 } else { -1.0 };
    let along = [side * oy, -side * ox];
    let facing = if back_s > 0.0 { along.map(|x| -x) } else { along };
    // Half the width of a person is 0.22 m.
    let off_m = gap_m + 0.22;
    let at_m =
        std::array::from_fn(|k| door.at_m[k] + along[k] * (NEAR_M + walked_m) + door.outwards[k] * off_m);
    bodies.push(person(&mut random, Place { at_m, ahead: facing, ground_m: PAVEMENT_M }, walked_m));
}

/// Adds both leaves of a door that opens for some seconds now and then.
pub(super) fn door(seed: u64, door: &Door, time_s: f64, bodies: &mut Vec<Vec<Solid>>) {
    let mut random = random_of(seed, 12, door);
    let (closed_s, open_s) = (random.between(5.0, 15.0), random.between(2.0, 6.0));
    let period_s = closed_s + open_s + 2.0 * SWING_S;
    let now_s = (time_s + random.between(0.0, period_s)).rem_euclid(period_s);
    let opening = (now_s / SWING_S).min(1.0);
    let closing = ((now_s - SWING_S - open_s) / SWING_S).clamp(0.0, 1.0);
    let (sin, cos) = maths::sin_cos(FRAC_PI_2 * (opening - closing));
    let label = if closing < 1.0 { Label::Moving } else { Label::Static };
    // The leaves are in front of the wall, so that a closed door is visible.
    let middle = Place { at_m: door.at_m, ahead: door.outwards, ground_m: 0.0 }.shifted(0.03, 0.0);
    for side in [-1.0, 1.0] {
        let hinge = middle.shifted(0.0, side * (LEAF_M + 0.02));
        bodies.push(hinge.body(door_leaf(LEAF_M, [sin, -side * cos]), label));
    }
}

/// Returns the boxes of a person who has walked a distance in metres.
fn person(random: &mut Random, place: Place, walked_m: f64) -> Vec<Solid> {
    const STEP_M: f64 = 0.6;
    let (clothes, height) = (random.between(0.2, 0.9), random.between(0.9, 1.08));
    // The feet swing like a triangle wave: 1.2 m for both steps.
    let phase = (0.5 * walked_m / STEP_M).rem_euclid(1.0);
    let stride_m = 0.5 * STEP_M * (2.0 * (2.0 * phase - 1.0).abs() - 1.0);
    place.body(walker(clothes, height, stride_m), Label::Moving)
}

fn random_of(seed: u64, kind: i64, door: &Door) -> Random {
    let [x, y] = door.at_m.map(|x| (x * 100.0) as i64);
    Random::of(seed, &[kind, x, y])
}
