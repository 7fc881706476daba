//! Copies the sources that use threads, with the scheduler's locks, channels and threads in place of those of the
//! standard library.

use std::path::Path;
use std::{env, fs};

const SOURCES: [&str; 33] = [
    "tile/octocache/octree_statistics.rs",
    "tile/octocache/octree_worker.rs",
    "tile/octocache/shared_tree.rs",
    "tile/octocache/work_queue.rs",
    "mapper/statistics.rs",
    "mapper/paging/buffered_updates.rs",
    "mapper/paging/compact_tiles.rs",
    "mapper/paging/contents.rs",
    "mapper/paging/eviction.rs",
    "mapper/paging/pinned_tiles.rs",
    "mapper/paging/flush.rs",
    "mapper/paging/flusher.rs",
    "mapper/paging/pinned_tile.rs",
    "mapper/paging/paged_tiles.rs",
    "mapper/paging/prefetch.rs",
    "mapper/paging/resident_tiles.rs",
    "mapper/paging/stalls.rs",
    "mapper/paging/tile_cache.rs",
    "mapper/paging/tile_disk.rs",
    "mapper/paging/tile_pager.rs",
    "mapper/paging/tile_state.rs",
    "mapper/paging/unapplied_tile.rs",
    "mapper/paging/views.rs",
    "mapper/paging/write_buffer.rs",
    "persistence/compact_tile.rs",
    "persistence/io_threads.rs",
    "persistence/load.rs",
    "persistence/map_id.rs",
    "persistence/packer.rs",
    "persistence/parameters.rs",
    "persistence/tile_saver.rs",
    "persistence/upgrade.rs",
    "persistence/worker.rs",
];

fn main() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src");
    let out = env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
    for source in SOURCES {
        let path = sources.join(source);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        // An included file cannot begin with module documentation.
        let code: String =
            code.lines().filter(|line| !line.starts_with("//!")).flat_map(|line| [line, "\n"]).collect();
        let code = code.replace("std::sync", "shuttle::sync").replace("std::thread", "shuttle::thread");
        let name = path.file_name().expect("a source has a name");
        fs::write(Path::new(&out).join(name), code).expect("OUT_DIR is writable");
    }
}
