//! Data that the contenders of the comparison and its driver exchange.

mod outcome;
mod points;
mod voxels;

pub use outcome::{Answers, BuildOutcome, MemoryOutcome, OctomapOutcome, QuestionsOutcome};
pub use points::{read_points, write_points};
pub use voxels::{VoxelRecord, read_voxels, write_voxels};
