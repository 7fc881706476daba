use crate::live_map::MapVersion;
use crate::transport::{Qos, Sender, Transport, TypeName};
use serde::Serialize;

/// A topic that tells the state of the map to who comes late, too; and which state was sent last.
pub struct Outlet<M: Serialize> {
    topic: String,
    sender: Sender<M>,
    sent: Option<MapVersion>,
}

impl<M: Serialize> Outlet<M> {
    /// # Errors
    ///
    /// The transport refuses.
    pub fn new(transport: &mut Transport, topic: &str, kind: TypeName) -> anyhow::Result<Self> {
        let sender = transport.advertise(topic, kind, Qos::latched(1))?;
        Ok(Self { topic: topic.to_owned(), sender, sent: None })
    }

    /// Whether somebody listens.
    pub fn is_wanted(&self) -> bool {
        self.sender.listeners() > 0
    }

    /// Sends the message about a state of the map, if it is another one than was sent and somebody listens.
    pub fn refresh(&mut self, version: MapVersion, make: impl FnOnce() -> anyhow::Result<M>) {
        if self.sent == Some(version) || !self.is_wanted() {
            return;
        }
        match make() {
            Ok(message) => match self.sender.send(message) {
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
pub(super) fn is_expired(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(voxtile::Error::Expired))
}
