//! Exact distances to the nearest obstacle, for planners.
//!
//! The distance of a voxel is the Euclidean distance between its center and that of the nearest obstacle, up to a cap.
//! It is stored as the squared distance in voxels, a whole number, so it is exact and does not depend on tiles, regions,
//! memory or threads.
//!
//! ```text
//! map -> tile_voxels, observed                   which voxels are known and occupied
//!     -> transform: row_squares, line             squared distances of a box: along x, then y, then z
//!     -> solve                                    signs, unknown voxels, distances beyond the cap
//!     -> DistanceField                            a box in memory: points, gradients, paths
//! map after each scan -> LiveDistances             the field of a box around the robot: live, live_observed
//! map -> compute_field -> FieldReader              a field in a folder, larger than memory: folder/
//! ```
//!
//! [`MapDistances`] adds fields to every map of tiles; [`DistanceField::of_set`] is for local maps.

mod bits;
mod cap;
mod clearance;
mod distance;
mod extent;
mod field;
mod folder;
mod interpolation;
mod line;
mod live;
mod live_observed;
mod observed;
mod options;
mod row_squares;
mod solve;
mod tile_voxels;
mod tiles_of_map;
mod transform;
mod voxel_distance;

pub use cap::MAX_CAP_VOXELS;
pub use clearance::{Blocked, Clearance};
pub use distance::{Distance, DistanceAndGradient};
pub use field::{DistanceField, MapDistances};
pub use folder::{FieldOptions, FieldReader, FieldReport, compute_field};
pub use live::{DistanceReader, DistanceUpdate, LiveDistances};
pub use options::{DistanceOptions, UnknownRule};
pub use voxel_distance::VoxelDistance;
