use crate::args::{ExportArgs, ExportFormatName, WhatName};
use crate::export_3d_tiles;
use crate::export_origin::{ExportOrigin, OriginFile};
use crate::export_scans;
use crate::export_voxels::{self, log_odds_of};
use crate::exported::Exported;
use crate::output_file::{OutputFile, is_standard_output, scratch_for};
use crate::part::point_of;
use crate::part::region_of;
use crate::progress::at_terminal;
use crate::stop_signal;
use indicatif::HumanCount;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use voxtile::mapper::{MapReader, MapView, OctreeMap, Stoppable};
use voxtile::octree::{OctreeFormat, write_bt, write_ot};
use voxtile::query::OctreeExport;
use voxtile::sensor::Probabilities;
use voxtile::space::{Aabb, Grid, TileIndex, VoxelBox};
use voxtile::{Error, MapQueries};
use voxtile_formats::write::VoxelFileFormat;
use voxtile_formats::{VoxelFile, VoxelFormat, VoxelRecord, VoxelWriter};
use voxtile_pipeline::Watch;
use voxtile_pipeline::memory;
use voxtile_pipeline::octree_file;
use voxtile_pipeline::read_map;

#[derive(Clone, Copy)]
enum ExportFormat {
    Voxels(VoxelFormat),
    Octree(OctreeFormat),
    /// Of another program.
    Foreign(VoxelFileFormat),
}

/// What to write, once it is known that the arguments fit each other.
struct Export<'a> {
    args: &'a ExportArgs,
    watch: &'a Watch,
    format: ExportFormat,
    region: Option<Aabb>,
    /// `None` for a stream.
    origin_file: Option<OriginFile>,
}

/// What was written.
struct Written {
    voxels: u64,
    origin: ExportOrigin,
}

