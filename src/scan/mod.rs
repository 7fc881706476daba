//! One look of a sensor, and what it says about voxels.
//!
//! ```text
//! Scan -> rays -> voxels -> updates, grouped by tile
//! ```
//!
//! The updates know nothing of what a tile holds: they can be kept and applied later.

mod batch;
mod cone;
mod counted_page;
mod every_ray;
mod fan;
mod far_bricks;
mod far_runs;
mod footprint;
mod head_start;
mod marked_page;
mod once;
mod once_bricks;
mod ordered;
mod overflow;
mod packed_updates;
mod page_map;
mod part_log;
mod range;
mod ray;
mod ray_end;
mod ray_origin;
mod report;
mod rounds;
mod scan_parts;
mod scan_points;
mod slab_path;
mod slab_ray;
mod sparse_page;
mod stop;
#[cfg(test)]
mod tests;
mod tile_order;
mod trace;
mod trace_limit;
mod updates;
mod window;
mod world_scan;

pub use batch::PointBatch;
pub(crate) use overflow::Overflow;
pub use packed_updates::PackedUpdates;
pub use ray::{MAX_RAY_STEPS, RayWalk};
pub use report::{ScanReport, SkippedPoints};
pub use scan_points::{ScanPoints, TakePoints};
pub use stop::Stop;
pub use trace::ScanTracer;
pub(crate) use trace::UpdateOrder;
pub use updates::{BrickRuns, BrickUpdate, OrderedUpdates, Run, ScanUpdates, TileUpdates};
pub use world_scan::Scan;
