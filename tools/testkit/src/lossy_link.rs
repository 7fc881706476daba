use std::time::Duration;
use voxtile_simulation::Random;

/// A link that loses, repeats, delays and reorders packets, or is cut.
pub struct LossyLink {
    random: Random,
    pub loss: f64,
    pub repetition: f64,
    /// Maximum delay; the delay of a packet is random between 0 and this.
    pub max_delay: Duration,
    pub is_cut: bool,
    in_flight: Vec<(Duration, Vec<u8>)>,
    /// Bytes sent, including those of lost packets.
    pub bytes: u64,
    pub packets: u64,
    pub max_packet: usize,
}

impl LossyLink {
    pub fn new(seed: u64, loss: f64, repetition: f64, max_delay: Duration) -> Self {
        let random = Random::of(seed, &[]);
        let in_flight = Vec::new();
        Self {
            random,
            loss,
            repetition,
            max_delay,
            is_cut: false,
            in_flight,
            bytes: 0,
            packets: 0,
            max_packet: 0,
        }
    }

    pub fn send(&mut self, packet: &[u8], now: Duration) {
        self.bytes += packet.len() as u64;
        self.packets += 1;
        self.max_packet = self.max_packet.max(packet.len());
        let copies = if self.random.chance(self.repetition) { 2 } else { 1 };
        for _ in 0..copies {
            let delay = self.max_delay.mul_f64(self.random.between(0.0, 1.0));
            if !self.is_cut && !self.random.chance(self.loss) {
                self.in_flight.push((now + delay, packet.to_vec()));
            }
        }
    }

    /// Packets that have arrived by now, in the order of arrival.
    pub fn arrived(&mut self, now: Duration) -> Vec<Vec<u8>> {
        let all = std::mem::take(&mut self.in_flight);
        let (mut arrived, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|(at, _)| *at <= now);
        self.in_flight = rest;
        arrived.sort_by_key(|(at, _)| *at);
        arrived.into_iter().map(|(_, packet)| packet).collect()
    }
}
