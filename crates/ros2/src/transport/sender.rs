use super::dds::DdsSender;
#[cfg(feature = "zenoh")]
use super::zenoh::ZenohSender;
use serde::Serialize;

/// Publisher of a topic.
pub enum Sender<M: Serialize> {
    Dds(DdsSender<M>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohSender),
}

impl<M: Serialize> Sender<M> {
    pub fn subscribers(&self) -> usize {
        match self {
            Self::Dds(sender) => sender.subscribers(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(sender) => sender.subscribers(),
        }
    }

    /// Sends a message to all subscribers.
    ///
    /// # Errors
    ///
    /// The message was not sent.
    pub fn send(&self, message: M) -> anyhow::Result<()> {
        match self {
            Self::Dds(sender) => sender.send(message),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(sender) => sender.send(&message),
        }
    }
}
