use crate::args::DiffArgs;
use crate::json;
use voxtile_pipeline::{MapAt, read_maps};

use crate::progress::Progress;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile::mapper::{MapReader, MapView};
use voxtile::operations::{Diff, TileDiff, VoxelDiff, diff};
use voxtile::store::SnapshotName;
use voxtile_pipeline::memory;

#[derive(Serialize)]
struct Report {
    from: Side,
    to: Side,
    #[serde(flatten)]
    diff: Diff,
    tiles: Vec<TileDiff>,
    peak_rss_bytes: Option<u64>,
}

/// One side of the comparison.
#[derive(Serialize)]
struct Side {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: PathBuf,
    snapshot: Option<String>,
    flush_number: u64,
    scan_number: u64,
}

pub fn run(args: &DiffArgs) -> anyhow::Result<ExitCode> {
    let [from, to] = sides(&args.sides)?;
    let progress = Progress::over_tiles(0);
    let mut report = read_maps(&from, &to, |from, to| {
        let mut tiles = Vec::new();
        let found = |tile| {
            if args.json {
                tiles.push(tile);
            }
        };
        let diff = diff(from, to, found, |done, all| progress.set(done, all))?;
        Ok(Report { from: Side::of(from), to: Side::of(to), diff, tiles, peak_rss_bytes: None })
    })?;
    drop(progress);
    report.peak_rss_bytes = memory::peak_bytes();
    let mut out = std::io::stdout().lock();
    if args.json {
        json::print(&report, &mut out)?;
    } else {
        report.print(&mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn sides(sides: &[PathBuf]) -> voxtile::Result<[MapAt; 2]> {
    let side = |map: &Path, name: &Path| -> voxtile::Result<MapAt> {
        let name = name.to_string_lossy();
        let snapshot = if name == "now" { None } else { Some(SnapshotName::new(name)?) };
        Ok(MapAt { map: map.to_owned(), snapshot })
    };
    match sides {
        [map, from, to] => Ok([side(map, from)?, side(map, to)?]),
        [from, to] => Ok([MapAt::of(from)?, MapAt::of(to)?]),
        _ => Err(voxtile::Error::argument("MAP", "give two maps, or a map and two of its snapshots")),
    }
}

impl Side {
    fn of(reader: &MapReader) -> Self {
        Self {
            map: reader.folder().to_owned(),
            snapshot: reader.snapshot().map(ToString::to_string),
            flush_number: reader.flush_number(),
            scan_number: reader.scan_number(),
        }
    }

    fn name(&self) -> String {
        let snapshot = self.snapshot.as_ref().map_or(String::new(), |name| format!("@{name}"));
        format!("{}{snapshot}, scan {}", self.map.display(), self.scan_number)
    }
}

impl Report {
    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let Diff { tiles_appeared, tiles_gone, tiles_changed, tiles_equal, voxels, .. } = self.diff;
        let VoxelDiff { appeared, gone, to_occupied, to_free, changed, layers, .. } = voxels;
        writeln!(out, "from      {}", self.from.name())?;
        writeln!(out, "to        {}", self.to.name())?;
        writeln!(
            out,
            "tiles     {} appeared, {} removed, {} changed, {} equal",
            HumanCount(tiles_appeared),
            HumanCount(tiles_gone),
            HumanCount(tiles_changed),
            HumanCount(tiles_equal)
        )?;
        writeln!(out, "voxels    {} appeared, {} removed", HumanCount(appeared), HumanCount(gone))?;
        writeln!(
            out,
            "flipped   {} from free to occupied, {} from occupied to free",
            HumanCount(to_occupied),
            HumanCount(to_free)
        )?;
        writeln!(out, "changed   {} in value only", HumanCount(changed))?;
        if layers > 0 {
            writeln!(out, "layers    {} with other sums", HumanCount(layers))?;
        }
        Ok(())
    }
}
