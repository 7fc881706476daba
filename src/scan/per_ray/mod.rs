//! Insertion per ray, as in OctoMap's `insertRay`: a voxel is updated by each ray that crosses it.
//!
//! The evidence of a voxel depends only on the order of its own updates. Therefore rays are counted, and the updates of
//! a voxel are runs: a number of misses, then a hit. Only voxel caches, which depend on the order of all updates, use a
//! list.

mod collector;
mod far_runs;
mod ordered;

pub(crate) use collector::{PerRayCollector, drain_in_order, updates_in_order};
pub(crate) use ordered::OrderedCollector;
