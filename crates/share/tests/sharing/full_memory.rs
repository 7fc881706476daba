//! Memory that really is full: what is counted, and what the process takes.

use super::memory::{EPOCH, config, grid};
use std::time::Duration;
use voxtile_share::codec::{Header, Packet, Request, Status, Update};
use voxtile_share::{Receivers, Sender, SenderConfig};
use voxtile_simulation::Random;

/// Large enough for what is set aside for a packet to be less than a tenth.
const MEMORY: usize = 256 << 20;
const HOSTILE: u8 = 6;
const HONEST: u8 = 0;
/// Voxels along an edge of a packet, each alone in its tile: nothing takes more memory a byte.
const EDGE: i32 = 12;
/// Set in the process that does the work.
const IS_ALONE: &str = "VOXTILE_IS_ALONE";

/// Robots that answer as one has to, and fill the memory.
struct Hostile {
    random: Random,
    sequence: u64,
    /// Where their latest voxels begin.
    corners: Vec<[i32; 3]>,
}

impl Hostile {
    fn status(&self, nonce: u64) -> Vec<u8> {
        let (header, digest) = (Header { epoch: EPOCH, sequence: self.sequence }, [1; 32]);
        let (resolution_m, tile_size_m) = (grid().resolution_m(), grid().tile_size_m());
        let status = Status { header, nonce, oldest: 1, resolution_m, tile_size_m, voxels: 1 << 40, digest };
        Packet::Status(status).encode().unwrap()
    }

    /// Voxels that come, mostly, or some that came before and go, which leaves holes in memory.
    fn changes(&mut self) -> Vec<u8> {
        self.sequence += 1;
        let goes = self.corners.len() > 4 && self.random.chance(0.2);
        let corner = if goes {
            self.corners.swap_remove(self.random.below(self.corners.len() as u64) as usize)
        } else {
            let corner = std::array::from_fn(|_| self.random.below(1 << 30) as i32 - (1 << 29));
            self.corners.push(corner);
            corner
        };
        let voxel = |k: i32| [k % EDGE, k / EDGE % EDGE, k / EDGE / EDGE].map(|k| 101 * k);
        let voxels =
            (0..EDGE * EDGE * EDGE).map(|k| std::array::from_fn(|axis| corner[axis] + voxel(k)[axis]));
        let updates = voxels.map(|voxel| Update { voxel, is_in: !goes }).collect();
        let header = Header { epoch: EPOCH, sequence: self.sequence };
        Packet::Changes { header, repaired: Vec::new(), updates }.encode().unwrap()
    }
}

/// Bytes of memory of this process, by a key of the system's.
#[cfg(target_os = "linux")]
fn own_bytes(key: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with(key)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() << 10
}

/// Fills the memory, and returns the most bytes that were counted.
fn fill() -> usize {
    let mut receivers = Receivers::new(MEMORY).unwrap();
    let mut honest = Sender::new(grid(), 1, SenderConfig::default()).unwrap();
    let random = |robot| Random::of(1, &[robot]);
    let mut hostile: Vec<(u8, Hostile)> = (1..=HOSTILE)
        .map(|robot| (robot, Hostile { random: random(robot.into()), sequence: 0, corners: Vec::new() }))
        .collect();
    hostile.iter().for_each(|(robot, _)| receivers.insert(*robot, config(u64::from(*robot)), None));
    let mut fullest = 0;
    for step in 0..80 {
        let now = Duration::from_millis(100 * step);
        // It comes when everything is taken.
        if step == 35 {
            receivers.insert(HONEST, config(77), None);
        }
        if (35..55).contains(&step) {
            let y = step as i32;
            (0..400).for_each(|k| honest.put([k % 40, y, k / 40], true));
        }
        if let Some(receiver) = receivers.get_mut(&HONEST) {
            let asks = receiver.poll(now);
            let answers = asks.iter().flat_map(|ask| honest.answer(1, ask, now).unwrap());
            let packets: Vec<_> = answers.collect();
            for packet in packets.into_iter().chain(honest.poll(now)) {
                receivers.take(&HONEST, &packet.bytes, now).unwrap();
            }
        }
        for (robot, hostile) in &mut hostile {
            let mut packets = Vec::new();
            for ask in receivers.get_mut(robot).unwrap().poll(now) {
                if let Request::Status { nonce } = Request::decode(&ask).unwrap() {
                    packets.push(hostile.status(nonce));
                }
            }
            packets.push(hostile.changes());
            for bytes in packets {
                receivers.take(robot, &bytes, now).unwrap();
                let counted = receivers.memory_bytes();
                assert!(counted <= MEMORY, "{counted} bytes counted");
                fullest = fullest.max(counted);
            }
        }
    }
    let receiver = receivers.get(&HONEST).unwrap();
    assert!(receiver.is_converged() && !receiver.is_over_limit(), "{:?}", receiver.counts());
    assert!(receiver.layer().unwrap() == &*honest.sent());
    let cut: u64 = receivers.iter().map(|(_, receiver)| receiver.counts().cut_voxels).sum();
    assert!(cut > 0, "nobody made room");
    fullest
}

/// Nine tenths of the limit are counted and never more than all of it, while an honest robot's layer becomes equal; and
/// the process takes what is counted, as nodes are fuller than they may be: no more, and more than half of it.
///
/// In a process of its own, where nobody else takes memory.
#[test]
fn hostile_robots_fill_the_memory_and_it_holds() {
    if std::env::var_os(IS_ALONE).is_none() {
        let (_, module) = module_path!().split_once("::").unwrap();
        let name = format!("{module}::hostile_robots_fill_the_memory_and_it_holds");
        let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
        let output = alone.args(["--exact", &name, "--nocapture"]).env(IS_ALONE, "1").output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("1 passed"), "{said}");
        return print!("{said}");
    }
    #[cfg(target_os = "linux")]
    let before = own_bytes("VmRSS:");
    let counted = fill();
    assert!(counted >= MEMORY / 10 * 9, "{counted} bytes counted at most");
    #[cfg(target_os = "linux")]
    {
        let taken = own_bytes("VmHWM:") - before;
        println!("{counted} bytes counted, {taken} taken");
        // Packets on their way, and what the allocator has free.
        assert!(taken < counted + (16 << 20), "{counted} bytes counted, {taken} taken");
        assert!(taken > counted / 2, "{counted} bytes counted, {taken} taken");
    }
}
