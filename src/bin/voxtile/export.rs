use crate::args::ExportArgs;
use crate::map_at::read_map;
use crate::memory;
use crate::octree_file;
use crate::part::region_of;
use crate::progress::Progress;
use indicatif::HumanCount;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile::io::{VoxelFormat, VoxelRecord, VoxelWriter};
use voxtile::mapper::{MapReader, MapView};
use voxtile::maths::logit;
use voxtile::octree::{Octree, OctreeFormat, write_bt, write_ot};
use voxtile::query::OctreeExport;
use voxtile::space::Aabb;
use voxtile::{Error, Questions};

#[derive(Clone, Copy)]
enum ExportFormat {
    Voxels(VoxelFormat),
    Octree(OctreeFormat),
}

pub fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let region = args.region.as_deref().map(region_of).transpose()?;
    if args.min_probability.is_some_and(|probability| !(0.0..=1.0).contains(&probability)) {
        return Err(Error::argument("--min-probability", "must be from 0 to 1").into());
    }
    let extension = args.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let format = match (extension, VoxelFormat::of_path(&args.output)) {
        (_, Some(format)) => ExportFormat::Voxels(format),
        ("bt" | "ot", None) if args.min_probability.is_some() => {
            let reason = "an octree file holds free and occupied voxels alike; leave the option out";
            return Err(Error::argument("--min-probability", reason).into());
        }
        ("bt", None) => ExportFormat::Octree(OctreeFormat::Bt),
        ("ot", None) => ExportFormat::Octree(OctreeFormat::Ot),
        _ => {
            let reason =
                format!("{}: the extension must be .ply, .pcd, .csv, .bt or .ot", args.output.display());
            return Err(Error::argument("--output", reason).into());
        }
    };
    let region = region.as_ref();
    let count = match format {
        _ if octree_file::is_octree_file(&args.map) => export_octree_file(args, format, region)?,
        ExportFormat::Voxels(format) => {
            read_map(&args.map, |reader| export_voxels(args, format, region, reader))?
        }
        ExportFormat::Octree(format) => {
            read_map(&args.map, |reader| export_octree(args, format, region, reader))?
        }
    };
    let mut out = io::stdout().lock();
    if args.json {
        let peak = memory::peak_bytes();
        let summary = serde_json::json!({ "file": args.output, "voxels": count, "peak_rss_bytes": peak });
        writeln!(out, "{summary}")?;
    } else {
        writeln!(out, "{} voxels in {}", HumanCount(count), args.output.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn export_voxels(
    args: &ExportArgs,
    format: VoxelFormat,
    region: Option<&Aabb>,
    reader: &MapReader,
) -> anyhow::Result<u64> {
    let grid = reader.config().grid;
    let count = count_voxels(args, region, reader)?;
    write_whole(&args.output, |out| {
        let progress = Progress::over_tiles(reader.tile_indices().len());
        let mut writer = VoxelWriter::new(format, count, grid.resolution_m(), out)?;
        let mut written = Ok(());
        let mut tile = None;
        reader.for_each_occupied(args.min_probability, region, |voxel| {
            let index = Some(grid.tile_of_voxel(voxel.index));
            if tile != index {
                tile = index;
                progress.step();
            }
            if written.is_ok() {
                written = writer.write(&VoxelRecord {
                    center_m: grid.center_m(voxel.index),
                    probability: voxel.evidence.probability(),
                    log_odds: voxel.evidence.log_odds,
                    observation_count: voxel.evidence.observation_count,
                });
            }
        })?;
        written?;
        writer.finish()?;
        Ok(count)
    })
}

/// How many voxels there are to export: the headers name it before the first. In constant memory, and without reading
/// a tile where the log of the map knows.
fn count_voxels(args: &ExportArgs, region: Option<&Aabb>, reader: &MapReader) -> voxtile::Result<u64> {
    match (reader.voxel_counts(), args.min_probability, region) {
        (Some((_, occupied)), None, None) => return Ok(occupied),
        (Some((voxels, _)), Some(0.0), None) => return Ok(voxels),
        _ => {}
    }
    let mut count = 0;
    reader.for_each_occupied(args.min_probability, region, |_| count += 1)?;
    Ok(count)
}

/// Writes an octree file of any size. Its parts lie in a file beside it until all of them are known.
fn export_octree(
    args: &ExportArgs,
    format: OctreeFormat,
    region: Option<&Aabb>,
    reader: &MapReader,
) -> anyhow::Result<u64> {
    let path = args.output.with_added_extension("spool");
    let spool = File::options().read(true).write(true).create(true).truncate(true).open(&path);
    let mut spool = spool.map_err(|error| Error::io(&path, "create", error))?;
    let export = OctreeExport { format, region, memory_bytes: args.memory.bytes() };
    let outcome = write_whole(&args.output, |mut out| reader.write_octree(&export, &mut spool, &mut out));
    fs::remove_file(&path).ok();
    outcome
}

fn write_octree(
    args: &ExportArgs,
    format: OctreeFormat,
    tree: &Octree,
    resolution_m: f64,
    threshold: f32,
) -> anyhow::Result<u64> {
    write_whole(&args.output, |mut out| {
        match format {
            OctreeFormat::Bt => write_bt(tree, resolution_m, threshold, &mut out)?,
            OctreeFormat::Ot => write_ot(tree, resolution_m, &mut out)?,
        }
        Ok(tree.expanded_leaf_count())
    })
}

/// From one of OctoMap's files to another file; OctoMap's threshold is log-odds 0.
fn export_octree_file(args: &ExportArgs, format: ExportFormat, region: Option<&Aabb>) -> anyhow::Result<u64> {
    let file = octree_file::read(&args.map)?;
    let format = match format {
        ExportFormat::Voxels(format) => format,
        ExportFormat::Octree(_) if region.is_some() => {
            return Err(
                Error::argument("--region", "from an octree file to another is the whole tree").into()
            );
        }
        ExportFormat::Octree(format) => {
            return write_octree(args, format, &file.tree, file.resolution_m, 0.0);
        }
    };
    let min_log_odds = args.min_probability.map_or(0.0, |probability| logit(probability) as f32);
    let keep = |center_m| region.is_none_or(|region| region.contains(center_m));
    let count = octree_file::count_voxels(&file, min_log_odds, keep)?;
    write_whole(&args.output, |out| {
        let mut writer = VoxelWriter::new(format, count, file.resolution_m, out)?;
        octree_file::for_each_voxel(&file, min_log_odds, |voxel| match keep(voxel.center_m) {
            true => Ok::<_, anyhow::Error>(writer.write(voxel)?),
            false => Ok(()),
        })?;
        writer.finish()?;
        Ok(count)
    })
}

/// Writes a file beside its place and moves it there once it is whole.
fn write_whole<T>(path: &Path, write: impl FnOnce(&mut dyn Write) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let part: PathBuf = path.with_added_extension("part");
    let file = File::create(&part).map_err(|error| Error::io(&part, "create", error))?;
    let mut out = BufWriter::with_capacity(1 << 18, file);
    let outcome = write(&mut out).and_then(|value| {
        out.flush()?;
        fs::rename(&part, path)?;
        Ok(value)
    });
    if outcome.is_err() {
        // The error to report is the first one.
        fs::remove_file(&part).ok();
    }
    outcome
}
