use super::chosen::{Chosen, Offset};
use super::run::Export;
use super::summary::{ExportSummary, Written};
use crate::output::StagedOutput;
use crate::read_any_map;
use voxtile::Result;
use voxtile::mapper::{MapView, Stoppable};
use voxtile::space::Aabb;
use voxtile_formats::write::{VoxelsHead, WriteOptions};

/// Writes a file or folder and its companion files atomically.
pub(super) fn export(export: &Export<'_>) -> anyhow::Result<ExportSummary> {
    let (options, watch) = (export.options, export.watch);
    let (head, files_beside) = read_any_map(&options.map, |map| {
        let map = &Stoppable::new(map, watch.stop());
        let chosen = Chosen::of(export, map.config().occupied_log_odds(), map.config().layers())?;
        let unit = options.file_unit()?;
        let head = head_of(&chosen, map)?;
        let staged = StagedOutput::beside(&options.output)?;
        let mut how = WriteOptions::for_path(&options.output);
        how.crs = options.file_crs(map.config().crs.as_ref())?;
        how.unit = unit;
        how.has_mean_points = chosen.mean_points;
        how.companion_folder = staged.folder().to_owned();
        let in_file = |length_m: f64| unit.of_metres(length_m);
        (how.z_min_m, how.z_max_m) = (options.z_min_m.map(in_file), options.z_max_m.map(in_file));
        how.is_quantized = options.is_quantized;
        how.cell_m = options.cell_m.unwrap_or(how.cell_m);
        how.origin_m = options.origin_m.unwrap_or_default();
        // A mean point may be anywhere in its voxel.
        let around_m = if chosen.mean_points { head.resolution_m / 2.0 } else { 0.0 };
        let [min, max] = head.bounds_m;
        let head_in_file = VoxelsHead {
            resolution_m: in_file(head.resolution_m),
            bounds_m: [min.map(|x| in_file(x - around_m)), max.map(|x| in_file(x + around_m))],
            ..head.clone()
        };
        let mut sink = export.format.open(&head_in_file, &staged.path()?, &how)?;
        let (grid, origin_m) = (map.config().grid, how.origin_m);
        let point_m = |voxel, offset: Offset| {
            let center_m = grid.center_m(voxel);
            std::array::from_fn(|k| in_file(center_m[k] + offset[k] * grid.resolution_m() - origin_m[k]))
        };
        let gauge = watch.over_tiles(map.tile_indices().len());
        chosen.for_each(map, &*gauge, point_m, |row| sink.put(row))?;
        sink.finish()?;
        drop(gauge);
        watch.stop().check()?;
        Ok((head, staged.finish()?))
    })?;
    let [min, max] = head.bounds_m;
    let bounds_m = (head.voxels > 0).then_some(Aabb { min, max });
    Ok(export.summary(head.voxels, Written::Files { format: export.format.name, bounds_m, files_beside }))
}

/// Counts the voxels and computes their bounding box.
fn head_of(chosen: &Chosen, map: &impl MapView) -> Result<VoxelsHead> {
    let grid = map.config().grid;
    let mut head = VoxelsHead {
        voxels: 0,
        resolution_m: grid.resolution_m(),
        bounds_m: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        occupied_log_odds: map.config().occupied_log_odds(),
        layers: chosen.layers,
    };
    chosen.visit(map, |voxel| {
        head.voxels += 1;
        let center_m = grid.center_m(voxel.index);
        for (k, center_m) in center_m.into_iter().enumerate() {
            head.bounds_m[0][k] = head.bounds_m[0][k].min(center_m);
            head.bounds_m[1][k] = head.bounds_m[1][k].max(center_m);
        }
    })?;
    if head.voxels == 0 {
        head.bounds_m = [[0.0; 3]; 2];
    }
    Ok(head)
}
