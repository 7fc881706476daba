//! Link that loses, repeats, delays and reorders packets, or is cut for a time.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};
use testkit::lossy_link::LossyLink;
use zenoh::pubsub::Subscriber;
use zenoh::{Config, Session, Wait};

/// Key and bytes as one packet.
type Packet = Vec<u8>;

/// Faults of the link. Zero disables a fault.
#[derive(Clone, Copy)]
pub struct BadLink {
    pub seed: u64,
    /// Fraction of lost packets.
    pub loss: f64,
    /// Fraction of repeated packets.
    pub repetition: f64,
    pub max_delay: Duration,
    pub cut_from: Duration,
    pub cut_for: Duration,
}

impl BadLink {
    /// Carries packets between the endpoints of the robots and subscribers that connect to `listen`, in a thread that
    /// ends with the process.
    pub fn start(self, listen: &str, robots: &[&str]) {
        let to_subscribers = open("listen", &[listen]);
        let to_robots = open("connect", robots);
        thread::spawn(move || self.carry(&to_subscribers, &to_robots));
    }

    fn carry(self, to_subscribers: &Session, to_robots: &Session) {
        let link = |salt: u64| LossyLink::new(self.seed + salt, self.loss, self.repetition, self.max_delay);
        let (mut down, mut up) = (link(1), link(2));
        let cut = self.cut_from..self.cut_from + self.cut_for;
        let ((to_down, from_robots), (to_up, from_subscribers)) = (sync_channel(4096), sync_channel(4096));
        let _subscribers = [
            subscribe(to_robots, "voxtile/*/packets", to_down.clone()),
            subscribe(to_robots, "voxtile/*/answers/*", to_down),
            subscribe(to_subscribers, "voxtile/*/asks/*", to_up),
        ];
        let begin = Instant::now();
        loop {
            let now = begin.elapsed();
            (down.is_cut, up.is_cut) = (cut.contains(&now), cut.contains(&now));
            from_robots.try_iter().for_each(|packet: Packet| down.send(&packet, now));
            from_subscribers.try_iter().for_each(|packet: Packet| up.send(&packet, now));
            for (link, session) in [(&mut down, to_subscribers), (&mut up, to_robots)] {
                for (key, bytes) in link.arrived(now).iter().filter_map(|packet| unpack(packet)) {
                    session.put(key, bytes).wait().unwrap();
                }
            }
            thread::sleep(Duration::from_millis(5));
        }
    }
}

fn open(how: &str, endpoints: &[&str]) -> Session {
    let mut config = Config::default();
    let other = if how == "listen" { "connect" } else { "listen" };
    for (key, value) in [
        ("mode".to_string(), "\"peer\"".to_string()),
        ("scouting/multicast/enabled".to_string(), "false".to_string()),
        (format!("{how}/endpoints"), serde_json::to_string(endpoints).unwrap()),
        (format!("{other}/endpoints"), "[]".to_string()),
        ("connect/timeout_ms".to_string(), "-1".to_string()),
        ("connect/exit_on_failure".to_string(), "false".to_string()),
    ] {
        config.insert_json5(&key, &value).unwrap_or_else(|error| panic!("{key}: {error}"));
    }
    zenoh::open(config).wait().unwrap()
}

fn subscribe(session: &Session, keys: &str, to: SyncSender<Packet>) -> Subscriber<()> {
    let take = move |sample: zenoh::sample::Sample| {
        let key = sample.key_expr().as_str();
        // Drop packets if the queue is full.
        let _ = to.try_send([&[key.len() as u8], key.as_bytes(), &sample.payload().to_bytes()].concat());
    };
    session.declare_subscriber(keys).callback(take).wait().unwrap()
}

fn unpack(packet: &[u8]) -> Option<(&str, &[u8])> {
    let (&length, rest) = packet.split_first()?;
    let (key, bytes) = rest.split_at_checked(usize::from(length))?;
    Some((std::str::from_utf8(key).ok()?, bytes))
}
