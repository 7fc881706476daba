//! Compares the counted memory with the memory of the process while hostile robots fill it.

use super::memory::{EPOCH, config, grid};
use std::time::Duration;
use voxtile_share::codec::{Header, Packet, Request, Status, Update};
use voxtile_share::{Receivers, Sender, SenderConfig};
use voxtile_simulation::Random;

/// Memory limit in bytes, large enough that the reserve for one packet is less than a tenth of it.
const MEMORY: usize = 256 << 20;
const HOSTILE: u8 = 6;
const HONEST: u8 = 0;
/// Number of voxels along the edge of a packet's cube. Each voxel is alone in its tile, which takes the most memory per
/// byte of a packet.
const EDGE: i32 = 12;
/// Environment variable of the child process, in which the test runs.
const IS_ALONE: &str = "VOXTILE_IS_ALONE";

/// Robot that answers status requests correctly and fills the memory.
struct Hostile {
    random: Random,
    sequence: u64,
    /// Corners of its cubes.
    corners: Vec<[i32; 3]>,
}

impl Hostile {
    fn status(&self, nonce: u64) -> Vec<u8> {
        let (header, digest) = (Header { epoch: EPOCH, sequence: self.sequence }, [1; 32]);
        let (resolution_m, tile_size_m) = (grid().resolution_m(), grid().tile_size_m());
        let status = Status { header, nonce, oldest: 1, resolution_m, tile_size_m, voxels: 1 << 40, digest };
        Packet::Status(status).encode().unwrap()
    }

    /// Returns a packet that adds a cube of voxels, or sometimes removes an earlier cube, which leaves holes in memory.
    fn changes(&mut self) -> Vec<u8> {
        self.sequence += 1;
        let is_removal = self.corners.len() > 4 && self.random.chance(0.2);
        let corner = if is_removal {
            self.corners.swap_remove(self.random.below(self.corners.len() as u64) as usize)
        } else {
            let corner = std::array::from_fn(|_| self.random.below(1 << 30) as i32 - (1 << 29));
            self.corners.push(corner);
            corner
        };
        let voxel = |k: i32| [k % EDGE, k / EDGE % EDGE, k / EDGE / EDGE].map(|k| 101 * k);
        let voxels =
            (0..EDGE * EDGE * EDGE).map(|k| std::array::from_fn(|axis| corner[axis] + voxel(k)[axis]));
        let updates = voxels.map(|voxel| Update { voxel, is_in: !is_removal }).collect();
        let header = Header { epoch: EPOCH, sequence: self.sequence };
        Packet::Changes { header, repaired: Vec::new(), updates }.encode().unwrap()
    }
}

/// Returns a memory size of this process, in bytes. `key` is a key of `/proc/self/status`.
#[cfg(target_os = "linux")]
fn own_bytes(key: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with(key)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<usize>().unwrap() << 10
}

/// Fills the memory. Returns the maximum of the counted bytes.
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
        // The honest robot is added when the memory is full.
        if step == 35 {
            receivers.insert(HONEST, config(77), None);
        }
        if (35..55).contains(&step) {
            let y = step as i32;
            (0..400).for_each(|k| honest.put([k % 40, y, k / 40], true));
        }
        if let Some(receiver) = receivers.get_mut(&HONEST) {
            let requests = receiver.poll(now);
            let answers = requests.iter().flat_map(|request| honest.answer(1, request, now).unwrap());
            let packets: Vec<_> = answers.collect();
            for packet in packets.into_iter().chain(honest.poll(now)) {
                receivers.take(&HONEST, &packet.bytes, now).unwrap();
            }
        }
        for (robot, hostile) in &mut hostile {
            let mut packets = Vec::new();
            for request in receivers.get_mut(robot).unwrap().poll(now) {
                if let Request::Status { nonce } = Request::decode(&request).unwrap() {
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
    assert!(cut > 0, "no layer was cut");
    fullest
}

/// The counted memory reaches nine tenths of the limit and never exceeds the limit, while an honest robot's layer
/// becomes equal. The process takes more than half of the counted memory, and no more than all of it: nodes are fuller
/// than the count assumes.
///
/// The test runs in its own process, so that other tests take no memory there.
#[test]
fn hostile_robots_do_not_exceed_the_memory_limit() {
    if std::env::var_os(IS_ALONE).is_none() {
        let (_, module) = module_path!().split_once("::").unwrap();
        let name = format!("{module}::hostile_robots_do_not_exceed_the_memory_limit");
        let mut alone = std::process::Command::new(std::env::current_exe().unwrap());
        let output = alone.args(["--exact", &name, "--nocapture"]).env(IS_ALONE, "1").output().unwrap();
        let stdout = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
        assert!(stdout.contains("1 passed"), "{stdout}");
        return print!("{stdout}");
    }
    #[cfg(target_os = "linux")]
    let before = own_bytes("VmRSS:");
    let counted = fill();
    assert!(counted >= MEMORY / 10 * 9, "{counted} bytes counted at most");
    #[cfg(target_os = "linux")]
    {
        let taken = own_bytes("VmHWM:") - before;
        println!("{counted} bytes counted, {taken} taken");
        // Allow for packets in transit and free memory of the allocator.
        assert!(taken < counted + (16 << 20), "{counted} bytes counted, {taken} taken");
        assert!(taken > counted / 2, "{counted} bytes counted, {taken} taken");
    }
}
