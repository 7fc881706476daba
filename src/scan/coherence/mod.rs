//! Beam coherence: rays of nearly the same direction cross nearly the same voxels, so most of a ray need not be traced.
//!
//! The points are processed in sampling passes. The first passes are spread over the whole scan. Their marks are then
//! summarised by cones of directions, and the rays of later passes start after the marked part. This saves time only;
//! the marks are the same.

mod cone;
mod marked_prefix;
mod sampling;

pub(crate) use cone::cell_of;
pub(crate) use marked_prefix::MarkedPrefixes;
pub(crate) use sampling::{sampling_passes, single_pass};
