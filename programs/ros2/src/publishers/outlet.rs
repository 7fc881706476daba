use crate::live_map::MapVersion;
use crate::names::Names;
use anyhow::anyhow;
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{MessageTypeName, Node, Publisher};
use serde::Serialize;

/// A topic that tells the state of the map to who comes late, too; and which state was sent last.
pub struct Outlet<M: Serialize> {
    topic: String,
    publisher: Publisher<M>,
    sent: Option<MapVersion>,
}

impl<M: Serialize> Outlet<M> {
    /// # Errors
    ///
    /// DDS refuses.
    pub fn new(
        node: &mut Node,
        names: &Names,
        topic: &str,
        [package, type_name]: [&str; 2],
    ) -> anyhow::Result<Self> {
        let qos = QosProfile::publisher_default()
            .reliability_reliable(WhenFull::DEFAULT)
            .durability(Durability::TransientLocal)
            .history(History::KeepLast { depth: 1 });
        let failed = |error: &dyn std::fmt::Debug| anyhow!("{topic}: {error:?}");
        let name = names.of(topic)?;
        let type_name = MessageTypeName::new(package, type_name);
        let dds_topic = node.create_topic(&name, type_name, &qos).map_err(|error| failed(&error))?;
        let publisher = node.create_publisher(&dds_topic, Some(qos)).map_err(|error| failed(&error))?;
        Ok(Self { topic: names.full(topic), publisher, sent: None })
    }

    /// Whether somebody listens.
    pub fn is_wanted(&self, node: &Node) -> bool {
        self.publisher.get_subscription_count(node) > 0
    }

    /// Sends the message about a state of the map, if it is another one than was sent and somebody listens.
    pub fn refresh(&mut self, node: &Node, version: MapVersion, make: impl FnOnce() -> anyhow::Result<M>) {
        if self.sent == Some(version) || !self.is_wanted(node) {
            return;
        }
        match make() {
            Ok(message) => match self.publisher.publish(message) {
                Ok(()) => self.sent = Some(version),
                Err(error) => log::debug!("{}: not sent, tried again: {error}", self.topic),
            },
            Err(error) if is_expired(&error) => log::debug!("{}: tried again: {error}", self.topic),
            Err(error) => {
                log::warn!("{}: not sent: {error:#}", self.topic);
                // The same map would fail again.
                self.sent = Some(version);
            }
        }
    }
}

/// Whether too much changed while a message was made.
fn is_expired(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(voxtile::Error::Expired))
}
