//! Named bytes on disk; knows no voxel.
//!
//! ```text
//! TileStore -> layout (names), CommitLog, Metadata, recovery -> Disk -> the file system
//! ```
//!
//! Every file operation of a map, syncs included, goes through [`Disk`], so that a failing disk and a crash are
//! ordinary tests. The protocol of a flush and what a crash leaves are in `docs/format.md`.

mod commit_log;
mod disk;
mod layout;
mod metadata;
mod recovery;
mod tile_stamp;
mod tile_store;

pub use commit_log::{CommitLog, Commits};
pub use disk::{Disk, DiskRead, DiskWrite, EntryKind, FsDisk};
pub use layout::{Layout, TileFile, folder_name, tile_of_folder};
pub use metadata::{Bounds, Extension, Metadata};
pub use tile_stamp::{FileStamp, Stamping, TileStamp};
pub(crate) use tile_store::hex;
pub use tile_store::{StoredTile, TileStore};
