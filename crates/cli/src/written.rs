use indicatif::{HumanBytes, HumanCount};
use std::io::Write;
use std::path::Path;
use voxtile::mapper::MapReader;
use voxtile::operations::WrittenMap;

/// Warns, and returns the warnings, of maps that keep scans: a new map that is made of their tiles gets none.
pub fn warn_of_scans_left<'a>(maps: impl IntoIterator<Item = &'a MapReader>) -> Vec<String> {
    let keep_scans = maps.into_iter().filter(|map| map.keeps_scans());
    let warning = |map: &MapReader| {
        let warning = format!(
            "{} keeps its scans, and the new map gets none of them: it cannot be remapped, and no scan removed from it",
            map.folder().display()
        );
        log::warn!("{warning}");
        warning
    };
    keep_scans.map(warning).collect()
}

/// Says for a person what a new map is.
pub fn print_written(map: &Path, written: &WrittenMap, out: &mut impl Write) -> std::io::Result<()> {
    let WrittenMap { tiles, voxels, occupied, table_bytes, octree_bytes, .. } = *written;
    writeln!(out, "map       {}", map.display())?;
    writeln!(out, "voxels    {}, {} occupied", HumanCount(voxels), HumanCount(occupied))?;
    writeln!(out, "tiles     {}, {} on disk", HumanCount(tiles), HumanBytes(table_bytes + octree_bytes))
}
