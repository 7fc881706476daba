//! Whether poses fit scans: a scan sees again what the scans before it saw, if its pose is right.
//!
//! [`PoseCheck`] picks some of the first scans that are a few metres apart, `overlap.rs` counts how much of each was
//! seen before, and `reading.rs` has other readings of the same poses: w first, the inverse, of a camera, in
//! millimetres.
//! Key frames and stations far from each other overlap little by right poses, too: only another reading by which they
//! overlap is a reason to doubt.

mod ahead;
mod check;
mod overlap;
mod reading;

pub use ahead::check_ahead;
pub use check::{Doubt, PoseCheck};
