//! Tests of the mapper's threads under a scheduler that chooses the next thread at every lock, channel and wait. The
//! tests cover the thread that writes octrees with its queue and its trees, the threads that save and load tiles, and
//! the tiles of a map in little memory, on a disk in memory.
//!
//! ```text
//! cargo test -p interleavings                            800 schedules of each test
//! INTERLEAVINGS=1000000 cargo test --release -p interleavings
//! ```
//!
//! Safe Rust has no data races. The tests look for deadlocks, lost wake-ups, work that is lost or done twice, and
//! answers that miss an update. Half of the schedules are random, half change the thread at few random points (PCT),
//! which finds bugs that need few changes with a known probability. A failure prints its schedule, for
//! `shuttle::replay`.
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
    pub(crate) use voxtile::{DecodeError, Error, FormatError, Result};
}

mod octree {
    pub(crate) use voxtile::octree::Octree;
}

mod scan {
    pub(crate) use voxtile::scan::{
        MovingMarks, PackedUpdates, PointBlocks, PointFrame, ScanPoints, ScanUpdates, TileUpdates,
    };
}

mod sensor {
    pub(crate) use voxtile::sensor::{Evidence, SensorModel};
}

mod space {
    pub(crate) use voxtile::space::{
        Grid, MortonCode, Point, TileBox, TileIndex, TileSpace, TileTable, TileValue, VoxelIndex,
        hash_table_bytes, put_number, take_number,
    };
}

mod store {
    pub(crate) use voxtile::store::*;

    pub(crate) const MAX_INPUTS: usize = 1000;

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

mod persistence {
    mod compact_tile {
        source!("compact_tile.rs");
    }
    mod io_threads {
        source!("io_threads.rs");
    }
    pub(crate) mod load {
        source!("load.rs");
    }
    mod map_id {
        source!("map_id.rs");
    }
    mod packer {
        source!("packer.rs");
    }
    mod parameters {
        source!("parameters.rs");
    }
    /// Priorities are left out: the scheduler has its own threads, and must try all schedules.
    mod priority {
        pub(super) fn lower_priority() {}
    }
    mod tile_saver {
        source!("tile_saver.rs");
    }
    mod upgrade {
        source!("upgrade.rs");
    }
    mod worker {
        source!("worker.rs");
    }
    #[cfg(test)]
    mod tests;

    pub(crate) use compact_tile::CompactTile;
    pub(crate) use io_threads::{IoThreads, Loaded, Saved};
    pub(crate) use map_id::new_map_id;
    pub(crate) use packer::Packer;
    pub(crate) use parameters::{config_from, new_metadata};
    pub(crate) use tile_saver::TileSaver;
    pub(crate) use upgrade::upgrade;
    pub(crate) use worker::Worker;
}

mod mapper {
    mod statistics {
        source!("statistics.rs");
    }
    mod paging {
        mod buffered_updates {
            source!("buffered_updates.rs");
        }
        mod compact_tiles {
            source!("compact_tiles.rs");
        }
        mod contents {
            source!("contents.rs");
        }
        mod eviction {
            source!("eviction.rs");
        }
        mod pinned_tiles {
            source!("pinned_tiles.rs");
        }
        mod flush {
            source!("flush.rs");
        }
        mod flusher {
            source!("flusher.rs");
        }
        mod pinned_tile {
            source!("pinned_tile.rs");
        }
        mod memory_plan;
        mod paged_tiles {
            source!("paged_tiles.rs");
        }
        mod shared_contents;
        mod shared_disk;
        mod tile_state {
            source!("tile_state.rs");
        }
        mod unapplied_tile {
            source!("unapplied_tile.rs");
        }
        mod views {
            source!("views.rs");
        }
        mod prefetch {
            source!("prefetch.rs");
        }
        mod resident_tiles {
            source!("resident_tiles.rs");
        }
        mod stalls {
            source!("stalls.rs");
        }
        mod tile_cache {
            source!("tile_cache.rs");
        }
        mod tile_disk {
            source!("tile_disk.rs");
        }
        mod tile_pager {
            source!("tile_pager.rs");
        }
        mod tile_threads;
        mod write_buffer {
            source!("write_buffer.rs");
        }
        #[cfg(test)]
        mod memory_disk;
        #[cfg(test)]
        mod scenarios;
    }
}

#[cfg(test)]
use shuttle::scheduler::{PctScheduler, RandomScheduler};

/// Runs a test in many schedules.
#[cfg(test)]
fn in_many_orders(test: impl Fn() + Send + Sync + Copy + 'static) {
    let orders = std::env::var("INTERLEAVINGS").ok().and_then(|text| text.parse().ok()).unwrap_or(800);
    let mut config = shuttle::Config::new();
    // Writing a file needs a deeper stack than taking a lock.
    config.stack_size = 1 << 20;
    let test = move || {
        // The scheduler fails if its first run has no two concurrent threads. A random run of a test may have only one,
        // so start another.
        let other = shuttle::thread::spawn(shuttle::thread::yield_now);
        test();
        other.join().expect("it does nothing");
    };
    let (random, few_changes) = (RandomScheduler::new(orders / 2), PctScheduler::new(3, orders / 2));
    shuttle::Runner::new(random, config.clone()).run(test);
    shuttle::Runner::new(few_changes, config).run(test);
}
