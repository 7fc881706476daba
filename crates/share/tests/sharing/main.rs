//! Tests of sharing: receivers get the set of a sender over unreliable links.

/// Encoding of packets, and hostile bytes.
mod codec;
/// Memory limits: memory that a receiver counts, and memory measured while robots send as much as they can.
mod full_memory;
/// Merging of layers, unions, watches.
mod layers;
/// Receivers with a shared memory limit, and the cost of a packet.
mod memory;
/// Random changes over bad links: the sets are equal at the end.
mod random_lives;
/// Limits on the effect of hostile packets.
mod trust;
