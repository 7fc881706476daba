//! Snapshots, and replaced tables that are kept for them and for readers.

pub(super) mod kept_tables;
pub(super) mod readers;
pub(super) mod seen_tables;
pub(super) mod snapshot_file;
pub(super) mod snapshot_list;
pub(super) mod snapshot_name;
pub(super) mod snapshot_writer;
pub(super) mod snapshots_of_map;
