//! Named bytes on disk; knows no voxel.
//!
//! ```text
//! TileStore -> tiles (versions, locations), commit (log, metadata, checkpoint), snapshots, recovery
//!           -> MapFiles, Layout (names) -> Disk -> the file system
//! ```
//!
//! Every file operation of a map, syncs included, goes through [`Disk`], so that a failing disk and a crash are
//! ordinary tests. The protocol of a flush and what a crash leaves are in
//! `docs/durability.md`.

mod commit;
mod disk;
mod fs_disk;
mod layout;
mod map_files;
mod map_folder;
mod place;
mod recovery;
mod snapshots;
mod tile_store;
mod tiles;

pub use crate::scratch::Scratch;
pub use commit::commit_log::{CommitLog, Commits};
pub use commit::commit_record::Flush;
pub(crate) use commit::input_record::MOST_INPUTS;
pub use commit::input_record::{InputContent, InputRecord};
pub use commit::metadata::{Bounds, Extension, MapParameters, Metadata};
pub use disk::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch};
pub use fs_disk::FsDisk;
pub use layout::{Layout, QUARANTINE, SNAPSHOT_NEXT, SNAPSHOTS, TileFile, folder_name, tile_of_folder};
pub use map_folder::{Lock, read_log};
pub use place::check_outside_of_maps;
pub use recovery::quarantine::Quarantine;
pub use recovery::salvage::Salvage;
pub use recovery::staged_map::{StagedMap, staging_folder};
pub use snapshots::snapshot_file::Snapshot;
pub use snapshots::snapshot_list::SnapshotList;
pub use snapshots::snapshot_name::SnapshotName;
pub use tile_store::TileStore;
pub(crate) use tile_store::{hex, id_from_hex};
pub use tiles::spill_file::SpillFile;
pub use tiles::tile_location::{StoredTile, TileLocation};
pub(crate) use tiles::tile_version::MAX_NUMBER;
pub use tiles::tile_version::{Checksumming, FileChecksum, TileVersion};
pub use tiles::tile_writer::TileWriter;
