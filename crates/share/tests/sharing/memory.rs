use std::collections::BTreeSet;
use std::time::{Duration, Instant};
use voxtile::space::{Grid, TileIndex, VoxelIndex};
use voxtile_share::codec::{DigestEntry, Header, Packet, Request, Status, Update};
use voxtile_share::{
    Receiver, ReceiverConfig, Receivers, Sender, SenderConfig, SetPosition, SetRange, VoxelSet,
};
use voxtile_simulation::Random;

pub(super) const EPOCH: u32 = 9;

pub(super) fn grid() -> Grid {
    Grid::new(0.1, 10.0).unwrap()
}

pub(super) fn config(seed: u64) -> ReceiverConfig {
    let mut config = ReceiverConfig::default();
    config.nonce_seed = seed;
    config
}

/// Robot that answers status requests correctly and sends packets that need much memory and work.
struct Hostile {
    random: Random,
    sequence: u64,
}

impl Hostile {
    fn header(&self) -> Header {
        Header { epoch: EPOCH, sequence: self.sequence }
    }

    fn status(&mut self, nonce: u64) -> Packet {
        Packet::Status(Status {
            header: self.header(),
            nonce,
            oldest: self.random.below(self.sequence + 1),
            resolution_m: 0.1,
            tile_size_m: 10.0,
            voxels: self.random.below(1 << 30),
            digest: [self.random.below(256) as u8; 32],
        })
    }

    /// Returns voxels that are alone in their tiles, alone in their bricks, in a solid cube, or at the ends of the
    /// index range.
    fn voxels(&mut self) -> Vec<VoxelIndex> {
        let count = self.random.below(4000) as i32;
        let far = |random: &mut Random, spread: i32| random.below(spread as u64) as i32 - spread / 2;
        let origin: VoxelIndex = std::array::from_fn(|_| far(&mut self.random, 3_000_000));
        let step = [1, 8, 101][self.random.below(3) as usize];
        let edge = 17;
        let voxel = |k: i32| [k % edge, k / edge % edge, k / edge / edge].map(|k| k * step);
        match self.random.below(10) {
            0 => vec![[i32::MAX - 1, i32::MIN, i32::MAX - 1], [i32::MAX - 2, i32::MIN, i32::MAX - 1]],
            _ => (0..count).map(|k| std::array::from_fn(|axis| origin[axis] + voxel(k)[axis])).collect(),
        }
    }

    fn range(&mut self) -> SetRange {
        let mut position = || SetPosition {
            tile: TileIndex::new(self.random.below(100) as i32 - 50, 0, self.random.below(3) as i32),
            code: self.random.below(1 << 48),
        };
        let (a, b) = (position(), position());
        if self.random.chance(0.1) { SetRange::ALL } else { SetRange { first: a.min(b), last: b.max(a) } }
    }

    fn packet(&mut self) -> Packet {
        let voxels = self.voxels();
        self.sequence += self.random.below(3);
        // Packets that empty a layer are rare, so that layers fill up.
        match self.random.below(60) {
            0..44 => {
                self.sequence += 1;
                let is_in = self.random.chance(0.9);
                let updates = voxels.into_iter().map(|voxel| Update { voxel, is_in }).collect();
                Packet::Changes { header: self.header(), repaired: vec![], updates }
            }
            44 => Packet::Content { header: self.header(), range: SetRange::ALL, voxels },
            45..50 => Packet::Content { header: self.header(), range: self.range(), voxels: vec![] },
            50..55 => {
                let entry = |z| DigestEntry { last: TileIndex::new(50, 0, z), voxels: 1, digest: [1; 8] };
                let first = TileIndex::new(i32::MIN, 0, 0);
                Packet::Digests { header: self.header(), first, entries: (0..1000).map(entry).collect() }
            }
            _ => self.status(0),
        }
    }
}

/// All receivers together never exceed the memory limit, and a robot below its share has an equal layer.
#[test]
fn hostile_robots_stay_within_the_limit_and_take_nothing_from_others() {
    const MEMORY: usize = Receivers::<u8>::MIN_BYTES;
    for seed in 0..2 {
        let mut receivers = Receivers::new(MEMORY).unwrap();
        // Memory limit of all receivers, without the reserve for one packet.
        let all = receivers.free_bytes();
        (0..3).for_each(|robot| receivers.insert(robot, config(seed + u64::from(robot)), None));
        let mut honest = Sender::new(grid(), 1, SenderConfig::default()).unwrap();
        let mut hostile = [1, 2]
            .map(|robot: u8| (robot, Hostile { random: Random::of(seed, &[robot.into()]), sequence: 1 }));
        let (mut now, mut fullest) = (Duration::ZERO, 0);
        let mut random = Random::of(seed, &[]);
        for step in 0..130 {
            now += Duration::from_millis(100);
            if step < 80 {
                (0..200).for_each(|_| {
                    honest.put(std::array::from_fn(|_| random.below(400) as i32), true);
                });
            }
            for packet in honest.poll(now) {
                receivers.take(&0, &packet.bytes, now).unwrap();
            }
            for request in receivers.get_mut(&0).unwrap().poll(now) {
                for packet in honest.answer(1, &request, now).unwrap() {
                    receivers.take(&0, &packet.bytes, now).unwrap();
                }
            }
            for (robot, hostile) in &mut hostile {
                let mut packets: Vec<Packet> = (0..5).map(|_| hostile.packet()).collect();
                for request in receivers.get_mut(robot).unwrap().poll(now) {
                    if let Request::Status { nonce } = Request::decode(&request).unwrap() {
                        packets.push(hostile.status(nonce));
                    }
                }
                for bytes in packets.iter().filter_map(|packet| packet.encode().ok()) {
                    receivers.take(robot, &bytes, now).unwrap();
                    assert!(receivers.memory_bytes() <= MEMORY, "{} bytes", receivers.memory_bytes());
                    fullest = fullest.max(receivers.memory_bytes());
                }
            }
        }
        assert!(fullest >= all / 10 * 9, "{fullest} of {all} bytes at most");
        let receiver = receivers.get(&0).unwrap();
        assert!(receiver.memory_bytes() <= receivers.part_bytes() && !receiver.is_over_limit());
        assert!(receiver.is_converged(), "{:?}", receiver.counts());
        assert!(receiver.layer().unwrap() == &*honest.sent());
    }
}

