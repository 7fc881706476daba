//! Voxels in the files of other programs.

use crate::args::{ExportArgs, WhatName};
use crate::exported::Exported;
use crate::output_file::{StagedOutput, is_standard_output};
use crate::part::point_of;
use indicatif::HumanCount;
use voxtile::mapper::{MapView, Stoppable};
use voxtile::maths::least_logit;
use voxtile::space::Aabb;
use voxtile::tile::Voxel;
use voxtile::{Error, Result};
use voxtile_formats::write::{VoxelFileFormat, VoxelRow, VoxelsHead, WriteOptions, open_sink};
use voxtile_pipeline::Watch;
use voxtile_pipeline::memory;
use voxtile_pipeline::{AnyMap, read_any_map};

/// Which voxels are written.
struct Chosen<'a> {
    region: Option<&'a Aabb>,
    /// Log-odds from the first on and below the second.
    log_odds: [f64; 2],
}

/// Writes the file, or the folder, and what belongs beside it: all of it or nothing.
pub fn export(
    args: &ExportArgs,
    format: VoxelFileFormat,
    region: Option<&Aabb>,
    watch: &Watch,
) -> anyhow::Result<Exported> {
    if is_standard_output(&args.output) {
        let reason = format!("{} is not written as a stream; name a file", format.name());
        return Err(Error::argument("--output", reason).into());
    }
    let is_single = format == VoxelFileFormat::Autoware;
    if args.origin.is_some() && !is_single {
        let reason = format!("{} keeps true coordinates; leave the option out", format.name());
        return Err(Error::argument("--origin", reason).into());
    }
    let (head, files) = read_any_map(&args.map, |map| {
        let map = &Stoppable::new(map, watch.stop());
        let chosen = Chosen::of(args, format, map, region);
        let head = chosen.head(map)?;
        let staged = StagedOutput::beside(&args.output)?;
        let mut options = WriteOptions::beside(&args.output);
        options.crs.clone_from(&map.config().crs);
        options.companion_folder = staged.folder().to_owned();
        (options.z_min_m, options.z_max_m) = (args.z_min, args.z_max);
        options.cell_m = args.cell.unwrap_or(options.cell_m);
        options.origin_m = args.origin.as_deref().map_or([0.0; 3], point_of);
        let progress = watch.over_tiles(map.tile_indices().len());
        let mut sink = open_sink(format, &head, &staged.path()?, &options).map_err(Error::from)?;
        chosen.for_each(map, &mut || progress.step(), &mut |row| Ok(sink.put(row)?))?;
        sink.finish().map_err(Error::from)?;
        drop(progress);
        watch.stop().check()?;
        Ok((head, staged.finish()?))
    })?;
    let file = args.output.display().to_string();
    let beside: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let [min, max] = head.bounds_m;
    let json = serde_json::json!({
        "file": file,
        "format": format.name(),
        "voxels": head.voxels,
        "bounds_m": (head.voxels > 0).then_some(serde_json::json!({ "min": min, "max": max })),
        "files_beside": beside,
        "peak_rss_bytes": memory::peak_bytes(),
    });
    let mut text = format!("{} voxels in {file}\n", HumanCount(head.voxels));
    beside.iter().for_each(|path| text += &format!("beside it {path}\n"));
    Ok(Exported { json, text })
}

/// The log-odds of the voxels that are asked for: from the first on and below the second.
pub fn log_odds_of(args: &ExportArgs, default: WhatName, threshold: f64) -> [f64; 2] {
    match (args.min_probability, args.what.unwrap_or(default)) {
        (Some(probability), _) if probability <= 0.0 => [f64::NEG_INFINITY, f64::INFINITY],
        (Some(probability), _) => [least_logit(probability), f64::INFINITY],
        (None, WhatName::Occupied) => [threshold, f64::INFINITY],
        (None, WhatName::Free) => [f64::NEG_INFINITY, threshold],
        (None, WhatName::All) => [f64::NEG_INFINITY, f64::INFINITY],
    }
}

impl<'a> Chosen<'a> {
    fn of(
        args: &ExportArgs,
        format: VoxelFileFormat,
        map: &Stoppable<'_, AnyMap>,
        region: Option<&'a Aabb>,
    ) -> Self {
        let threshold = map.config().occupied_log_odds();
        let default = if format.needs_free_voxels() { WhatName::All } else { WhatName::Occupied };
        Self { region, log_odds: log_odds_of(args, default, threshold) }
    }

    /// Counts the voxels, and finds a box around their centers.
    fn head(&self, map: &Stoppable<'_, AnyMap>) -> Result<VoxelsHead> {
        let config = map.config();
        let mut head = VoxelsHead {
            voxels: 0,
            resolution_m: config.grid.resolution_m(),
            bounds_m: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            occupied_log_odds: config.occupied_log_odds(),
        };
        self.for_each(map, &mut || (), &mut |row| {
            head.voxels += 1;
            for k in 0..3 {
                head.bounds_m[0][k] = head.bounds_m[0][k].min(row.center_m[k]);
                head.bounds_m[1][k] = head.bounds_m[1][k].max(row.center_m[k]);
            }
            Ok(())
        })?;
        if head.voxels == 0 {
            head.bounds_m = [[0.0; 3]; 2];
        }
        Ok(head)
    }

    /// Visits the voxels, tile by tile.
    fn for_each(
        &self,
        map: &Stoppable<'_, AnyMap>,
        next_tile: &mut dyn FnMut(),
        visit: &mut dyn FnMut(&VoxelRow) -> Result<()>,
    ) -> Result<()> {
        let grid = map.config().grid;
        let around = self.region.map(|region| grid.voxels_in(region));
        for index in map.tile_indices() {
            next_tile();
            let voxels = grid.voxels_of_tile(index);
            if around.is_some_and(|around| around.intersection(&voxels).is_empty()) {
                continue;
            }
            let Some(tile) = map.tile_uncached(index)? else { continue };
            for Voxel { index: voxel, evidence, .. } in tile.voxels() {
                let [from, below] = self.log_odds;
                let center_m = grid.center_m(voxel);
                let is_wanted = evidence.log_odds >= from
                    && (evidence.log_odds < below || below == f64::INFINITY)
                    && self.region.is_none_or(|region| region.contains(center_m));
                if is_wanted {
                    visit(&VoxelRow {
                        index: voxel,
                        center_m,
                        probability: evidence.probability(),
                        log_odds: evidence.log_odds,
                        observation_count: evidence.observation_count,
                        tile: index.to_array(),
                    })?;
                }
            }
        }
        Ok(())
    }
}
