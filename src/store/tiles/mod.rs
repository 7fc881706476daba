//! Tiles in the store: their list, their files, and their versions in the log.

pub(super) mod file_checksum;
pub(super) mod spill_file;
pub(super) mod tables;
pub(super) mod tile_location;
pub(super) mod tile_reader;
pub(super) mod tile_version;
pub(super) mod tile_versions;
pub(super) mod tile_writer;
