use crate::args::ImportArgs;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile::Error;
use voxtile::mapper::{MapView, OctreeMap};
use voxtile::operations::{WrittenMap, import};
use voxtile_pipeline::memory;
use voxtile_pipeline::octree_file;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Imported<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    file: &'a Path,
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    resolution_m: f64,
    tile_size_m: f64,
    /// Number of voxels at full resolution after expansion of the leaves.
    expanded_voxels: u64,
    #[serde(flatten)]
    written: WrittenMap,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &ImportArgs) -> anyhow::Result<ExitCode> {
    let output = whole_map(&args.output)?;
    let map = OctreeMap::of(octree_file::read(&args.file)?)?;
    let expanded_voxels = map.tree().expanded_leaf_count();
    let most = args.max_voxels;
    if expanded_voxels > most {
        let reason = format!(
            "expands to {expanded_voxels} voxels, more than --max-voxels {most}; each takes about 4 bytes of disk \
             or less in compact storage, 18 in octomap storage"
        );
        return Err(Error::argument(args.file.display().to_string(), reason).into());
    }
    let progress = Progress::over_tiles(0);
    let written = import(&map, output, args.storage.into(), |done, all| progress.set(done, all))?;
    drop(progress);
    let grid = map.config().grid;
    let imported = Imported {
        file: &args.file,
        map: output,
        resolution_m: grid.resolution_m(),
        tile_size_m: grid.tile_size_m(),
        expanded_voxels,
        written,
        peak_rss_bytes: memory::peak_bytes(),
    };
    let mut out = summary_out(args.json);
    if args.json {
        json::print(&imported, &mut out)?;
    } else {
        imported.print(&mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Imported<'_> {
    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let WrittenMap { tiles, voxels, occupied, table_bytes, octree_bytes, .. } = self.written;
        writeln!(out, "map       {}", self.map.display())?;
        writeln!(out, "grid      voxels of {} m in tiles of {} m", self.resolution_m, self.tile_size_m)?;
        writeln!(out, "voxels    {}, {} occupied", HumanCount(voxels), HumanCount(occupied))?;
        writeln!(out, "tiles     {}, {} on disk", HumanCount(tiles), HumanBytes(table_bytes + octree_bytes))
    }
}
