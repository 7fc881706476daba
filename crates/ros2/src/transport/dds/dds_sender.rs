use anyhow::anyhow;
use ros2_client::{Node, Publisher};
use serde::Serialize;
use std::sync::{Arc, Mutex, PoisonError};

/// Publisher with its node, which counts the subscribers.
pub struct DdsSender<M: Serialize> {
    pub node: Arc<Mutex<Node>>,
    pub publisher: Publisher<M>,
}

impl<M: Serialize> DdsSender<M> {
    pub fn subscribers(&self) -> usize {
        let node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
        self.publisher.get_subscription_count(&node)
    }

    pub fn send(&self, message: M) -> anyhow::Result<()> {
        self.publisher.publish(message).map_err(|error| anyhow!("{error}"))
    }
}
