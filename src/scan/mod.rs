//! Scans of a sensor, and the voxel updates computed from them.
//!
//! ```text
//! Scan, ScanRef -> rays -> marks or counts in pages -> updates, grouped by tile
//!                  ray     pages, coherence            per_scan or per_ray, updates; spill if memory is short
//! ```
//!
//! With guarded clearing, `clearing` finds the weak misses of a scan between marks and updates.
//!
//! `trace` coordinates all of it. Updates do not depend on the content of tiles, so they can be stored and applied
//! later. `codec` compresses the points of kept scans.

mod clearing;
mod codec;
mod coherence;
mod coordinate;
mod moving_marks;
mod pages;
mod per_ray;
mod per_scan;
mod point_attributes;
mod point_batch;
mod pose;
mod ray;
mod report;
mod scan_points;
mod scan_ref;
mod spill;
mod stop;
#[cfg(test)]
mod tests;
mod trace;
mod updates;
mod world_scan;

pub use crate::sensor::{NO_TIME, Sweep, ToStamp};
#[doc(hidden)]
pub use codec::PointBlocks;
pub(crate) use codec::{MAX_BLOCK_BYTES, PointDecoder, unzigzag, zigzag};
pub use coordinate::Coordinate;
pub(crate) use moving_marks::ChunkMarks;
pub use moving_marks::{MovingMarks, MovingMarksBuilder};
pub use point_attributes::{AttributeSet, AttributeSlices, PointAttributes};
pub use point_batch::PointBatch;
pub(crate) use point_batch::updates_of_hits;
pub use pose::Pose;
pub(crate) use ray::Advanced;
pub use ray::{MAX_RAY_STEPS, RayWalk, is_hit, no_return};
pub use report::{ScanReport, SkippedPoints};
pub use scan_points::{PointFrame, ScanPoints, TakeAttributed, TakePoints};
pub use scan_ref::ScanRef;
pub(crate) use spill::Overflow;
pub use stop::Stop;
pub use trace::ScanTracer;
pub(crate) use trace::{TraceRules, UpdateOrder};
pub(crate) use updates::MappedTiles;
pub use updates::{
    BrickRuns, BrickUpdate, LayerHit, LayerHits, Misses, OFFSETS_PER_VOXEL, OrderedUpdates, PackedUpdates,
    Run, ScanUpdates, TileRuns, TileUpdates,
};
pub use world_scan::Scan;
