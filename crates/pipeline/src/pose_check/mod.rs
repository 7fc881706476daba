//! Checks whether poses fit their scans: with correct poses, a scan overlaps the previous scans.
//!
//! [`PoseCheck`] selects some of the first scans that are a few metres apart, and `overlap.rs` computes their overlap.
//! `reading.rs` lists other interpretations of the poses: quaternions with w first, inverse poses, camera poses,
//! millimetres. Distant key frames and stations overlap little even with correct poses, so poses are only doubted if
//! another interpretation gives more overlap.

mod ahead;
mod check;
mod overlap;
mod reading;

pub use ahead::check_ahead;
pub use check::{Doubt, PoseCheck};