/// Writes the file and says what it is; on standard error, unless `is_quiet`, where standard output is the file.
pub fn run(args: &ExportArgs, is_quiet: bool) -> anyhow::Result<ExitCode> {
    let exported = export(args, &at_terminal(stop_signal::catch_unfinished()?))?;
    if args.scans.is_some() || !is_standard_output(&args.output) {
        exported.print(args.json, &mut io::stdout().lock())?;
    } else if args.json || !is_quiet {
        exported.print(args.json, &mut io::stderr().lock())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the file. Stopped, it is as it was.
pub fn export(args: &ExportArgs, watch: &Watch) -> anyhow::Result<Exported> {
    if let Some(folder) = &args.scans {
        return export_scans::export(args, folder, watch);
    }
    if args.format == Some(ExportFormatName::ThreeDTiles) {
        return export_3d_tiles::export(args, watch);
    }
    let export = Export::of(args, watch)?;
    if let ExportFormat::Foreign(format) = export.format {
        return export_voxels::export(args, format, export.region.as_ref(), watch);
    }
    let written = if OctreeMap::is_named_by(&args.map) {
        export.octree_file()?
    } else {
        read_map(&args.map, |reader| match export.format {
            ExportFormat::Voxels(format) => export.voxels(format, reader),
            ExportFormat::Octree(format) => export.octree(format, reader),
            ExportFormat::Foreign(_) => unreachable!("written above"),
        })?
    };
    Ok(export.told(&written))
}

impl<'a> Export<'a> {
    fn of(args: &'a ExportArgs, watch: &'a Watch) -> voxtile::Result<Self> {
        let region = args.region.as_deref().map(region_of).transpose()?;
        if args.min_probability.is_some_and(|probability| !(0.0..=1.0).contains(&probability)) {
            return Err(Error::argument("--min-probability", "must be from 0 to 1"));
        }
        let format = format_of(args)?;
        if matches!(format, ExportFormat::Octree(_)) && args.min_probability.is_some() {
            let reason = "an octree file holds free and occupied voxels alike; leave the option out";
            return Err(Error::argument("--min-probability", reason));
        }
        if matches!(format, ExportFormat::Octree(_)) && args.what.is_some() {
            let reason = "an octree file holds free and occupied voxels alike; leave the option out";
            return Err(Error::argument("--what", reason));
        }
        let is_flat =
            matches!(format, ExportFormat::Foreign(VoxelFileFormat::Nav2Map | VoxelFileFormat::Heightmap));
        if (args.z_min.is_some() || args.z_max.is_some()) && !is_flat {
            return Err(Error::argument("--z-min, --z-max", "only .pgm and .png take heights; use --region"));
        }
        if args.cell.is_some() && !matches!(format, ExportFormat::Foreign(VoxelFileFormat::Autoware)) {
            return Err(Error::argument("--cell", "only --format autoware has squares"));
        }
        let is_text = matches!(format, ExportFormat::Voxels(VoxelFormat::Csv));
        if is_standard_output(&args.output) && !is_text && io::stdout().is_terminal() {
            return Err(Error::argument(
                "--output",
                "standard output is a terminal; send it to a file or a pipe",
            ));
        }
        Ok(Self { args, watch, format, region, origin_file: OriginFile::of(&args.output)? })
    }

    /// Writes the whole file, and beside it where it is.
    fn write<T>(
        &self,
        origin: &ExportOrigin,
        grid: &Grid,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let mut file = OutputFile::create(&self.args.output)?.stop_with(self.watch.stop().clone());
        let value = write(&mut file.out()).map_err(|error| self.with_name(error))?;
        self.watch.stop().check()?;
        match &self.origin_file {
            // First: who has only one of the two has one too many, and no shifted file that does not say so.
            Some(beside) if origin.is_moved() => {
                let hash = file.hash()?;
                beside.write(&self.args.output, hash, origin, grid)?;
                file.finish()?;
            }
            Some(beside) => {
                file.finish()?;
                beside.remove()?;
            }
            None => file.finish()?,
        }
        Ok(value)
    }

    /// What a disk refused while the file was written does not say by itself which file that was.
    fn with_name(&self, error: anyhow::Error) -> anyhow::Error {
        if self.watch.stop().is_set() {
            return Error::Stopped.into();
        }
        match error.downcast::<io::Error>() {
            Ok(error) => Error::io(&self.args.output, "write", error).into(),
            Err(error) => error,
        }
    }

    fn voxels(&self, format: VoxelFormat, reader: &MapReader) -> anyhow::Result<Written> {
        let grid = reader.config().grid;
        let below = self.below(reader);
        let origin =
            self.origin(Some(format), &grid, || hull(&grid, &reader.tile_indices(), self.region.as_ref()))?;
        let voxels = self.count_voxels(reader)?;
        let file = VoxelFile { format, voxels, resolution_m: grid.resolution_m(), origin_m: origin.corner_m };
        self.write(&origin, &grid, |out| {
            let progress = self.watch.over_tiles(reader.tile_indices().len());
            let mut writer = VoxelWriter::new(file, out)?;
            let mut written = Ok(());
            let mut tile = None;
            let mut probabilities = Probabilities::default();
            let map = Stoppable::new(reader, self.watch.stop());
            map.for_each_occupied(self.least_probability(), self.region.as_ref(), |voxel| {
                if voxel.evidence.log_odds >= below {
                    return;
                }
                let index = Some(grid.tile_of_voxel(voxel.index));
                if tile != index {
                    tile = index;
                    progress.step();
                }
                if written.is_ok() {
                    written = writer.write(&VoxelRecord {
                        center_m: origin.center_m(voxel.index, &grid),
                        probability: probabilities.of(voxel.evidence.log_odds),
                        log_odds: voxel.evidence.log_odds,
                        observation_count: voxel.evidence.observation_count,
                    });
                }
            })?;
            written?;
            writer.finish()?;
            Ok(Written { voxels, origin })
        })
    }

    /// How many voxels there are to export: the headers name it before the first. In constant memory, and without
    /// reading a tile where the log of the map knows.
    fn count_voxels(&self, reader: &MapReader) -> voxtile::Result<u64> {
        let (least, region, below) = (self.least_probability(), self.region.as_ref(), self.below(reader));
        match (reader.voxel_counts(), least, region) {
            (Some((_, occupied)), None, None) => return Ok(occupied),
            (Some((voxels, occupied)), Some(0.0), None) => {
                return Ok(if below == f64::INFINITY { voxels } else { voxels - occupied });
            }
            _ => {}
        }
        let mut count = 0;
        let map = Stoppable::new(reader, self.watch.stop());
        map.for_each_occupied(least, region, |voxel| count += u64::from(voxel.evidence.log_odds < below))?;
        Ok(count)
    }

    /// The least probability of a voxel that is written; `None` is the map's threshold.
    fn least_probability(&self) -> Option<f64> {
        match self.args.what {
            Some(WhatName::Free | WhatName::All) => Some(0.0),
            _ => self.args.min_probability,
        }
    }

    /// The log-odds that a voxel must be below to be written.
    fn below(&self, map: &impl MapView) -> f64 {
        let [_, below] = log_odds_of(self.args, WhatName::Occupied, map.config().occupied_log_odds());
        below
    }

    /// Writes an octree file of any size. Its parts lie in a file without a name until all of them are known.
    fn octree(&self, format: OctreeFormat, reader: &MapReader) -> anyhow::Result<Written> {
        let grid = reader.config().grid;
        let origin = self.origin(None, &grid, || None)?;
        let (region, memory_bytes) = (self.region.as_ref(), self.args.memory.as_u64() as usize);
        let export = OctreeExport { format, region, origin: origin.voxel, memory_bytes };
        let mut spool = scratch_for(&self.args.output)?;
        let map = Stoppable::new(reader, self.watch.stop());
        let voxels = self.write(&origin, &grid, |mut out| map.write_octree(&export, &mut spool, &mut out))?;
        Ok(Written { voxels, origin })
    }

    /// From one of OctoMap's files to another file; OctoMap's threshold is log-odds 0.
    fn octree_file(&self) -> anyhow::Result<Written> {
        let file = octree_file::read(&self.args.map)?;
        // The tile size has no meaning here; two voxels always make a grid.
        let grid = Grid::new(file.resolution_m, 2.0 * file.resolution_m).map_err(Error::from)?;
        let format = match self.format {
            ExportFormat::Voxels(format) => format,
            ExportFormat::Foreign(_) => unreachable!("written before"),
            ExportFormat::Octree(_) if self.region.is_some() || self.args.origin.is_some() => {
                let reason = "from an octree file to another is the whole tree, where it is";
                return Err(Error::argument("--region, --origin", reason).into());
            }
            ExportFormat::Octree(format) => {
                let voxels = file.tree.expanded_leaf_count();
                let origin = ExportOrigin::default();
                self.write(&origin, &grid, |mut out| {
                    match format {
                        OctreeFormat::Bt => write_bt(&file.tree, file.resolution_m, 0.0, &mut out)?,
                        OctreeFormat::Ot => write_ot(&file.tree, file.resolution_m, &mut out)?,
                    }
                    Ok(())
                })?;
                return Ok(Written { voxels, origin });
            }
        };
        let origin = self.origin(Some(format), &grid, || None)?;
        let [from, below] = log_odds_of(self.args, WhatName::Occupied, 0.0);
        let min_log_odds = from as f32;
        let inside = |center_m| self.region.is_none_or(|region| region.contains(center_m));
        let is_free_alone = self.args.what == Some(WhatName::Free);
        let keep =
            |voxel: &VoxelRecord| inside(voxel.center_m) && !(is_free_alone && voxel.log_odds >= below);
        let voxels = octree_file::count_voxels(&file, min_log_odds, keep)?;
        let header = VoxelFile { format, voxels, resolution_m: file.resolution_m, origin_m: origin.corner_m };
        self.write(&origin, &grid, |out| {
            let mut writer = VoxelWriter::new(header, out)?;
            octree_file::for_each_voxel(&file, min_log_odds, |index, voxel| match keep(voxel) {
                true => {
                    let center_m = origin.center_m(index, &grid);
                    Ok::<_, anyhow::Error>(writer.write(&VoxelRecord { center_m, ..*voxel })?)
                }
                false => Ok(()),
            })?;
            writer.finish()?;
            Ok(Written { voxels, origin })
        })
    }

    /// Where the file's coordinates begin: where they are asked to, or, in a PCD file of a far map, where they must.
    fn origin(
        &self,
        format: Option<VoxelFormat>,
        grid: &Grid,
        voxels: impl FnOnce() -> Option<VoxelBox>,
    ) -> voxtile::Result<ExportOrigin> {
        match (&self.args.origin, format) {
            (Some(asked), _) => ExportOrigin::near(point_of(asked), grid),
            (None, Some(VoxelFormat::Pcd)) => {
                voxels().map_or(Ok(ExportOrigin::default()), |voxels| ExportOrigin::for_pcd(&voxels, grid))
            }
            (None, _) => Ok(ExportOrigin::default()),
        }
    }

    fn told(&self, written: &Written) -> Exported {
        let Written { voxels, origin } = written;
        let file = self.args.output.display().to_string();
        let beside = self.origin_file.as_ref().filter(|_| origin.is_moved()).map(OriginFile::path);
        let json = serde_json::json!({
            "file": file,
            "voxels": voxels,
            "origin_m": origin.corner_m,
            "origin_voxel": origin.voxel,
            "origin_file": beside.map(|path| path.display().to_string()),
            "peak_rss_bytes": memory::peak_bytes(),
        });
        let file = if is_standard_output(&self.args.output) { "standard output" } else { &file };
        let mut text = format!("{} voxels in {file}\n", HumanCount(*voxels));
        if origin.is_moved() || origin.asked_m.is_some() {
            text += &origin.text(beside);
        }
        Exported { json, text }
    }
}

fn format_of(args: &ExportArgs) -> voxtile::Result<ExportFormat> {
    let extension = args.output.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let voxels = VoxelFormat::of_path(&args.output).map(ExportFormat::Voxels);
    Ok(match (args.format, extension) {
        (Some(ExportFormatName::Ply), _) => ExportFormat::Voxels(VoxelFormat::Ply),
        (Some(ExportFormatName::Pcd), _) => ExportFormat::Voxels(VoxelFormat::Pcd),
        (Some(ExportFormatName::Csv), _) => ExportFormat::Voxels(VoxelFormat::Csv),
        (Some(ExportFormatName::Bt), _) | (None, "bt") => ExportFormat::Octree(OctreeFormat::Bt),
        (Some(ExportFormatName::Ot), _) | (None, "ot") => ExportFormat::Octree(OctreeFormat::Ot),
        (Some(name), _) => VoxelFileFormat::of_name(&name.name())
            .map(ExportFormat::Foreign)
            .ok_or_else(|| missing_format(&args.output))?,
        (None, _) => voxels
            .or_else(|| VoxelFileFormat::of_path(&args.output).map(ExportFormat::Foreign))
            .ok_or_else(|| missing_format(&args.output))?,
    })
}

fn missing_format(output: &Path) -> Error {
    let reason = if is_standard_output(output) {
        "standard output has no extension; add --format ply, pcd, csv, bt or ot".to_owned()
    } else {
        format!(
            "{}: its extension is of no known format; known are .ply .pcd .csv .xyz .npz .las .laz .copc.laz .e57 .parquet \
             .mcap .glb .pgm .png .bt .ot; or add --format",
            output.display()
        )
    };
    Error::argument("--output", reason)
}

/// A box around the voxels of all tiles that may have one to export.
fn hull(grid: &Grid, tiles: &[TileIndex], region: Option<&Aabb>) -> Option<VoxelBox> {
    let wanted = region.map(|region| grid.voxels_in(region));
    let boxes = tiles.iter().map(|&tile| {
        let voxels = grid.voxels_of_tile(tile);
        wanted.map_or(voxels, |wanted| wanted.intersection(&voxels))
    });
    boxes.filter(|voxels| !voxels.is_empty()).reduce(|a, b| VoxelBox {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        end: std::array::from_fn(|k| a.end[k].max(b.end[k])),
    })
}
