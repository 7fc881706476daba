//! How an out-of-core map lives in little memory. Three owners, each with private state, and one that leads them.
//!
//! ```text
//! TilePager     accepts scans, answers for tiles, flushes
//!   TileCache     resident tiles (an LRU) and, below them, tiles in the compact form; the memory limit
//!   WriteBuffer   updates of tiles that are not resident: in memory, and spilled to files where memory is short
//!   TileDisk      the store, the threads that save and load, what was read and written, how long the mapper waited
//! ```
//!
//! A tile is in at most one tier of the cache. Resident tiles have no buffered updates: these are applied when the tile comes
//! in. `eviction` moves tiles down, `prefetch` fetches tiles before they are needed, `flush` makes the map durable.

mod buffered_updates;
mod compact_tiles;
mod eviction;
mod flush;
mod memory_plan;
mod prefetch;
mod resident_tiles;
mod stalls;
mod tile_cache;
mod tile_disk;
mod tile_pager;
mod write_buffer;

pub(super) use memory_plan::MemoryPlan;
pub(super) use tile_pager::TilePager;
