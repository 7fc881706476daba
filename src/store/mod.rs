//! Files of a map: tiles, commit log, metadata, snapshots. This module does not know about voxels.
//!
//! | module | content |
//! |---|---|
//! | `tile_store` | [`TileStore`]: opens maps; `commit/flush` commits |
//! | `tiles` | [`TileVersions`]: list of tiles; [`Tables`]: reads tables; writers and spill files |
//! | `commit` | the commit log, `metadata.json`, the steps after a commit |
//! | `scans` | number, time and origin of each scan; [`ScanArchive`]: kept scans |
//! | `snapshots` | snapshots; replaced tables that snapshots and readers still use |
//! | `recovery` | crash recovery, damaged logs, quarantine, unfinished maps |
//! | `committed_files` | files to copy for a copy of the map |
//! | `layout`, `map_files` | file names; operations on them |
//! | `disk`, `fs_disk` | [`Disk`]: interface to the file system, and its implementation |
//! | `unsynced_disk` | a disk without syncs, for temporary maps |
//!
//! Tests replace [`Disk`] to simulate failures and power cuts. `docs/durability.md` describes the protocol.

mod commit;
mod committed_files;
mod disk;
mod fs_disk;
mod layout;
mod map_files;
mod map_folder;
mod map_path;
mod path_check;
mod recovery;
mod scans;
mod snapshots;
mod tile_store;
mod tiles;
mod unsynced_disk;
mod writer_lock;

pub use crate::scratch::Scratch;
pub use commit::commit_log::CommitLog;
pub use commit::commit_record::Flush;
pub use commit::commits::Commits;
pub use commit::flush::{BegunCommit, Step, Synced, Unsynced};
pub(crate) use commit::input_record::MAX_INPUTS;
pub use commit::input_record::{InputContent, InputRecord};
pub use commit::linked_tiles::LinkedTiles;
pub use commit::metadata::{Bounds, Extension, MapParameters, Metadata};
pub use committed_files::{CommittedContent, CommittedFile, FileVersion};
pub use disk::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch};
pub use fs_disk::FsDisk;
pub use layout::{
    KEPT_SCANS, Layout, QUARANTINE, SNAPSHOT_NEXT, SNAPSHOTS, TileFile, folder_name, tile_of_folder,
};
pub use map_folder::read_log;
pub use map_path::MapPath;
pub use path_check::check_outside_of_maps;
pub use recovery::moved_map::move_map;
pub use recovery::quarantine::Quarantine;
pub use recovery::salvage::Salvage;
pub use recovery::side_folder::SideFolder;
pub use recovery::staged_map::{StagedMap, staging_folder};
pub use scans::{
    CatalogEntry, CatalogVersion, KeptFrame, KeptMarks, KeptRecord, ScanArchive, ScanRecord, SegmentPlace,
};
pub(crate) use scans::{
    KeptAsOf, KeptRecords, MAX_BLOCK_BYTES, Salvaged, SegmentReader, catalog_generations, check_scans,
    check_segment, kept_as_of, read_scans, salvage_entries, whole_fronts,
};
pub use snapshots::snapshot_file::Snapshot;
pub use snapshots::snapshot_list::SnapshotList;
pub use snapshots::snapshot_name::SnapshotName;
pub use snapshots::snapshot_writer::SnapshotWriter;
pub use snapshots::snapshots_of_map::Snapshots;
pub use tile_store::TileStore;
pub use tile_store::hex;
pub(crate) use tile_store::id_from_hex;
pub use tiles::file_checksum::{Checksumming, FileChecksum};
pub use tiles::spill_file::{SpillFile, SpillFiles};
pub use tiles::tables::Tables;
pub use tiles::tile_location::{StoredTile, TileLocation};
pub use tiles::tile_reader::TileReader;
pub(crate) use tiles::tile_version::MAX_NUMBER;
pub use tiles::tile_version::TileVersion;
pub use tiles::tile_versions::TileVersions;
pub use tiles::tile_writer::TileWriter;
pub use unsynced_disk::UnsyncedDisk;
pub use writer_lock::WriterLock;
