use super::city::pose;
use super::random::between;
use super::scene::{Scene, Solid, World};
use crate::space::{Aabb, Point};
use nalgebra::Isometry3;

/// One floor of 40 x 20 x 3 m: a corridor along the middle, rooms on both sides, doors, furniture.
#[derive(Clone, Copy, Debug)]
pub struct Building {
    seed: u64,
}

const LENGTH_M: f64 = 40.0;
const WIDTH_M: f64 = 20.0;
const HEIGHT_M: f64 = 3.0;
const WALL_M: f64 = 0.2;
const ROOM_M: f64 = 4.0;
/// Walls of the corridor, along y.
const CORRIDOR_M: [f64; 2] = [9.0, 11.0];
const DOOR_M: f64 = 1.0;
const SENSOR_HEIGHT_M: f64 = 1.2;
const ROOMS: i64 = 10;

impl Building {
    /// The building of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }
}

impl World for Building {
    fn scene(&self, _center: Point, _radius_m: f64) -> Scene {
        let mut scene = Scene::default();
        let mut add = |min: Point, max: Point, reflectivity| {
            scene.add(Solid { bounds: Aabb { min, max }, reflectivity });
        };
        let wall = 0.7;
        add([-WALL_M, -WALL_M, HEIGHT_M], [LENGTH_M + WALL_M, WIDTH_M + WALL_M, HEIGHT_M + WALL_M], 0.8);
        for x in [-WALL_M, LENGTH_M] {
            add([x, -WALL_M, 0.0], [x + WALL_M, WIDTH_M + WALL_M, HEIGHT_M], wall);
        }
        for y in [-WALL_M, WIDTH_M] {
            add([0.0, y, 0.0], [LENGTH_M, y + WALL_M, HEIGHT_M], wall);
        }
        for room in 0..ROOMS {
            let x = room as f64 * ROOM_M;
            for (side, corridor_wall_m) in CORRIDOR_M.into_iter().enumerate() {
                let (low, high) = if side == 0 { (0.0, corridor_wall_m) } else { (corridor_wall_m, WIDTH_M) };
                add([x, low, 0.0], [x + WALL_M, high, HEIGHT_M], wall);
                // The wall to the corridor, with a door in the middle of the room.
                let door = x + (ROOM_M - DOOR_M) / 2.0;
                let y = corridor_wall_m - WALL_M / 2.0;
                add([x, y, 0.0], [door, y + WALL_M, HEIGHT_M], wall);
                add([door + DOOR_M, y, 0.0], [x + ROOM_M, y + WALL_M, HEIGHT_M], wall);
                add([door, y, 2.1], [door + DOOR_M, y + WALL_M, HEIGHT_M], wall);
                // A cupboard at the wall and a table at the window, out of the way.
                let random = |low, high, what| between(low, high, self.seed, room, side as i64, what);
                let depth_m = random(0.3, 0.6, 0);
                add(
                    [x + WALL_M, low + 1.0, 0.0],
                    [x + WALL_M + depth_m, low + 3.0, random(1.0, 2.2, 1)],
                    0.5,
                );
                let table = if side == 0 { low + 0.3 } else { high - 1.3 };
                add([x + 1.4, table, 0.7], [x + 3.4, table + 1.0, 0.75], 0.6);
            }
        }
        scene
    }

    fn pose_at(&self, distance_m: f64) -> Isometry3<f64> {
        // Along the corridor, into every room and out again, to and fro: 5 m into a room.
        const INTO_M: f64 = 5.0;
        let stop_m = ROOM_M + 2.0 * INTO_M;
        let lap_m = stop_m * ROOMS as f64;
        let distance_m = distance_m.max(0.0);
        let lap = (distance_m / lap_m).floor();
        let rest_m = distance_m - lap * lap_m;
        let room = (rest_m / stop_m).floor().min(ROOMS as f64 - 1.0);
        let in_stop_m = rest_m - room * stop_m;
        let forth = lap % 2.0 == 0.0;
        let x_of = |x: f64| if forth { x } else { LENGTH_M - x };
        let middle = WIDTH_M / 2.0;
        let side = if room % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let door_x = room * ROOM_M + ROOM_M / 2.0;
        // Half a room to the door, in, out, half a room on.
        let (x, y, heading) = match in_stop_m {
            s if s < ROOM_M / 2.0 => (room * ROOM_M + s, middle, [1.0, 0.0]),
            s if s < ROOM_M / 2.0 + INTO_M => (door_x, middle + side * (s - ROOM_M / 2.0), [0.0, side]),
            s if s < ROOM_M / 2.0 + 2.0 * INTO_M => {
                (door_x, middle + side * (ROOM_M / 2.0 + 2.0 * INTO_M - s), [0.0, -side])
            }
            s => (door_x + s - ROOM_M / 2.0 - 2.0 * INTO_M, middle, [1.0, 0.0]),
        };
        // Half a metre from the end walls.
        pose([x_of(x).clamp(0.5, LENGTH_M - 0.5), y, SENSOR_HEIGHT_M], heading)
    }
}
