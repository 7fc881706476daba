use crate::live_map::MapVersion;
use crate::transport::{Qos, Sender, Transport, TypeName};
use serde::Serialize;

/// Latched topic of the map, with the last sent version.
pub struct Outlet<M: Serialize> {
    topic: String,
    sender: Sender<M>,
    sent: Option<MapVersion>,
}

impl<M: Serialize> Outlet<M> {
    /// # Errors
    ///
    /// The transport cannot create the publisher.
    pub fn new(transport: &mut Transport, topic: &str, kind: TypeName) -> anyhow::Result<Self> {
        let sender = transport.advertise(topic, kind, Qos::latched(1))?;
        Ok(Self { topic: topic.to_owned(), sender, sent: None })
    }

    pub fn is_wanted(&self) -> bool {
        self.sender.subscribers() > 0
    }

    /// Sends a message if the version is new and there are subscribers.
    pub fn refresh(&mut self, version: MapVersion, make: impl FnOnce() -> anyhow::Result<M>) {
        if self.sent == Some(version) || !self.is_wanted() {
            return;
        }
        match make() {
            Ok(message) => match self.sender.send(message) {
                Ok(()) => self.sent = Some(version),
                Err(error) => log::debug!("{}: not sent, will retry: {error}", self.topic),
            },
            Err(error) if is_expired(&error) => log::debug!("{}: will retry: {error}", self.topic),
            Err(error) => {
                log::warn!("{}: not sent: {error:#}", self.topic);
                // Do not retry: the same map would fail again.
                self.sent = Some(version);
            }
        }
    }
}

/// Returns whether a message failed because the map changed too much meanwhile.
pub(super) fn is_expired(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(voxtile::Error::Expired))
}
