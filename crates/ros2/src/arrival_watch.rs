use crate::args::Args;
use crate::inbox::Inbox;
use crate::transport::{Graph, Published, TransportName};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Warns if no cloud arrives on a topic, and names the topics that have clouds.
pub struct ArrivalWatch {
    inbox: Arc<Inbox>,
    graph: Graph,
    topics: Vec<Topic>,
    surroundings: Surroundings,
}

/// What the explanation of a missing topic depends on.
#[derive(Debug)]
struct Surroundings {
    /// Absolute names of the topics of clouds that this node reads or publishes.
    known: Vec<String>,
    domain_id: u16,
    transport: TransportName,
    is_local: bool,
}

#[derive(Debug)]
struct Topic {
    /// Absolute name after remapping.
    name: String,
    arrived: u64,
    /// Time of the last cloud, or of the start.
    since: Instant,
    warned_at: Option<Instant>,
}

const CLOUD: &str = "sensor_msgs/msg/PointCloud2";
/// Time without a cloud before the first warning.
const QUIET: Duration = Duration::from_secs(5);
/// Interval between repeated warnings: a sensor may be switched off on purpose.
const REPEAT_EVERY: Duration = Duration::from_secs(60);
const CHECK_EVERY: Duration = Duration::from_secs(1);
/// Interval between checks of the stop flag.
const POLL_EVERY: Duration = Duration::from_millis(50);
/// Maximum number of topics named in a warning.
const MAX_NAMES: usize = 10;

impl ArrivalWatch {
    /// # Errors
    ///
    /// Invalid names.
    pub fn new(args: &Args, inbox: Arc<Inbox>, graph: Graph, own: &[&str]) -> anyhow::Result<Self> {
        let (names, now) = (args.names()?, Instant::now());
        let name = |topic: &str| names.full(topic);
        let topic = |name| Topic { name, arrived: 0, since: now, warned_at: None };
        let topics: Vec<Topic> = args.cloud_topics().into_iter().map(topic).collect();
        let read = topics.iter().map(|topic| topic.name.clone());
        let surroundings = Surroundings {
            known: read.chain(own.iter().map(|topic| name(topic))).collect(),
            domain_id: args.domain_id,
            transport: args.transport,
            is_local: !args.network,
        };
        Ok(Self { inbox, graph, topics, surroundings })
    }

    pub fn run(mut self, stop: &AtomicBool) {
        let mut checked_at = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if checked_at.elapsed() >= CHECK_EVERY {
                checked_at = Instant::now();
                self.check(checked_at);
            }
            std::thread::sleep(POLL_EVERY);
        }
    }

    fn check(&mut self, now: Instant) {
        let mut quiet = Vec::new();
        for (topic, (_, arrived)) in self.topics.iter_mut().zip(self.inbox.arrived()) {
            if topic.note(arrived, now) {
                quiet.push((topic.name.clone(), now.saturating_duration_since(topic.since)));
            }
        }
        if quiet.is_empty() {
            return;
        }
        let published = self.graph.published();
        for (name, quiet) in quiet {
            log::warn!(
                "no cloud on {name} for {:.0} s: {}",
                quiet.as_secs_f64(),
                self.surroundings.cause(&name, &published)
            );
        }
    }
}

