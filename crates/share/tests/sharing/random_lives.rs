use std::collections::BTreeSet;
use std::time::Duration;
use testkit::lossy_link::LossyLink;
use voxtile::space::{Grid, VoxelIndex};
use voxtile_share::{ExportPolicy, Receiver, ReceiverConfig, Sender, SenderConfig};
use voxtile_simulation::Random;

/// A sender, receivers and the links between them, simulated in steps of 50 ms.
struct World {
    random: Random,
    sender: Sender,
    epoch: u32,
    /// Expected set of the sender.
    model: BTreeSet<VoxelIndex>,
    receivers: Vec<End>,
    now: Duration,
}

struct End {
    receiver: Receiver,
    down: LossyLink,
    up: LossyLink,
}

const STEP: Duration = Duration::from_millis(50);

fn grid() -> Grid {
    Grid::new(0.1, 1.6).unwrap()
}

fn sender_config(policy: ExportPolicy) -> SenderConfig {
    let mut config = SenderConfig::default();
    config.policy = policy;
    config.latency = Duration::from_millis(200);
    config.status_interval = Duration::from_secs(1);
    config.ring_packets = 20;
    config.max_packet_bytes = 300;
    config
}

impl World {
    fn new(seed: u64, receivers: usize, policy: ExportPolicy) -> Self {
        let mut random = Random::of(seed, &[1]);
        let link = |random: &mut Random| {
            LossyLink::new(random.bits(), 0.2, 0.1, Duration::from_millis(random.below(400)))
        };
        let end = |number| End {
            receiver: Receiver::new(receiver_config(seed + number)),
            down: link(&mut random),
            up: link(&mut random),
        };
        let receivers = (0..receivers as u64).map(end).collect();
        let sender = Sender::new(grid(), 1, sender_config(policy)).unwrap();
        Self { random, sender, epoch: 1, model: BTreeSet::new(), receivers, now: Duration::ZERO }
    }

    /// Adds or removes random voxels of a bent plane.
    fn change(&mut self, count: u64) {
        for _ in 0..count {
            let x = self.random.below(300) as i32 - 150;
            let y = self.random.below(120) as i32 - 60;
            let voxel = [x, y, (x / 20 - y / 9) % 7];
            if self.random.chance(0.7) {
                self.model.insert(voxel);
                self.sender.put(voxel, true);
            } else {
                self.model.remove(&voxel);
                self.sender.put(voxel, false);
            }
            assert_eq!(self.sender.contains(voxel), self.model.contains(&voxel));
        }
    }

    fn step(&mut self) {
        self.now += STEP;
        for outgoing in self.sender.poll(self.now) {
            assert!(outgoing.bytes.len() <= 300);
            self.receivers.iter_mut().for_each(|end| end.down.send(&outgoing.bytes, self.now));
        }
        for (number, end) in self.receivers.iter_mut().enumerate() {
            for request in end.up.arrived(self.now) {
                for outgoing in self.sender.answer(number as u64, &request, self.now).unwrap() {
                    assert_eq!(outgoing.to, Some(number as u64));
                    assert!(outgoing.bytes.len() <= 300);
                    end.down.send(&outgoing.bytes, self.now);
                }
            }
            for packet in end.down.arrived(self.now) {
                end.receiver.take(&packet, self.now).unwrap();
            }
            for request in end.receiver.poll(self.now) {
                assert!(request.len() <= 1200);
                end.up.send(&request, self.now);
            }
        }
    }

    fn is_converged(&self) -> bool {
        let last = self.sender.last_packet();
        let is_equal = |end: &End| end.receiver.is_converged() && end.receiver.equal_as_of() == Some(last);
        self.sender.is_idle() && self.receivers.iter().all(is_equal)
    }

    /// Runs until the sets are equal. Returns the elapsed time.
    fn settle(&mut self) -> Duration {
        let begin = self.now;
        while !self.is_converged() {
            assert!(self.now < begin + Duration::from_secs(120), "not converged: {:?}", self.states());
            self.step();
        }
        self.check();
        self.now - begin
    }

    fn states(&self) -> Vec<String> {
        self.receivers.iter().map(|end| format!("{:?}", end.receiver.counts())).collect()
    }

    /// Compares all sets with the expected set, by voxels and by digest.
    fn check(&mut self) {
        let sent: BTreeSet<VoxelIndex> = self.sender.sent().iter().collect();
        // `assert!` instead of `assert_eq!`, which would print thousands of voxels.
        assert!(sent == self.model);
        let digest = self.sender.sent().digest();
        for end in &mut self.receivers {
            let layer = end.receiver.layer_mut().unwrap();
            assert!(layer.iter().collect::<BTreeSet<_>>() == self.model);
            assert_eq!(layer.digest(), digest);
        }
    }

