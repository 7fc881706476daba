use serde::{Deserialize, Serialize};

/// Request or response in Cyclone DDS: the body follows the client's GUID and the sequence number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marked<T> {
    pub guid: u64,
    pub number: i64,
    pub body: T,
}