/// The first robot takes all memory. It loses memory beyond its share when the second robot needs it.
#[test]
fn the_largest_layer_shrinks_for_a_new_robot() {
    let mut receivers = Receivers::new(Receivers::<u8>::MIN_BYTES).unwrap();
    let mut senders =
        [0_u8, 1].map(|robot| (robot, Sender::new(grid(), 1, SenderConfig::default()).unwrap()));
    for (robot, sender) in &mut senders {
        receivers.insert(*robot, config(u64::from(*robot)), None);
        let count = if *robot == 0 { 200_000 } else { 30_000 };
        (0..count).for_each(|k| sender.put([k % 1000 * 8, k / 1000 * 8, 0], true));
        for step in 0..600 {
            let now = Duration::from_millis(100 * step);
            for packet in sender.poll(now) {
                receivers.take(robot, &packet.bytes, now).unwrap();
            }
            for request in receivers.get_mut(robot).unwrap().poll(now) {
                for packet in sender.answer(1, &request, now).unwrap() {
                    receivers.take(robot, &packet.bytes, now).unwrap();
                }
            }
        }
    }
    let (first, second) = (receivers.get(&0).unwrap(), receivers.get(&1).unwrap());
    assert!(second.is_converged() && second.layer().unwrap().len() == 30_000, "{:?}", second.counts());
    assert!(first.is_over_limit() && first.counts().cut_voxels > 0, "{:?}", first.counts());
    // No more voxels were removed than necessary.
    let all = receivers.memory_bytes();
    assert!(first.memory_bytes() >= receivers.part_bytes() && all > 2 * receivers.part_bytes() - (1 << 20));
}

/// Returns a receiver that a sender has confirmed as of packet 0.
fn confirmed(now: Duration) -> Receiver {
    let mut receiver = Receiver::new(config(5));
    let mut sender = Sender::new(grid(), EPOCH, SenderConfig::default()).unwrap();
    for request in receiver.poll(now) {
        for packet in sender.answer(1, &request, now).unwrap() {
            receiver.take(&packet.bytes, now).unwrap();
        }
    }
    receiver
}

fn packet(packet: &Packet) -> Vec<u8> {
    packet.encode().unwrap()
}

fn header(sequence: u64) -> Header {
    Header { epoch: EPOCH, sequence }
}

/// Thousands of separate ranges of content do not slow down later packets.
#[test]
fn the_cost_of_a_packet_does_not_grow_with_earlier_packets() {
    let now = Duration::from_secs(1);
    let changes = |sequence| {
        let voxels = (0..24).flat_map(|x| (0..24).flat_map(move |y| (0..24).map(move |z| [x, y, z])));
        let updates = voxels.map(|voxel| Update { voxel, is_in: true }).collect();
        packet(&Packet::Changes { header: header(sequence), repaired: vec![], updates })
    };
    let best_of_five = |receiver: &mut Receiver| {
        let cost = |sequence| {
            let bytes = changes(sequence);
            let since = Instant::now();
            receiver.take(&bytes, now).unwrap();
            since.elapsed()
        };
        (1..=5).map(cost).min().unwrap()
    };
    let alone = best_of_five(&mut confirmed(now));
    let mut receiver = confirmed(now);
    for k in 0..4096 {
        let place = SetPosition { tile: TileIndex::new(k, 0, 0), code: 0 };
        let range = SetRange { first: place, last: place };
        let content = Packet::Content { header: header(10), range, voxels: Vec::new() };
        receiver.take(&packet(&content), now).unwrap();
    }
    let after = best_of_five(&mut receiver);
    assert_eq!(receiver.layer().unwrap().len(), 24 * 24 * 24);
    assert!(after < 5 * alone, "{after:?} after 4096 parts, {alone:?} without");
}

/// The removal exceeds the limit of one packet, so it takes several packets.
#[test]
fn a_restarted_sender_empties_a_large_layer() {
    let mut layer = VoxelSet::new(grid());
    let edge = 130;
    for voxel in (0..edge * edge * edge).map(|k| [k % edge, k / edge % edge, k / edge / edge]) {
        layer.put(voxel, true);
    }
    assert!(layer.len() > 2 << 20);
    let mut receiver = Receiver::with_layer(config(3), layer);
    let mut sender = Sender::new(grid(), 2, SenderConfig::default()).unwrap();
    sender.put([1, 2, 3], true);
    let mut sizes = BTreeSet::new();
    for step in 0..100 {
        let now = Duration::from_millis(100 * step);
        for packet in sender.poll(now) {
            receiver.take(&packet.bytes, now).unwrap();
        }
        for request in receiver.poll(now) {
            for packet in sender.answer(1, &request, now).unwrap() {
                receiver.take(&packet.bytes, now).unwrap();
            }
        }
        sizes.insert(receiver.layer().unwrap().len());
    }
    assert!(receiver.is_converged(), "{:?}", receiver.counts());
    assert_eq!(receiver.layer().unwrap().iter().collect::<Vec<_>>(), [[1, 2, 3]]);
    assert!(sizes.len() > 2, "{sizes:?}");
}
