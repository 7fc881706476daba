use indicatif::{HumanBytes, HumanCount};
use std::io::Write;
use std::path::Path;
use voxtile::mapper::MapReader;
use voxtile::operations::WrittenMap;

/// Warns about maps that keep scans, and returns the warnings: a new map made from their tiles has no scans.
pub fn warn_of_scans_left<'a>(maps: impl IntoIterator<Item = &'a MapReader>) -> Vec<String> {
    let keep_scans = maps.into_iter().filter(|map| map.keeps_scans());
    let warning = |map: &MapReader| {
        let warning = format!(
            "{} keeps its scans, but they are not copied: `remap` and `remove-scans` do not work on the new map",
            map.folder().display()
        );
        log::warn!("{warning}");
        warning
    };
    keep_scans.map(warning).collect()
}

/// Prints the summary of a new map.
pub fn print_written(map: &Path, written: &WrittenMap, out: &mut impl Write) -> std::io::Result<()> {
    let WrittenMap { tiles, voxels, occupied, table_bytes, octree_bytes, .. } = *written;
    writeln!(out, "map       {}", map.display())?;
    writeln!(out, "voxels    {}, {} occupied", HumanCount(voxels), HumanCount(occupied))?;
    writeln!(out, "tiles     {}, {} on disk", HumanCount(tiles), HumanBytes(table_bytes + octree_bytes))
}
