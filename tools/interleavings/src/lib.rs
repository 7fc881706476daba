//! The threads of the mapper under a scheduler that chooses who goes on at every lock, channel and wait: the thread that
//! writes octrees with its queue and its trees, and the threads that carry tiles to disk and back.
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

mod octree {
    pub(crate) use voxtile::octree::Octree;
}

mod space {
    pub(crate) use voxtile::space::MortonCode;
}

mod tile {
    use voxtile::tile::VoxelCacheCounts;

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

mod mapper {
    mod side_worker {
        source!("side_worker.rs");
    }
    #[cfg(test)]
    mod tests;
}

/// Runs a life of threads in many orders.
#[cfg(test)]
fn in_many_orders(life: impl Fn() + Send + Sync + Copy + 'static) {
    let orders = std::env::var("INTERLEAVINGS").ok().and_then(|text| text.parse().ok()).unwrap_or(2000);
    shuttle::check_random(life, orders / 2);
    shuttle::check_pct(life, orders / 2, 3);
}
