use super::diagnostics::diagnostics;
use crate::counters::Counters;
use crate::inbox::Inbox;
use crate::live_map::LiveMap;
use crate::messages::DiagnosticArray;
use anyhow::anyhow;
use ros2_client::qos::{History, QosProfile};
use ros2_client::{MessageTypeName, Name, Node, Publisher};
use std::time::{Duration, Instant};

/// Tells `/diagnostics` once a second how the node does.
pub struct Diagnosing {
    node_name: String,
    publisher: Publisher<DiagnosticArray>,
    before: Counters,
    told_at: Instant,
}

const EVERY: Duration = Duration::from_secs(1);

impl Diagnosing {
    /// # Errors
    ///
    /// DDS refuses.
    pub fn new(node: &mut Node, node_name: &str) -> anyhow::Result<Self> {
        let failed = |error: &dyn std::fmt::Debug| anyhow!("diagnostics: {error:?}");
        let qos = QosProfile::publisher_default().history(History::KeepLast { depth: 10 });
        let name = Name::new("/", "diagnostics").map_err(|error| failed(&error))?;
        let type_name = MessageTypeName::new("diagnostic_msgs", "DiagnosticArray");
        let topic = node.create_topic(&name, type_name, &qos).map_err(|error| failed(&error))?;
        let publisher = node.create_publisher(&topic, Some(qos)).map_err(|error| failed(&error))?;
        let node_name = node_name.to_owned();
        Ok(Self { node_name, publisher, before: Counters::default(), told_at: Instant::now() })
    }

    /// Tells, if it is time and somebody listens.
    pub fn refresh(&mut self, node: &Node, inbox: &Inbox, map: &LiveMap) {
        let since = self.told_at.elapsed();
        if since < EVERY || self.publisher.get_subscription_count(node) == 0 {
            return;
        }
        let (now, waiting) = inbox.counters();
        let message = diagnostics(&self.node_name, &map.health(), [&self.before, &now], waiting, since);
        if let Err(error) = self.publisher.publish(message) {
            log::debug!("diagnostics: not sent: {error}");
        }
        (self.before, self.told_at) = (now, Instant::now());
    }
}
