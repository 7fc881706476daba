//! Reads OctoMap files and writes them again; `tools/octomap_oracle` compares the result with OctoMap's own.
//!
//! `octree_files INPUT OUTPUT` with INPUT `.bt` or `.ot` and OUTPUT ending in `.bt` or `.ot`, in pairs.

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use voxtile::octree;

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    for pair in paths.chunks(2) {
        let [from, to] = pair else { return Err("paths come in pairs: INPUT OUTPUT".into()) };
        let file = octree::read(BufReader::new(File::open(from)?))?;
        let mut out = BufWriter::new(File::create(to)?);
        if to.ends_with(".bt") {
            octree::write_bt(&file.tree, file.resolution_m, 0.0, &mut out)?;
        } else {
            octree::write_ot(&file.tree, file.resolution_m, &mut out)?;
        }
        out.flush()?;
    }
    Ok(())
}
