//! A link that loses, repeats, delays and reorders what goes through it, or is cut for a time: what the tests of
//! `voxtile-share` put between publishers and subscribers.
//!
//! ```text
//! bad-link LISTEN CONNECT SEED LOSS REPETITION MAX_DELAY_S CUT_FROM_S CUT_FOR_S
//! ```
//!
//! Robots listen at CONNECT (several, with commas), subscribers connect to LISTEN.

use anyhow::{Context, anyhow};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};
use testkit::lossy_link::LossyLink;
use zenoh::pubsub::Subscriber;
use zenoh::{Config, Session, Wait};

/// Key and bytes as one packet.
type Packet = Vec<u8>;

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let text = |at: usize| args.get(at).with_context(|| format!("argument {} is missing", at + 1));
    let number = |at: usize| -> anyhow::Result<f64> { Ok(text(at)?.parse()?) };
    let link = |salt: u64| -> anyhow::Result<LossyLink> {
        let max_delay = Duration::from_secs_f64(number(5)?);
        Ok(LossyLink::new(number(2)? as u64 + salt, number(3)?, number(4)?, max_delay))
    };
    let cut = Duration::from_secs_f64(number(6)?)..Duration::from_secs_f64(number(6)? + number(7)?);
    let (mut down, mut up) = (link(1)?, link(2)?);
    let to_subscribers = open("listen", text(0)?)?;
    let to_robots = open("connect", text(1)?)?;
    let ((to_down, from_robots), (to_up, from_subscribers)) = (sync_channel(4096), sync_channel(4096));
    let _subscribers = [
        subscribe(&to_robots, "voxtile/*/packets", to_down.clone())?,
        subscribe(&to_robots, "voxtile/*/answers/*", to_down)?,
        subscribe(&to_subscribers, "voxtile/*/asks/*", to_up)?,
    ];
    let begin = Instant::now();
    loop {
        let now = begin.elapsed();
        (down.is_cut, up.is_cut) = (cut.contains(&now), cut.contains(&now));
        from_robots.try_iter().for_each(|packet: Packet| down.send(&packet, now));
        from_subscribers.try_iter().for_each(|packet: Packet| up.send(&packet, now));
        for (link, session) in [(&mut down, &to_subscribers), (&mut up, &to_robots)] {
            for (key, bytes) in link.arrived(now).iter().filter_map(|packet| unpack(packet)) {
                session.put(key, bytes).wait().map_err(|error| anyhow!("{error}"))?;
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn open(how: &str, endpoints: &str) -> anyhow::Result<Session> {
    let mut config = Config::default();
    let endpoints: Vec<&str> = endpoints.split(',').collect();
    let other = if how == "listen" { "connect" } else { "listen" };
    for (key, value) in [
        ("mode".to_string(), "\"peer\"".to_string()),
        ("scouting/multicast/enabled".to_string(), "false".to_string()),
        (format!("{how}/endpoints"), serde_json::to_string(&endpoints)?),
        (format!("{other}/endpoints"), "[]".to_string()),
        ("connect/timeout_ms".to_string(), "-1".to_string()),
        ("connect/exit_on_failure".to_string(), "false".to_string()),
    ] {
        config.insert_json5(&key, &value).map_err(|error| anyhow!("{key}: {error}"))?;
    }
    zenoh::open(config).wait().map_err(|error| anyhow!("{error}"))
}

fn subscribe(session: &Session, keys: &str, to: SyncSender<Packet>) -> anyhow::Result<Subscriber<()>> {
    let take = move |sample: zenoh::sample::Sample| {
        let key = sample.key_expr().as_str();
        // What does not fit is lost, as on any link.
        let _ = to.try_send([&[key.len() as u8], key.as_bytes(), &sample.payload().to_bytes()].concat());
    };
    session.declare_subscriber(keys).callback(take).wait().map_err(|error| anyhow!("{error}"))
}

fn unpack(packet: &[u8]) -> Option<(&str, &[u8])> {
    let (&length, rest) = packet.split_first()?;
    let (key, bytes) = rest.split_at_checked(usize::from(length))?;
    Some((std::str::from_utf8(key).ok()?, bytes))
}
