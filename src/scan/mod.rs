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
mod footprint;
mod head_start;
mod marked_page;
mod once;
mod ordered;
mod packed_parts;
mod packed_updates;
mod page_choice;
mod page_map;
mod range;
mod ray;
mod ray_end;
mod ray_origin;
mod report;
mod rounds;
mod slab_path;
mod slab_ray;
mod stop;
mod tile_order;
mod trace;
mod trace_memory;
mod updates;
mod window;
mod world_scan;

pub use batch::PointBatch;
pub use packed_updates::PackedUpdates;
pub use ray::{MAX_RAY_STEPS, RayWalk};
pub use report::{ScanReport, SkippedPoints};
pub use stop::Stop;
pub(crate) use trace::PutAside;
pub use trace::ScanTracer;
pub use updates::{BrickRuns, BrickUpdate, OrderedUpdates, Run, ScanUpdates, TileUpdates};
pub use world_scan::Scan;
