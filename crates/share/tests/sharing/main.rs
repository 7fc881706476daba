//! The set of a sender arrives at receivers, whatever the link does.

/// Bytes of packets against plain ones, and hostile ones.
mod codec;
/// Memory that hostile robots fill, counted and measured.
mod full_memory;
/// Folding, unions, watches.
mod layers;
/// Receivers under one limit of memory, and the work a packet makes.
mod memory;
/// Random lives of a sender and receivers over a bad link: equal sets at the end.
mod random_lives;
/// What hostile packets may not do.
mod trust;
