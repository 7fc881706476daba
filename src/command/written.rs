use crate::operations::WrittenMap;
use indicatif::{HumanBytes, HumanCount};
use std::io::Write;
use std::path::Path;

/// Says for a person what a new map is.
pub fn print_written(map: &Path, written: &WrittenMap, out: &mut impl Write) -> std::io::Result<()> {
    let WrittenMap { tiles, voxels, occupied, table_bytes, octree_bytes, .. } = *written;
    writeln!(out, "map       {}", map.display())?;
    writeln!(out, "voxels    {}, {} occupied", HumanCount(voxels), HumanCount(occupied))?;
    writeln!(out, "tiles     {}, {} on disk", HumanCount(tiles), HumanBytes(table_bytes + octree_bytes))
}
