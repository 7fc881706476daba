//! Keeps an out-of-core map within its memory limit. [`TilePager`] coordinates three owners of private state.
//!
//! ```text
//! TilePager     accepts scans, provides tiles, flushes
//!   TileCache     resident tiles (an LRU) and, below them, tiles in the compact form; the memory limit
//!   WriteBuffer   updates of tiles that are not resident: in memory, or spilled to files if memory is short
//!   TileDisk      the store, the threads that save and load, I/O counts, waiting times of the mapper
//! ```
//!
//! A tile is resident, compact, or neither. A resident tile has no buffered updates: they are applied when it is
//! loaded. `eviction` moves tiles towards the disk, `prefetch` loads tiles ahead of use, `flush` commits. A `Flusher`
//! flushes in the background: it shares the tiles as of a scan with the cache, and a `PinnedTiles` counts the tiles
//! that only the flush holds.

mod buffered_updates;
mod compact_tiles;
mod contents;
mod eviction;
mod flush;
mod flusher;
mod memory_plan;
mod paged_tiles;
mod pinned_tile;
mod pinned_tiles;
mod prefetch;
mod resident_tiles;
mod shared_contents;
mod shared_disk;
mod stalls;
mod tile_cache;
mod tile_disk;
mod tile_pager;
mod tile_state;
mod tile_threads;
mod unapplied_tile;
mod views;
mod write_buffer;

pub(super) use memory_plan::MemoryPlan;
pub(super) use paged_tiles::PagedTiles;
pub(super) use shared_contents::SharedContents;
pub(super) use tile_pager::TilePager;
pub(super) use tile_state::{Base, StoredTileState, TileState};
pub(super) use views::ViewId;