    fn restart_sender(&mut self) {
        self.epoch += 1;
        let policy = ExportPolicy::LastFrame;
        self.sender = Sender::new(grid(), self.epoch, sender_config(policy)).unwrap();
        self.model.clear();
    }
}

fn receiver_config(seed: u64) -> ReceiverConfig {
    let mut config = ReceiverConfig::default();
    config.nonce_seed = seed;
    config
}

#[test]
fn sets_are_equal_after_loss_duplication_delay_and_reordering() {
    for seed in 0..12 {
        let policy =
            [ExportPolicy::LastFrame, ExportPolicy::Ring(3), ExportPolicy::Everything][seed as usize % 3];
        let mut world = World::new(seed, 1 + seed as usize % 3, policy);
        for _ in 0..150 {
            let count = world.random.below(40);
            world.change(count);
            world.step();
        }
        world.settle();
    }
}

#[test]
fn sets_are_equal_after_an_outage_longer_than_the_ring() {
    for seed in 20..26 {
        let mut world = World::new(seed, 2, ExportPolicy::LastFrame);
        for step in 0..300 {
            let is_cut = (40..200).contains(&step);
            (world.receivers[0].down.is_cut, world.receivers[0].up.is_cut) =
                (is_cut, is_cut && seed % 2 == 0);
            world.change(15);
            world.step();
        }
        world.settle();
        assert!(world.receivers[0].receiver.counts().catch_ups > 0, "{:?}", world.states());
    }
}

#[test]
fn a_restarted_sender_is_recognised() {
    for seed in 30..36 {
        let mut world = World::new(seed, 2, ExportPolicy::LastFrame);
        for step in 0..300 {
            if step == 100 || step == 180 {
                world.restart_sender();
            }
            world.change(15);
            world.step();
        }
        world.settle();
    }
}

#[test]
fn a_restarted_receiver_with_a_layer_requests_only_differences() {
    let mut world = World::new(40, 1, ExportPolicy::LastFrame);
    for _ in 0..200 {
        world.change(40);
        world.step();
    }
    world.settle();
    // A distant voxel changes while no receiver is running.
    let layer = world.receivers[0].receiver.layer().unwrap().clone();
    world.model.insert([1000, 0, 0]);
    world.sender.put([1000, 0, 0], true);
    let outgoing = world.sender.flush(world.now);
    assert!(!outgoing.is_empty());
    let answers_before = world.sender.counts().answer_bytes;
    let link = |seed| LossyLink::new(seed, 0.0, 0.0, STEP);
    let receiver = Receiver::with_layer(receiver_config(99), layer);
    world.receivers[0] = End { receiver, down: link(1), up: link(2) };
    world.settle();
    let answers = world.sender.counts().answer_bytes - answers_before;
    let tiles = world.sender.sent().tile_count() as u64;
    assert!(answers < 300 + 40 * tiles, "{answers} bytes for one voxel and {tiles} digests");
    // A receiver without a layer needs more bytes.
    world.receivers[0] = End { receiver: Receiver::new(receiver_config(98)), down: link(3), up: link(4) };
    world.settle();
    assert!(world.sender.counts().answer_bytes - answers_before - answers > answers);
}

#[test]
fn thousands_of_tiles_are_compared_in_groups() {
    let mut world = World::new(50, 1, ExportPolicy::LastFrame);
    for number in 0..3000 {
        let voxel = [number % 60 * 16, number / 60 * 16, 0];
        world.model.insert(voxel);
        world.sender.put(voxel, true);
    }
    world.settle();
    let layer = world.receivers[0].receiver.layer().unwrap().clone();
    assert!(layer.tile_count() == 3000);
    world.receivers[0].receiver = Receiver::with_layer(receiver_config(97), layer);
    world.model.remove(&[16, 16, 0]);
    world.sender.put([16, 16, 0], false);
    world.sender.flush(world.now);
    let answers_before = world.sender.counts().answer_bytes;
    world.settle();
    let answers = world.sender.counts().answer_bytes - answers_before;
    assert!(answers < 8000, "{answers} bytes");
}

#[test]
fn a_receiver_without_requests_gets_the_later_voxels() {
    let mut config = receiver_config(1);
    config.sends_requests = false;
    let mut sender = Sender::new(grid(), 5, sender_config(ExportPolicy::LastFrame)).unwrap();
    let mut receiver = Receiver::new(config);
    let mut now = Duration::ZERO;
    for step in 0..400 {
        now += STEP;
        sender.put([step, 0, 0], true);
        for outgoing in sender.poll(now) {
            receiver.take(&outgoing.bytes, now).unwrap();
        }
    }
    // The voxels of the first seconds are missing, because the sender was not accepted yet.
    let layer = receiver.layer().unwrap();
    assert!(layer.len() > 200 && layer.contains([390, 0, 0]), "{}", layer.len());
}
