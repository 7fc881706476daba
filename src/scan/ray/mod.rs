//! One ray: where it ends, and which voxels it crosses.
//!
//! [`RayWalk`] is the definition, one voxel after the other in closed form. [`SlabRay`] crosses the same voxels many
//! times faster, in slabs one voxel thick with fixed-point sums, and leaves to the definition what the sums cannot
//! decide.

mod range;
mod ray_end;
mod ray_origin;
mod ray_walk;
mod slab_path;
mod slab_ray;

pub use range::no_return;
pub(crate) use range::{NO_RETURN_M, RangeRule, Ranged};
pub(crate) use ray_end::RayEnd;
pub(crate) use ray_origin::RayOrigin;
pub use ray_walk::{MAX_RAY_STEPS, RayWalk};
pub(crate) use slab_path::Stretch;
pub(crate) use slab_ray::{SlabRay, voxel};
