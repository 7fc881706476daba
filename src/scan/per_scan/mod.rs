//! Insertion per scan, as in OctoMap's `insertPointCloud`: a scan updates a voxel once, and a hit overrides any miss.
//!
//! Therefore rays only mark voxels, in any order and on any number of threads.

mod bricks;
mod collector;
mod far_bricks;
mod hit_batch;
mod page_marks;
mod page_updates;

pub(crate) use bricks::{
    Intensities, guarded_updates, hits_and_misses, marks_by_tile, merge_bricks, updates_by_tile,
};
pub(crate) use collector::{BATCH, PerScanCollector};
pub(crate) use hit_batch::HitBatch;
