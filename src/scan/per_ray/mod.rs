//! Insertion per ray, as in OctoMap's `insertRay`: a voxel is updated by every ray that crosses it.
//!
//! The evidence of a voxel depends on the order of its own updates alone. So rays are counted, and a voxel's updates
//! are runs: so many misses, then a hit. Only voxel caches, which see the order of all updates, get a list of them.

mod collector;
mod far_runs;
mod ordered;

pub(crate) use collector::{PerRayCollector, drain_in_order, updates_in_order};
pub(crate) use ordered::OrderedCollector;
