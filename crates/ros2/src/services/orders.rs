use super::Order;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// An order, and where the answer goes.
#[derive(Debug)]
pub struct PlacedOrder {
    pub order: Order,
    answer: SyncSender<Result<String, String>>,
}

/// Takes orders to the mapping thread.
#[derive(Clone, Debug)]
pub struct Orders(SyncSender<PlacedOrder>);

/// Orders that may wait; one more waits with its sender.
const MAX_WAITING: usize = 16;

/// Both ends of the way that orders take.
pub fn orders() -> (Orders, Receiver<PlacedOrder>) {
    let (sender, receiver) = sync_channel(MAX_WAITING);
    (Orders(sender), receiver)
}

impl Orders {
    /// Waits until the order is done, or will not be.
    ///
    /// # Errors
    ///
    /// Why it was not done.
    pub fn place(&self, order: Order) -> Result<String, String> {
        let (answer, done) = sync_channel(1);
        let ended = |_| "the node has ended".to_owned();
        self.0.send(PlacedOrder { order, answer }).map_err(|_| "the node has ended".to_owned())?;
        done.recv().map_err(ended)?
    }
}

impl PlacedOrder {
    /// Tells who placed it.
    pub fn answer(self, answer: Result<String, String>) {
        // Nobody waits for it any more: that is no fault.
        let _ = self.answer.send(answer);
    }
}
