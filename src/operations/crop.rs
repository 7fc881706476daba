use super::convert::CopyScans;
use super::map_writer::{MapWriter, WrittenMap};
use super::part::{AreaPart, Part, Share, VoxelPart};
use super::scans_of_part::keep_scans_of_part;
use super::table_change::voxels_of_part;
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::persistence::{new_map_id, new_metadata};
use crate::store::{CatalogEntry, MapPath, Metadata, UnsyncedDisk};
use std::path::Path;
use std::sync::Arc;

/// Creates a map of the voxels of another map in a part of space.
///
/// The new map has the parameters, storage and number of scans of the original map. It has its own id, and no inputs: a
/// build cannot be resumed on it, because it lacks a part of the scans. It appears only when it is complete, see
/// [`MapWriter`]. `progress` receives the number of tiles done and in total.
///
/// With [`CopyScans::Yes`] a map that keeps its scans keeps those that changed a tile of the part, with all their points.
/// They are mapped only into the tiles around the part from then on, but into these whole: a remap also restores
/// the voxels of its outer tiles that are not in the part.
///
/// # Errors
///
/// An invalid box, a damaged tile or kept scan, kept scans of all other voxels, an output with other content, or an I/O
/// error.
pub fn crop(
    map: &MapReader,
    part: &Part,
    scans: CopyScans,
    output: impl AsRef<Path>,
    progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let part = part.voxels(&map.config().grid)?;
    crop_to(map, &part, ScansOfPart::Copied(scans), MapPath::on(map.disk(), output), new_map_id(), progress)
}

/// Like [`crop`], for a part of space over an area. Tiles outside of the area are not read, unless the part is all other
/// voxels.
///
/// # Errors
///
/// As for [`crop`]. Also fails if no center of a voxel is between the heights.
pub fn crop_area(
    map: &MapReader,
    part: &AreaPart,
    scans: CopyScans,
    output: impl AsRef<Path>,
    progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let part = part.voxels(&map.config().grid)?;
    crop_to(map, &part, ScansOfPart::Copied(scans), MapPath::on(map.disk(), output), new_map_id(), progress)
}

/// Like [`crop`], for a shard of a future map with the id `map_id` ([`move_shard`](super::move_shard())). With
/// `keeps_new_scans` the shard keeps scans that are added to it, but none of the map. The shard is durable only after [`move_shard`](super::move_shard()): after a crash before that, create it again.
///
/// # Errors
///
/// As for [`crop`].
pub fn crop_shard(
    map: &MapReader,
    part: &Part,
    keeps_new_scans: bool,
    output: impl AsRef<Path>,
    map_id: [u8; 16],
    progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let disk = Arc::new(UnsyncedDisk::of(map.disk()));
    let part = part.voxels(&map.config().grid)?;
    let scans = if keeps_new_scans { ScansOfPart::New } else { ScansOfPart::Copied(CopyScans::No) };
    crop_to(map, &part, scans, MapPath::on(disk, output), map_id, progress)
}

/// Scans that a crop keeps.
#[derive(Clone, Copy)]
enum ScansOfPart {
    Copied(CopyScans),
    /// Those that are added later.
    New,
}

fn crop_to(
    map: &MapReader,
    part: &VoxelPart,
    scans: ScansOfPart,
    output: MapPath,
    map_id: [u8; 16],
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let grid = map.config().grid;
    let (disk, output) = output.into_parts();
    let mut writer = MapWriter::create_as(disk, &output, metadata_of_part(map, map_id))?;
    match scans {
        ScansOfPart::New => {
            let last = map.scan_number();
            let mut before = (last > 0).then_some(CatalogEntry::Unlisted(1, last));
            writer.keep_scans(|_| Ok(before.take()))?;
        }
        ScansOfPart::Copied(CopyScans::Yes) if map.keeps_scans() => {
            let tiles = part.tiles(&grid).ok_or_else(|| {
                let reason = "the scans cannot be limited to all voxels outside: crop a box or polygon, or copy no scans";
                Error::argument("scans", reason)
            })?;
            keep_scans_of_part(&mut writer, map, tiles)?;
        }
        _ => writer.take_scans_of(map)?,
    }
    let mut tiles = map.tile_indices();
    tiles.retain(|&tile| part.share_of(&grid.voxels_of_tile(tile)) != Share::Nothing);
    for (done, &tile) in (0..).zip(&tiles) {
        progress(done, tiles.len() as u64);
        let Some(found) = map.tile_uncached(tile)? else { continue };
        match part.share_of(&found.voxel_box()) {
            Share::Nothing => {}
            Share::Everything => writer.put(tile, found.table())?,
            Share::Some => writer.put(tile, &voxels_of_part(found.table(), &found.voxel_box(), part))?,
        }
    }
    progress(tiles.len() as u64, tiles.len() as u64);
    writer.finish()
}

/// Returns the metadata of a part of a map: those of the whole map, but with the id `map_id` and without inputs.
fn metadata_of_part(map: &MapReader, map_id: [u8; 16]) -> Metadata {
    let mut metadata = new_metadata(map.config(), map_id, &[]);
    if let (Some(ext), Some(whole)) = (&mut metadata.ext, &map.metadata().ext) {
        (ext.scan_number, ext.decayed_scan) = (whole.scan_number, whole.decayed_scan);
    }
    metadata
}
