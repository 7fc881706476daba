use crate::args::{ExportArgs, WhatName};
use crate::json;
use crate::part::{point_of, region_of};
use crate::progress::at_terminal;
use crate::quiet::summary_out;
use crate::stop_signal;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use voxtile::Error;
use voxtile_formats::write::FileUnit;
use voxtile_pipeline::output::is_standard_output;
use voxtile_pipeline::{
    ExportOptions, ExportSummary, ExportedScans, POSES_NAME, WhichPoints, WhichVoxels, Written, export,
    export_scans,
};

/// Writes the file and prints a summary, to standard error if the file is standard output. `is_quiet` suppresses the
/// summary.
pub fn run(args: &ExportArgs, is_quiet: bool) -> anyhow::Result<ExitCode> {
    let watch = at_terminal(stop_signal::catch_unfinished()?);
    if let Some(folder) = &args.scans {
        let which = if args.only_moving { WhichPoints::Moving } else { WhichPoints::All };
        let exported = export_scans(&args.map, folder, which, &watch)?;
        print(args, &exported, &text_of_scans(&exported, folder), &mut summary_out(args.json))?;
        return Ok(ExitCode::SUCCESS);
    }
    let options = options_of(args)?;
    let is_stream = is_standard_output(&options.output);
    if is_stream && !options.checked_format()?.is_text && io::stdout().is_terminal() {
        let reason = "standard output is a terminal; redirect it to a file or a pipe";
        return Err(Error::argument("output", reason).into());
    }
    let summary = export(&options, &watch)?;
    let text = text_of(&summary);
    if !is_stream {
        print(args, &summary, &text, &mut summary_out(args.json))?;
    } else if args.json || !is_quiet {
        print(args, &summary, &text, &mut io::stderr().lock())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn options_of(args: &ExportArgs) -> voxtile::Result<ExportOptions> {
    let mut options = ExportOptions::new(&args.map, &args.output);
    options.format.clone_from(&args.format);
    options.which = args.min_probability.map(WhichVoxels::AtLeast).or(args.what.map(|what| match what {
        WhatName::Occupied => WhichVoxels::Occupied,
        WhatName::Free => WhichVoxels::Free,
        WhatName::All => WhichVoxels::All,
    }));
    options.with_layers = !args.no_layers;
    options.mean_points = args.mean_points;
    options.only_classes.clone_from(&args.only_class);
    options.z_min_m = args.z_min;
    options.z_max_m = args.z_max;
    options.cell_m = args.cell;
    options.is_quantized = args.quantize;
    options.region = args.region.as_deref().map(region_of).transpose()?;
    options.origin_m = args.origin.as_deref().map(point_of);
    options.crs.clone_from(&args.crs);
    options.unit = args.unit.as_deref().and_then(FileUnit::of_name);
    options.memory_bytes = args.memory.map_or(options.memory_bytes, |bytes| bytes.as_u64() as usize);
    Ok(options)
}

fn print(
    args: &ExportArgs,
    summary: &impl Serialize,
    text: &str,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    match args.json {
        true => json::print(&serde_json::to_value(summary)?, out),
        false => Ok(out.write_all(text.as_bytes())?),
    }
}

fn text_of(summary: &ExportSummary) -> String {
    let file = match is_standard_output(&summary.file) {
        true => "standard output".to_owned(),
        false => summary.file.display().to_string(),
    };
    let voxels = HumanCount(summary.voxels);
    let mut text = format!("{voxels} voxels in {file}\n");
    match &summary.written {
        Written::Stream { origin_m: [x, y, z], origin_voxel, origin_file, requested_m } => {
            if *origin_voxel != [0; 3] || requested_m.is_some() {
                text += &format!("origin {x} {y} {z} m: add it to the file's coordinates");
                if let Some([x, y, z]) = requested_m {
                    text += &format!("; the voxel corner nearest to {x} {y} {z}");
                }
                if let Some(path) = origin_file {
                    text += &format!("; also in {}", path.display());
                }
                text.push('\n');
            }
        }
        Written::Files { files_beside, .. } => {
            files_beside.iter().for_each(|path| text += &format!("also wrote {}\n", path.display()));
        }
        Written::Tileset { nodes, .. } => {
            text = format!("{voxels} voxels in {} nodes in {file}/tileset.json\n", HumanCount(*nodes));
        }
    }
    text
}

fn text_of_scans(exported: &ExportedScans, folder: &Path) -> String {
    let (scans, points) = (HumanCount(exported.scans), HumanCount(exported.points));
    let mut text =
        format!("exported  {scans} scans, {points} points, and {POSES_NAME}, to {}\n", folder.display());
    if exported.world_frame {
        text += "note      the points are in the world frame: use --world-frame in build\n";
    }
    text
}
