//! Updates of a scan or batch, grouped by tile: brick masks, runs or lists, and a packed form for storage.

mod layer_hits;
mod mapped_tiles;
mod packed_updates;
mod tile_order;
mod tile_runs;
mod tile_updates;

pub use layer_hits::{LayerHit, LayerHits, OFFSETS_PER_VOXEL};
pub(crate) use mapped_tiles::MappedTiles;
pub use packed_updates::PackedUpdates;
pub(crate) use tile_order::{
    brick_code, brick_index, bricks_by_tile, in_order_of_tiles, mean_tiles_of_brick, part_in_tile,
};
pub use tile_runs::{BrickRuns, Misses, Run, TileRuns};
pub use tile_updates::{BrickUpdate, OrderedUpdates, ScanUpdates, TileUpdates};
