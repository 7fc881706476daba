use super::dds::DdsSender;
#[cfg(feature = "zenoh")]
use super::zenoh::ZenohSender;
use serde::Serialize;

/// One end of a topic that the node publishes.
pub enum Sender<M: Serialize> {
    Dds(DdsSender<M>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohSender),
}

impl<M: Serialize> Sender<M> {
    /// How many listen.
    pub fn listeners(&self) -> usize {
        match self {
            Self::Dds(sender) => sender.listeners(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(sender) => sender.listeners(),
        }
    }

    /// Sends a message to all who listen.
    ///
    /// # Errors
    ///
    /// It was not sent.
    pub fn send(&self, message: M) -> anyhow::Result<()> {
        match self {
            Self::Dds(sender) => sender.send(message),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(sender) => sender.send(&message),
        }
    }
}
