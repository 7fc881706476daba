use crate::args::Args;
use crate::inbox::{Inbox, Message};
use crate::network_file::NetworkFile;
use anyhow::{Context, anyhow};
use std::sync::Arc;
use std::time::Duration;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session, Wait};

/// Connection to other robots: payloads published under keys.
pub struct Link {
    session: Session,
    inbox: Arc<Inbox>,
    /// Must be kept alive: a dropped subscriber receives nothing.
    subscribers: Vec<zenoh::pubsub::Subscriber<()>>,
}

/// Larger messages are ignored: voxtile sends none.
const MAX_BYTES: usize = 64 << 10;
/// Longer keys are ignored: voxtile uses none.
const MAX_KEY: usize = 128;

impl Link {
    pub fn open(args: &Args) -> anyhow::Result<Self> {
        let (listen, connect) = match args.publish.is_some() {
            true => (or_default(&args.listen, &args.connect), args.connect.clone()),
            false => (args.listen.clone(), or_default(&args.connect, &args.listen)),
        };
        let (mut config, file) = match &args.zenoh_config {
            Some(path) => {
                let config =
                    Config::from_file(path).map_err(|error| anyhow!("{}: {error}", path.display()))?;
                (config, NetworkFile::read(path)?)
            }
            None => (Config::default(), NetworkFile::default()),
        };
        let mut set = |key: &str, value: String| {
            config.insert_json5(key, &value).map_err(|error| anyhow!("{key}: {error}"))
        };
        // Unlike Zenoh's defaults, do not listen on every interface or scout by multicast unless the file sets it.
        if !file.sets("mode") {
            set("mode", "\"peer\"".into())?;
        }
        if !file.sets("transport/link/rx/max_message_size") {
            // Zenoh's default is 1 GB, reassembled from fragments before our callback can check the size.
            set("transport/link/rx/max_message_size", (2 * MAX_BYTES).to_string())?;
        }
        if args.scout || !file.sets("scouting/multicast/enabled") {
            set("scouting/multicast/enabled", args.scout.to_string())?;
        }
        let has_no_endpoint = !file.sets("listen/endpoints") && !file.sets("connect/endpoints");
        if !args.listen.is_empty() || has_no_endpoint {
            set("listen/endpoints", serde_json::to_string(&listen)?)?;
        } else if !file.sets("listen/endpoints") {
            set("listen/endpoints", "[]".into())?;
        }
        if !args.connect.is_empty() || has_no_endpoint {
            set("connect/endpoints", serde_json::to_string(&connect)?)?;
            // Retry unreachable endpoints without a time limit.
            set("connect/timeout_ms", "-1".into())?;
            set("connect/exit_on_failure", "false".into())?;
        }
        let session =
            zenoh::open(config).wait().map_err(|error| anyhow!("cannot open the network: {error}"))?;
        Ok(Self { session, inbox: Arc::default(), subscribers: Vec::new() })
    }

    /// Subscribes to all keys that match `keys`.
    pub fn subscribe(&mut self, keys: &str) -> anyhow::Result<()> {
        let inbox = self.inbox.clone();
        let take = move |sample: zenoh::sample::Sample| {
            let payload = sample.payload();
            if payload.len() > MAX_BYTES || sample.key_expr().len() > MAX_KEY {
                return;
            }
            let key = sample.key_expr().as_str();
            let Some((robot, ..)) = parse_key(key) else { return };
            inbox.put(robot, Message { key: key.to_owned(), bytes: payload.to_bytes().into_owned() });
        };
        let subscriber = self.session.declare_subscriber(keys).callback(take).wait();
        self.subscribers.push(subscriber.map_err(|error| anyhow!("{keys}: {error}"))?);
        Ok(())
    }

    /// Sends a message, or drops it if the network is congested. Never blocks; catch-up repairs the loss.
    pub fn send(&self, key: &str, bytes: Vec<u8>) -> anyhow::Result<()> {
        let put = self.session.put(key, bytes).congestion_control(CongestionControl::Drop).wait();
        put.map_err(|error| anyhow!("{error}")).with_context(|| format!("cannot send to {key}"))
    }

    /// Returns the next message, or `None` after `wait`.
    pub fn next(&self, wait: Duration) -> Option<Message> {
        self.inbox.next(wait)
    }

    pub fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    pub fn close(self) {
        drop(self.subscribers);
        // Ignore a failure to close the session.
        let _ = self.session.close().wait();
    }
}

fn or_default(endpoints: &[String], others: &[String]) -> Vec<String> {
    match endpoints.is_empty() && others.is_empty() {
        true => vec!["tcp/127.0.0.1:7447".to_string()],
        false => endpoints.to_vec(),
    }
}

/// Returns the key of packets to all receivers.
pub fn packets_key(robot: &str) -> String {
    format!("voxtile/{robot}/packets")
}

/// Returns the key of answers to one receiver.
pub fn answers_key(robot: &str, receiver: u64) -> String {
    format!("voxtile/{robot}/answers/{receiver:016x}")
}

/// Returns the key of a receiver's requests.
pub fn asks_key(robot: &str, receiver: u64) -> String {
    format!("voxtile/{robot}/asks/{receiver:016x}")
}

/// Splits a key into robot, kind and receiver.
pub fn parse_key(key: &str) -> Option<(&str, &str, Option<u64>)> {
    let mut parts = key.split('/');
    let (_, robot, kind) = (parts.next()?, parts.next()?, parts.next()?);
    let receiver = parts.next().map(|number| u64::from_str_radix(number, 16));
    Some((robot, kind, receiver.transpose().ok()?))
}
