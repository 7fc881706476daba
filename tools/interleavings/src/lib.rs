//! The threads of the mapper under a scheduler that chooses who goes on at every lock, channel and wait: the thread that
//! writes octrees with its queue and its trees, the threads that carry tiles to disk and back, and what they are carried for:
//! the tiles of a map in little memory, on a disk in memory.
//!
//! ```text
//! cargo test -p interleavings                            2,000 orders of each test
//! INTERLEAVINGS=1000000 cargo test --release -p interleavings
//! ```
//!
//! Without `unsafe` there are no data races to look for; what can go wrong is a deadlock, a wake-up that is lost, work that
//! is lost or done twice, an answer that misses what was there. Half of the orders are random, half change few times at
//! places chosen at random (PCT), which finds what needs few changes with a known probability. A failure prints its order,
//! for `shuttle::replay`.
#![allow(dead_code, unused_imports)]

macro_rules! source {
    ($name:literal) => {
        include!(concat!(env!("OUT_DIR"), "/", $name));
    };
}

mod config {
    pub(crate) use voxtile::{MapConfig, MemoryLimit, Storage};
}

mod error {
    pub(crate) use voxtile::{Error, FormatError, Result};
}

mod octree {
    pub(crate) use voxtile::octree::Octree;
}

mod scan {
    pub(crate) use voxtile::scan::{PackedUpdates, ScanUpdates, TileUpdates};
}

mod sensor {
    pub(crate) use voxtile::sensor::Evidence;
}

mod space {
    pub(crate) use voxtile::space::{
        Grid, MortonCode, TileIndex, TileTable, TileValue, VoxelIndex, put_number, take_number,
    };
}

mod store {
    pub(crate) use voxtile::store::*;

    pub(crate) const MOST_INPUTS: usize = 1000;

    pub(crate) fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

mod tile {
    use voxtile::tile::VoxelCacheCounts;
    pub(crate) use voxtile::tile::{OctreeFactory, OctreeStatistics, Table, Tile, TileCounts, format};

    mod octocache {
        mod octree_statistics {
            source!("octree_statistics.rs");
        }
        mod octree_worker {
            source!("octree_worker.rs");
        }
        mod shared_tree {
            source!("shared_tree.rs");
        }
        mod work_queue {
            source!("work_queue.rs");
        }
        #[cfg(test)]
        mod tests;
    }
}

mod mapper {
    mod adoption {
        source!("adoption.rs");
    }
    mod cold_tiles {
        source!("cold_tiles.rs");
    }
    mod memory_plan;

    mod flush {
        source!("flush.rs");
    }
    mod look_ahead {
        source!("look_ahead.rs");
    }
    mod map_id {
        source!("map_id.rs");
    }
    mod pending {
        source!("pending.rs");
    }
    mod residency {
        source!("residency.rs");
    }
    mod resident_tiles {
        source!("resident_tiles.rs");
    }
    mod room {
        source!("room.rs");
    }
    mod side_worker {
        source!("side_worker.rs");
    }
    mod stalls {
        source!("stalls.rs");
    }
    mod statistics {
        source!("statistics.rs");
    }
    mod tile_files {
        source!("tile_files.rs");
    }
    mod tile_saver {
        source!("tile_saver.rs");
    }
    mod tile_traffic {
        source!("tile_traffic.rs");
    }
    mod waiting {
        source!("waiting.rs");
    }
    #[cfg(test)]
    mod lives;
    #[cfg(test)]
    mod memory_disk;
    #[cfg(test)]
    mod tests;
}

#[cfg(test)]
use shuttle::scheduler::{PctScheduler, RandomScheduler};

/// Runs a life of threads in many orders.
#[cfg(test)]
fn in_many_orders(life: impl Fn() + Send + Sync + Copy + 'static) {
    let orders = std::env::var("INTERLEAVINGS").ok().and_then(|text| text.parse().ok()).unwrap_or(2000);
    let mut config = shuttle::Config::new();
    // A file is written by deeper calls than a lock is taken.
    config.stack_size = 1 << 20;
    let (random, few_changes) = (RandomScheduler::new(orders / 2), PctScheduler::new(3, orders / 2));
    shuttle::Runner::new(random, config.clone()).run(life);
    shuttle::Runner::new(few_changes, config).run(life);
}
