use super::attachment::{Attachment, GID_BYTES};
use super::cdr;
use super::subscribers::Subscribers;
use anyhow::anyhow;
use serde::Serialize;
use std::sync::atomic::{AtomicI64, Ordering};
use zenoh::Wait as _;
use zenoh_ext::AdvancedPublisher;

/// Publisher with the subscriptions of its topic.
pub struct ZenohSender {
    pub publisher: AdvancedPublisher<'static>,
    pub subscribers: Subscribers,
    pub gid: [u8; GID_BYTES],
    pub sent: AtomicI64,
}

impl ZenohSender {
    /// Returns the number of ROS subscriptions; without any, 1 if Zenoh subscribers without a token match.
    pub fn subscribers(&self) -> usize {
        match self.subscribers.count() {
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
