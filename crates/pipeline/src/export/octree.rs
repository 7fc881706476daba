use super::moved_file::MovedFile;
use super::origin::ExportOrigin;
use super::run::Export;
use super::summary::ExportSummary;
use crate::output::scratch_for;
use crate::{octree_file, read_map};
use voxtile::mapper::{MapView, OctreeMap, Stoppable};
use voxtile::octree::{OctreeFormat, write_bt, write_ot};
use voxtile::query::OctreeExport;
use voxtile::{Error, MapQueries};

/// Writes an octree file of any size.
pub(super) fn export(export: &Export<'_>, format: OctreeFormat) -> anyhow::Result<ExportSummary> {
    let (options, file) = (export.options, MovedFile::of(export)?);
    if OctreeMap::is_named_by(&options.map) {
        return of_octree(export, &file, format);
    }
    read_map(&options.map, |reader| {
        let grid = reader.config().grid;
        let has_colours = options.with_layers && reader.config().layers().colour;
        let format = match format {
            OctreeFormat::Ot if has_colours => OctreeFormat::ColorOt,
            other => other,
        };
        let origin = options.origin_m.map(|requested_m| ExportOrigin::near(requested_m, &grid));
        let origin = origin.transpose()?.unwrap_or_default();
        let (region, memory_bytes) = (options.region.as_ref(), options.memory_bytes);
        let octree = OctreeExport { format, region, origin: origin.voxel, memory_bytes };
        // The parts of the tree are spooled to an unnamed file until all of them are built.
        let mut spool = scratch_for(&options.output)?;
        let map = Stoppable::new(reader, export.watch.stop());
        let voxels = file.write(&origin, &grid, |mut out| map.write_octree(&octree, &mut spool, &mut out))?;
        Ok(file.summary(voxels, &origin))
    })
}

/// Converts between OctoMap's file formats. OctoMap's threshold is log-odds 0.
fn of_octree(
    export: &Export<'_>,
    file: &MovedFile<'_>,
    format: OctreeFormat,
) -> anyhow::Result<ExportSummary> {
    if export.options.region.is_some() || export.options.origin_m.is_some() {
        let reason = "conversion between octree files always includes the whole tree with its coordinates: omit this \
                      option";
        return Err(Error::argument("region, origin", reason).into());
    }
    let octree = octree_file::read(&export.options.map)?;
    let (tree, resolution_m) = (&octree.tree, octree.resolution_m);
    let origin = ExportOrigin::default();
    file.write(&origin, &octree_file::grid_of(&octree)?, |mut out| {
        match format {
            OctreeFormat::Bt => write_bt(tree, resolution_m, 0.0, &mut out)?,
            OctreeFormat::Ot | OctreeFormat::ColorOt => write_ot(tree, resolution_m, &mut out)?,
        }
        Ok(())
    })?;
    Ok(file.summary(tree.expanded_leaf_count(), &origin))
}
