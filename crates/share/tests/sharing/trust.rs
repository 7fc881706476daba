use std::time::Duration;
use voxtile::space::{Grid, VoxelBox};
use voxtile_share::codec::{Header, Packet, Request, Status, Update};
use voxtile_share::{Receiver, ReceiverConfig, Sender, SenderConfig, SetRange};

fn grid() -> Grid {
    Grid::new(0.1, 10.0).unwrap()
}

/// A sender and a receiver with a perfect link.
struct Pair {
    sender: Sender,
    receiver: Receiver,
    now: Duration,
}

impl Pair {
    fn new(config: ReceiverConfig) -> Self {
        let sender = Sender::new(grid(), 77, SenderConfig::default()).unwrap();
        Self { sender, receiver: Receiver::new(config), now: Duration::ZERO }
    }

    fn run(&mut self, seconds: u64) {
        for _ in 0..seconds * 10 {
            self.now += Duration::from_millis(100);
            for packet in self.sender.poll(self.now) {
                let _ = self.receiver.take(&packet.bytes, self.now);
            }
            for request in self.receiver.poll(self.now) {
                for packet in self.sender.answer(1, &request, self.now).unwrap() {
                    let _ = self.receiver.take(&packet.bytes, self.now);
                }
            }
        }
    }

    fn inject(&mut self, packet: &Packet) {
        self.receiver.take(&packet.encode().unwrap(), self.now).unwrap();
    }
}

fn changes(epoch: u32, sequence: u64) -> Packet {
    let updates = vec![Update { voxel: [5, 5, 5], is_in: true }];
    Packet::Changes { header: Header { epoch, sequence }, repaired: Vec::new(), updates }
}

#[test]
fn forged_packet_numbers_do_not_block_a_robot() {
    for (epoch, sequence) in [(77, u64::MAX), (77, 1 << 40), (77, 3000), (78, 1), (0, u64::MAX)] {
        let mut pair = Pair::new(ReceiverConfig::default());
        pair.sender.put([1, 2, 3], true);
        pair.run(5);
        assert!(pair.receiver.is_converged());
        for _ in 0..3 {
            pair.inject(&changes(epoch, sequence));
            let status = Status {
                header: Header { epoch, sequence },
                nonce: 0,
                oldest: 1,
                resolution_m: 0.1,
                tile_size_m: 10.0,
                voxels: 0,
                digest: [0; 32],
            };
            pair.inject(&Packet::Status(status));
        }
        pair.sender.put([4, 5, 6], true);
        pair.run(40);
        let layer = pair.receiver.layer().unwrap();
        assert!(
            pair.receiver.is_converged(),
            "epoch {epoch}, packet {sequence}: {:?}",
            pair.receiver.counts()
        );
        assert!(layer.len() == 2 && layer.contains([1, 2, 3]) && layer.contains([4, 5, 6]));
    }
}

#[test]
fn voxels_beyond_the_limits_are_refused_and_counted() {
    let mut few_tiles = ReceiverConfig::default();
    few_tiles.max_tiles = 2;
    let mut few_voxels = ReceiverConfig::default();
    few_voxels.max_voxels = 2;
    let mut small_region = ReceiverConfig::default();
    small_region.region = Some(VoxelBox { min: [0; 3], end: [150, 100, 100] });
    for config in [few_tiles, few_voxels, small_region] {
        let mut pair = Pair::new(config);
        for x in 0..5 {
            pair.sender.put([100 * x, 0, 0], true);
        }
        pair.run(30);
        let layer = pair.receiver.layer().unwrap();
        assert_eq!((layer.len(), pair.receiver.is_over_limit()), (2, true));
        let counts = pair.receiver.counts();
        assert!(counts.refused_voxels >= 3);
        // The refused voxels are not requested again and again.
        assert!(counts.asks < 5, "{counts:?}");
    }
}

#[test]
fn another_grid_is_refused() {
    let mut config = ReceiverConfig::default();
    config.grid = Some(Grid::new(0.2, 10.0).unwrap());
    let mut pair = Pair::new(config);
    pair.sender.put([1, 2, 3], true);
    pair.run(10);
    assert!(pair.receiver.layer().is_none());
    assert!(pair.receiver.counts().refused_grids > 0);
}

#[test]
fn requests_beyond_the_rate_limit_are_not_answered() {
    let mut pair = Pair::new(ReceiverConfig::default());
    (0..20_000).for_each(|n| pair.sender.put([n * 7 % 1000, n * 13 % 500, n / 100], true));
    pair.run(10);
    let request = Request::Content { epoch: 77, ranges: vec![SetRange::ALL; 60] };
    let now = pair.now;
    let answered: usize = (0..1000)
        .flat_map(|_| pair.sender.answer(2, &request.encode(), now).unwrap())
        .map(|packet| packet.bytes.len())
        .sum();
    // The limit is the bytes of one second, plus the answer that exceeded them.
    assert!(answered <= (256 << 10) + 16 * 1200, "{answered} bytes at once");
    assert!(pair.sender.counts().refused_asks > 900);
}

/// At any rate of requests, the answers use the allowed rate, no less and no more.
#[test]
fn a_flood_of_requests_is_answered_at_the_allowed_rate() {
    const PER_SECOND: u64 = 256 << 10;
    const ANSWER: u64 = 16 * 1200;
    for interval_us in [100, 2000] {
        let mut sender = Sender::new(grid(), 77, SenderConfig::default()).unwrap();
        (0..20_000).for_each(|n| sender.put([n * 7 % 1000, n * 13 % 500, n / 100], true));
        sender.flush(Duration::ZERO);
        let request = Request::Content { epoch: 77, ranges: vec![SetRange::ALL; 60] }.encode();
        let mut bytes = 0;
        for n in 0..2_000_000 / interval_us {
            let now = Duration::from_secs(10) + Duration::from_micros(n * interval_us);
            bytes += sender
                .answer(2, &request, now)
                .unwrap()
                .iter()
                .map(|packet| packet.bytes.len() as u64)
                .sum::<u64>();
        }
        // The bucket was full at the start, so the bytes of three seconds were available in two seconds.
        let range = 3 * PER_SECOND - ANSWER..=3 * PER_SECOND + ANSWER;
        assert!(range.contains(&bytes), "{bytes} bytes, one request per {interval_us} us");
    }
}

/// Digests of all tiles are a short answer that needs much work.
#[test]
fn digests_of_very_many_tiles_are_answered_less_often() {
    let answered = |tiles: i32| {
        let mut sender = Sender::new(grid(), 77, SenderConfig::default()).unwrap();
        (0..tiles).for_each(|n| sender.put([n % 200 * 100, n / 200 * 100, 0], true));
        sender.flush(Duration::ZERO);
        assert_eq!(sender.sent().tile_count(), tiles as usize);
        let request = Request::Digests { epoch: 77, range: SetRange::ALL }.encode();
        let now = Duration::from_secs(10);
        (0..1000).filter(|_| !sender.answer(2, &request, now).unwrap().is_empty()).count()
    };
    let (few, many) = (answered(2000), answered(40_000));
    assert!(few > 100, "{few}");
    // Each request counts as 10 kB, in addition to the bytes of its answer.
    assert!((15..=27).contains(&many), "{many}");
}
