//! Tables that stay when they are replaced: for snapshots, until these are deleted, and for readers beside the writer.

pub(super) mod kept_tables;
pub(super) mod readers;
pub(super) mod seen_tables;
pub(super) mod snapshot_file;
pub(super) mod snapshot_list;
pub(super) mod snapshot_name;
pub(super) mod snapshot_writer;
pub(super) mod snapshots_of_map;
