use super::attachment::{Attachment, GID_BYTES};
use super::cdr;
use super::listeners::Listeners;
use anyhow::anyhow;
use serde::Serialize;
use std::sync::atomic::{AtomicI64, Ordering};
use zenoh::Wait as _;
use zenoh_ext::AdvancedPublisher;

/// A publisher, and who listens.
pub struct ZenohSender {
    pub publisher: AdvancedPublisher<'static>,
    pub listeners: Listeners,
    pub gid: [u8; GID_BYTES],
    pub sent: AtomicI64,
}

impl ZenohSender {
    /// Subscriptions of ROS; if there are none, 1 for those that have no token.
    pub fn listeners(&self) -> usize {
        match self.listeners.count() {
            0 => self.publisher.matching_status().wait().map_or(0, |status| usize::from(status.matching())),
            count => count,
        }
    }

    pub fn send<M: Serialize>(&self, message: &M) -> anyhow::Result<()> {
        let bytes = cdr::encode(message)?;
        let number = self.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = Attachment::now(number, self.gid).to_bytes();
        self.publisher.put(bytes).attachment(attachment).wait().map_err(|error| anyhow!("{error}"))
    }
}
