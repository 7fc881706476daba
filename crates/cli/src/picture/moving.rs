use crate::args::PictureArgs;
use crate::part::region_of;
use crate::progress::Progress;
use voxtile::mapper::{MapReader, MapView};
use voxtile::space::TileBox;
use voxtile::store::KeptRecord;
use voxtile::{Error, Result};
use voxtile_pipeline::{AnyMap, read_moving_points};
use voxtile_render::Drawing;

/// Returns the map whose marked points are to be drawn; `None` without `--moving`.
///
/// # Errors
///
/// The map has no kept scans, so no point is marked.
pub fn map_with_marks<'a>(args: &PictureArgs, map: &'a AnyMap) -> Result<Option<&'a MapReader>> {
    let reason = match map {
        _ if !args.moving => return Ok(None),
        AnyMap::Map(map) if map.keeps_scans() => return Ok(Some(map)),
        AnyMap::Map(_) => "the map keeps no scans, so no point is marked; build it with --keep-scans",
        AnyMap::Octree(_) => "an OctoMap file has no scans, so no point is marked",
    };
    Err(Error::argument("--moving", reason))
}

/// Adds the marked points to a drawing, scan by scan. Returns the number of all marked points of the map.
pub fn add_moving(map: &MapReader, args: &PictureArgs, drawing: &mut Drawing) -> Result<u64> {
    let region = args.region.as_deref().map(region_of).transpose()?;
    let tiles = region.map(|region| {
        let (grid, voxels) = (map.config().grid, map.config().grid.voxels_in(&region));
        // A marked point is no hit: its ray may end in a tile next to those that the scan changes.
        TileBox::new(grid.tile_of_voxel(voxels.min), grid.tile_of_voxel(voxels.end)).grown(1)
    });
    let is_near =
        |record: &KeptRecord| tiles.is_none_or(|tiles| record.tiles.iter().any(|&tile| tiles.contains(tile)));
    let (mut marked, progress) = (0_u64, Progress::over_scans(None));
    // The legend has a line of the points even if there are none.
    drawing.add_moving(&[]);
    let is_wanted = |record: &KeptRecord| {
        progress.step();
        marked = marked.saturating_add(record.moving.map_or(0, |moving| moving.marked));
        is_near(record)
    };
    read_moving_points(map, is_wanted, |points| drawing.add_moving(points))?;
    Ok(marked)
}
