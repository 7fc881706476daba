//! Temporary files for data that exceeds the memory budget of a reader, and access to the bytes and records in them.

mod budget;
#[cfg(feature = "ros")]
mod bytes;
mod file_part;
mod pose_list;
mod sorter;
#[cfg(feature = "ros")]
mod spill_file;

pub use budget::Budget;
#[cfg(feature = "ros")]
pub(crate) use bytes::{Bytes, Window};
#[cfg(feature = "ros")]
pub(crate) use file_part::FilePart;
pub(crate) use pose_list::{PoseList, PoseWriter, TimedPose};
#[cfg(any(feature = "las", feature = "ros"))]
pub(crate) use sorter::Sorted;
pub(crate) use sorter::{Record, Sorter};
#[cfg(feature = "ros")]
pub(crate) use spill_file::{Complaint, SpillFile, StreamSize};
