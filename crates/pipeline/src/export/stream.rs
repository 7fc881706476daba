use super::chosen::{Chosen, Offset};
use super::moved_file::MovedFile;
use super::origin::ExportOrigin;
use super::run::Export;
use super::summary::ExportSummary;
use crate::{octree_file, read_map};
use std::io::Write;
use voxtile::mapper::{MapReader, MapView, OctreeMap, Stoppable};
use voxtile::octree::OctreeFile;
use voxtile::space::{Aabb, Grid, TileIndex, VoxelBox};
use voxtile::{Layers, Result};
use voxtile_formats::write::{Origin, VoxelRow, VoxelSink, VoxelsHead, WriteOptions};

/// Writes voxels as one stream of bytes.
pub(super) fn export(export: &Export<'_>) -> anyhow::Result<ExportSummary> {
    let file = MovedFile::of(export)?;
    if OctreeMap::is_named_by(&export.options.map) {
        return of_octree(export, &file, &octree_file::read(&export.options.map)?);
    }
    read_map(&export.options.map, |reader| of_map(export, &file, reader))
}

fn of_map(export: &Export<'_>, file: &MovedFile<'_>, reader: &MapReader) -> anyhow::Result<ExportSummary> {
    let (grid, stop) = (reader.config().grid, export.watch.stop());
    let chosen = Chosen::of(export, reader.config().occupied_log_odds(), reader.config().layers())?;
    let tiles = reader.tile_indices();
    let origin = origin_of(export, &grid, || hull(&grid, &tiles, chosen.region.as_ref()))?;
    let voxels = chosen.count(reader, stop)?;
    file.write(&origin, &grid, |out| {
        let gauge = export.watch.over_tiles(tiles.len());
        let mut sink = open(export, voxels, chosen.layers, &grid, &origin, out)?;
        chosen.for_each(
            &Stoppable::new(reader, stop),
            &*gauge,
            |voxel, offset| origin.point_m(voxel, offset, &grid),
            |row| sink.put(row),
        )?;
        Ok(sink.finish()?)
    })?;
    Ok(file.summary(voxels, &origin))
}

/// Exports the voxels of an OctoMap file in tree order. Its threshold is log-odds 0.
fn of_octree(
    export: &Export<'_>,
    file: &MovedFile<'_>,
    octree: &OctreeFile,
) -> anyhow::Result<ExportSummary> {
    let grid = octree_file::grid_of(octree)?;
    let chosen = Chosen::of(export, 0.0, Layers::NONE)?;
    let origin = origin_of(export, &grid, || None)?;
    let min_log_odds = chosen.min_log_odds as f32;
    let is_chosen = |voxel: &VoxelRow| {
        chosen.is_below_end(voxel.log_odds)
            && chosen.region.is_none_or(|region| region.contains(voxel.center_m))
    };
    let voxels = octree_file::count_voxels(octree, min_log_odds, is_chosen)?;
    file.write(&origin, &grid, |out| {
        let mut sink = open(export, voxels, Layers::NONE, &grid, &origin, out)?;
        octree_file::for_each_voxel(octree, min_log_odds, |voxel| {
            if is_chosen(voxel) {
                let center_m = origin.point_m(voxel.index, Offset::default(), &grid);
                sink.put(&VoxelRow { center_m, ..*voxel })?;
            }
            Ok(())
        })?;
        Ok(sink.finish()?)
    })?;
    Ok(file.summary(voxels, &origin))
}

fn open<'a>(
    export: &Export<'_>,
    voxels: u64,
    layers: Layers,
    grid: &Grid,
    origin: &ExportOrigin,
    out: &'a mut dyn Write,
) -> Result<Box<dyn VoxelSink + 'a>> {
    let head = VoxelsHead { layers, ..VoxelsHead::of_stream(voxels, grid.resolution_m()) };
    let mut options = WriteOptions::for_path(&export.options.output);
    options.origin_m = origin.corner_m;
    export.format.open_stream(&head, out, &options)
}

/// Returns the origin of the file's coordinates: the requested one, or an automatic one where single precision requires
/// it.
fn origin_of(
    export: &Export<'_>,
    grid: &Grid,
    voxels: impl FnOnce() -> Option<VoxelBox>,
) -> Result<ExportOrigin> {
    match export.options.origin_m {
        Some(requested_m) => ExportOrigin::near(requested_m, grid),
        None if export.format.origin == Origin::CornerNearby => {
            voxels().map_or(Ok(ExportOrigin::default()), |voxels| ExportOrigin::nearby(&voxels, grid))
        }
        None => Ok(ExportOrigin::default()),
    }
}

/// Returns a bounding box of the voxels of all tiles that may have voxels to export.
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
