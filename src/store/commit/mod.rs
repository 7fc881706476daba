//! The one commit point: versions written beside the committed ones, one synced record in `commits.log`, and what comes after.

pub(super) mod checkpoint;
pub(super) mod commit_log;
pub(super) mod commit_record;
pub(super) mod committer;
mod flush;
pub(super) mod input_record;
pub(super) mod metadata;
