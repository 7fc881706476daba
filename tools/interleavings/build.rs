//! Takes the sources that have threads as they are, with the scheduler's locks, channels and threads for those of the
//! standard library.

use std::path::Path;
use std::{env, fs};

const SOURCES: [&str; 5] = [
    "tile/octree_statistics.rs",
    "tile/octree_worker.rs",
    "tile/shared_tree.rs",
    "tile/work_queue.rs",
    "mapper/side_worker.rs",
];

fn main() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src");
    let out = env::var_os("OUT_DIR").expect("cargo names a folder");
    for source in SOURCES {
        let path = sources.join(source);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let code = code.replace("std::sync", "shuttle::sync").replace("std::thread", "shuttle::thread");
        let name = path.file_name().expect("a source has a name");
        fs::write(Path::new(&out).join(name), code).expect("the folder can be written to");
    }
}
