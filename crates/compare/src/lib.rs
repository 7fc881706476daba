//! Compares two maps of one place: which voxels vanished or appeared, and which the other map has not observed.
//!
//! A map knows free, occupied and unknown voxels. So a surface of the earlier map has *vanished* only if the later map
//! saw through its place and around it, and is *not seen* where the later map has no observation.
//!
//! ```text
//! map -> tile_masks, mask_reader                  known, occupied, surely occupied, surely free voxels of tiles
//!     -> blocks, block_bits, bits                  the same as bits of a block of 128 x 128 x 128 voxels and around it
//!     -> classify                                 a class for each occupied voxel
//! viewpoints -> hidden                            of those not seen, the ones that something was in front of
//!     -> components                               connected voxels of a class within a block
//!     -> joined                                   the same across blocks
//! compare -> collected -> Comparison              counts, and the list of changes
//! compare_span -> join_spans -> Comparison        the same by several processes, each for a span of blocks
//! for_each_voxel                                  the voxels with their classes, in a second pass
//! frontiers -> frontier_search                    free voxels next to unknown ones, of one map
//!     -> components -> joined                     the same, clustered
//!     -> frontier_goals                           a free voxel of each cluster for a robot, in a second pass
//! observations -> nearest_position             how often and from how far voxels were observed
//! tops -> volumes                                 highest voxels of columns, and what is between two surfaces
//! ```
//!
//! All of it takes constant memory per core, in addition to the list of changes. Blocks do not depend on tiles, so the
//! result depends on neither tiles, nor memory, nor threads.

mod bits;
mod block_bits;
mod blocks;
mod change;
mod classify;
mod collected;
mod compare;
mod components;
mod frontier_goals;
mod frontier_search;
mod frontiers;
mod hidden;
mod joined;
mod mask_reader;
mod nearest_position;
mod observations;
mod options;
mod sets;
mod span;
mod sweep;
mod tile_masks;
mod tops;
mod viewpoints;
mod visit;
mod volume_options;
mod volumes;
mod voxel_class;

pub use change::{Change, ChangeKind, Clusters, Comparison, EpochCounts};
pub use compare::compare;
pub use frontiers::{Coverage, Frontier, FrontierOptions, frontiers, frontiers_in};
pub use observations::{Class, Observations, observations};
pub use options::{CompareOptions, MAX_TOLERANCE_VOXELS};
pub use span::{ComparedSpan, compare_span, count_blocks, join_spans};
pub use viewpoints::Viewpoints;
pub use visit::{ComparedVoxel, for_each_voxel};
pub use volume_options::VolumeOptions;
pub use volumes::{VolumeSums, Volumes, volumes, volumes_over_plane};
pub use voxel_class::VoxelClass;
