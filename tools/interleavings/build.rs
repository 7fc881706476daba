//! Takes the sources that have threads as they are, with the scheduler's locks, channels and threads for those of the
//! standard library.

use std::path::Path;
use std::{env, fs};

const SOURCES: [&str; 20] = [
    "tile/octocache/octree_statistics.rs",
    "tile/octocache/octree_worker.rs",
    "tile/octocache/shared_tree.rs",
    "tile/octocache/work_queue.rs",
    "mapper/adoption.rs",
    "mapper/cold_tiles.rs",
    "mapper/flush.rs",
    "mapper/look_ahead.rs",
    "mapper/map_id.rs",
    "mapper/pending.rs",
    "mapper/residency.rs",
    "mapper/resident_tiles.rs",
    "mapper/room.rs",
    "mapper/side_worker.rs",
    "mapper/stalls.rs",
    "mapper/statistics.rs",
    "mapper/tile_files.rs",
    "mapper/tile_saver.rs",
    "mapper/tile_traffic.rs",
    "mapper/waiting.rs",
];

fn main() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src");
    let out = env::var_os("OUT_DIR").expect("cargo names a folder");
    for source in SOURCES {
        let path = sources.join(source);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        // What is included cannot begin with a module's own documentation.
        let code: String =
            code.lines().filter(|line| !line.starts_with("//!")).flat_map(|line| [line, "\n"]).collect();
        let code = code.replace("std::sync", "shuttle::sync").replace("std::thread", "shuttle::thread");
        let name = path.file_name().expect("a source has a name");
        fs::write(Path::new(&out).join(name), code).expect("the folder can be written to");
    }
}
