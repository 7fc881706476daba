//! A single ray: its end, and the voxels that it crosses.
//!
//! [`RayWalk`] is the reference: it computes one voxel after the other in closed form. [`SlabRay`] crosses the same
//! voxels many times faster, in slabs one voxel thick with fixed-point sums, and uses the reference where the sums are
//! not exact enough. [`RayCut`] determines in advance which slabs can be in the selected tiles.

mod range;
mod ray_cut;
mod ray_end;
mod ray_origin;
mod ray_walk;
mod slab_path;
mod slab_ray;
mod slab_span;
mod slope;

pub(crate) use range::{NO_RETURN_M, RangeRule, Ranged};
pub use range::{is_hit, no_return};
pub(crate) use ray_cut::RayCut;
pub(crate) use ray_end::RayEnd;
pub(crate) use ray_origin::RayOrigin;
pub(crate) use ray_walk::Advanced;
pub use ray_walk::{MAX_RAY_STEPS, RayWalk};
pub(crate) use slab_path::Stretch;
pub(crate) use slab_ray::{SlabRay, voxel};
pub(crate) use slab_span::SlabSpan;
pub(crate) use slope::Slope;
