use serde::{Deserialize, Serialize};

/// A request or a response as Cyclone DDS marks it: who asks, and the number of the question.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marked<T> {
    pub guid: u64,
    pub number: i64,
    pub body: T,
}