impl Surroundings {
    /// Returns the probable cause why a topic has no clouds, and what to do.
    fn cause(&self, name: &str, published: &[Published]) -> String {
        let kinds: BTreeSet<&str> = published
            .iter()
            .filter(|published| published.topic == name)
            .map(|published| published.kind.as_str())
            .collect();
        if kinds.contains(CLOUD) {
            return match self.transport {
                TransportName::Dds => {
                    "it has a publisher, but no message arrives. Is the sensor on? Large clouds are lost if \
                     net.core.rmem_max is small"
                        .to_owned()
                }
                TransportName::Zenoh => {
                    "it has a publisher, but no message arrives. Is the sensor on?".to_owned()
                }
            };
        }
        let wrong_type = match kinds.first() {
            Some(kind) => format!("it has the type {}, not {CLOUD}; ", kind.escape_debug()),
            None => String::new(),
        };
        let is_other =
            |published: &&Published| published.kind == CLOUD && !self.known.contains(&published.topic);
        let others: BTreeSet<&str> =
            published.iter().filter(is_other).map(|published| published.topic.as_str()).collect();
        if let Some(first) = others.first() {
            let listed: Vec<String> =
                others.iter().take(MAX_NAMES).map(|name| name.escape_debug().to_string()).collect();
            let (verb, first) = (if others.len() > 1 { "have" } else { "has" }, first.escape_debug());
            let listed = listed.join(", ");
            return format!("{wrong_type}{listed} {verb} clouds; map them with --cloud {first}");
        }
        let place = match (self.transport, self.is_local) {
            (TransportName::Dds, true) => " on the loopback interface (--network includes other machines)",
            (TransportName::Dds, false) => "",
            (TransportName::Zenoh, _) => " known to the Zenoh router",
        };
        format!("{wrong_type}no topic of {CLOUD} is published in domain {}{place}", self.domain_id)
    }
}

impl Topic {
    /// Records the number of received clouds. Returns whether a warning is due.
    fn note(&mut self, arrived: u64, now: Instant) -> bool {
        if arrived > self.arrived {
            if self.warned_at.take().is_some() {
                log::info!("clouds arrive on {}", self.name);
            }
            (self.arrived, self.since) = (arrived, now);
            return false;
        }
        let elapsed = |at: Instant| now.saturating_duration_since(at);
        let is_due =
            elapsed(self.since) >= QUIET && self.warned_at.is_none_or(|at| elapsed(at) >= REPEAT_EVERY);
        if is_due {
            self.warned_at = Some(now);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_topics_are_reported_every_minute() {
        let start = Instant::now();
        let mut topic = Topic { name: "/cloud_in".to_owned(), arrived: 0, since: start, warned_at: None };
        let due = |from: u64, to: u64, topic: &mut Topic, arrived: u64| -> Vec<u64> {
            let is_due = |second: &u64| topic.note(arrived, start + Duration::from_secs(*second));
            (from..to).filter(is_due).collect()
        };
        assert_eq!(due(0, 130, &mut topic, 0), [5, 65, 125]);
        assert_eq!(due(130, 137, &mut topic, 1), [135]);
    }

    #[test]
    fn topics_with_clouds_are_named() {
        let known = ["/cloud_in", "/octomap_point_cloud_centers"].map(str::to_owned).to_vec();
        let place = Surroundings { known, domain_id: 7, transport: TransportName::Dds, is_local: true };
        let published = |topics: &[(&str, &str)]| -> Vec<Published> {
            topics
                .iter()
                .map(|(topic, kind)| Published { topic: (*topic).into(), kind: (*kind).into() })
                .collect()
        };
        let cause = |topics: &[(&str, &str)]| place.cause("/cloud_in", &published(topics));
        let none = cause(&[("/octomap_point_cloud_centers", CLOUD), ("/tf", "tf2_msgs/msg/TFMessage")]);
        assert!(
            none.starts_with("no topic of sensor_msgs/msg/PointCloud2 is published in domain 7"),
            "{none}"
        );
        assert!(none.contains("--network"), "{none}");
        let two = cause(&[("/rear", CLOUD), ("/livox/points", CLOUD), ("/rear", CLOUD)]);
        assert_eq!(two, "/livox/points, /rear have clouds; map them with --cloud /livox/points");
        let other = cause(&[("/cloud_in", "livox_ros_driver2/msg/CustomMsg"), ("/points", CLOUD)]);
        assert_eq!(
            other,
            "it has the type livox_ros_driver2/msg/CustomMsg, not sensor_msgs/msg/PointCloud2; /points has clouds; map \
             them with --cloud /points"
        );
        assert!(cause(&[("/cloud_in", CLOUD)]).contains("rmem_max"));
    }
}
