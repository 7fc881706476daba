//! Named bytes on disk; knows no voxel.
//!
//! ```text
//! TileStore -> flush, tidy, recovery, readers, snapshots -> layout (names), CommitLog, Metadata -> Disk -> the file system
//! ```
//!
//! Every file operation of a map, syncs included, goes through [`Disk`], so that a failing disk and a crash are
//! ordinary tests. The protocol of a flush and what a crash leaves are in
//! `docs/durability.md`.

mod checkpoint;
mod commit_log;
mod commit_record;
mod committer;
mod disk;
mod flush;
mod fs_disk;
mod input_record;
mod kept_tables;
mod layout;
mod map_files;
mod map_folder;
mod metadata;
mod place;
mod quarantine;
mod readers;
mod recovery;
mod remains;
mod snapshot_file;
mod snapshot_list;
mod snapshot_name;
mod snapshot_store;
mod snapshots;
mod spill_file;
mod tile_location;
mod tile_stamp;
mod tile_store;
mod tile_versions;
mod tile_writer;
mod unfinished;

pub use crate::scratch::Scratch;
pub use commit_log::{CommitLog, Commits};
pub use commit_record::Flush;
pub use disk::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch};
pub use fs_disk::FsDisk;
pub(crate) use input_record::MOST_INPUTS;
pub use input_record::{InputContent, InputRecord};
pub use layout::{Layout, QUARANTINE, SNAPSHOT_NEXT, SNAPSHOTS, TileFile, folder_name, tile_of_folder};
pub use map_folder::{Lock, read_log};
pub use metadata::{Bounds, Extension, MapParameters, Metadata};
pub use place::check_outside_of_maps;
pub use quarantine::Quarantine;
pub use remains::Remains;
pub use snapshot_file::Snapshot;
pub use snapshot_list::SnapshotList;
pub use snapshot_name::SnapshotName;
pub use spill_file::SpillFile;
pub use tile_location::{StoredTile, TileLocation};
pub(crate) use tile_stamp::MAX_NUMBER;
pub use tile_stamp::{FileStamp, Stamping, TileStamp};
pub use tile_store::TileStore;
pub(crate) use tile_store::{hex, id_from_hex};
pub use tile_writer::TileWriter;
pub use unfinished::{UnfinishedMap, unfinished_folder};
