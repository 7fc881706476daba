use super::Order;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Order with the channel for its answer.
#[derive(Debug)]
pub struct PlacedOrder {
    pub order: Order,
    answer: SyncSender<Result<String, String>>,
}

/// Sender of orders to the mapping thread.
#[derive(Clone, Debug)]
pub struct Orders(SyncSender<PlacedOrder>);

/// Capacity of the queue. When it is full, senders block.
const MAX_WAITING: usize = 16;

pub fn orders() -> (Orders, Receiver<PlacedOrder>) {
    let (sender, receiver) = sync_channel(MAX_WAITING);
    (Orders(sender), receiver)
}

impl Orders {
    /// Waits until the order is done or has failed.
    ///
    /// # Errors
    ///
    /// The reason of the failure.
    pub fn place(&self, order: Order) -> Result<String, String> {
        let (answer, done) = sync_channel(1);
        let ended = |_| "the node has stopped".to_owned();
        self.0.send(PlacedOrder { order, answer }).map_err(|_| "the node has stopped".to_owned())?;
        done.recv().map_err(ended)?
    }
}

impl PlacedOrder {
    pub fn answer(self, answer: Result<String, String>) {
        // The caller may have stopped waiting.
        let _ = self.answer.send(answer);
    }
}
