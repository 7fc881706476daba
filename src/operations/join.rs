use super::map_writer::WrittenMap;
use super::merge::{begin, check_grid, check_model, with_crs_of};
use super::regions::Regions;
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::store::{MapPath, hex};
use std::path::Path;

/// Makes one map of pieces ([`make_piece`](super::make_piece), [`move_piece`](super::move_piece())) of the same id,
/// which it gets.
///
/// The map is what [`merge`](super::merge()) would make of the pieces, but no tile is read: its files get a second name
/// in the map, or are copied where the file system has no such names. Pieces are opened one at a time, and stay whole,
/// so an attempt that was killed is made again; what it left is removed then. They are not to be written to; removing
/// them leaves the map as it is. It is there as a whole or not at all, see [`MapWriter`](super::MapWriter); it is made
/// on the disk of the pieces. `progress` is told the tiles done and all.
///
/// # Errors
///
/// No piece, pieces of other ids, parameters or storage, two with the same tile, a tile's file that is missing or of
/// another length than the log of its piece says, an output with other content, a disk that refuses.
pub fn join(
    pieces: &[MapPath],
    output: impl AsRef<Path>,
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let open = |piece: &MapPath| MapReader::open(piece.clone(), 0);
    let [first, ..] = pieces else {
        return Err(Error::argument("pieces", "name one or more"));
    };
    let first = open(first)?;
    let Some(map_id) = first.map_id() else {
        let reason = "of the original format, and no piece of a map to come";
        return Err(Error::argument(first.folder().display().to_string(), reason));
    };
    let (mut config, mut regions, mut all) = (first.config().clone(), Regions::of(&first)?, 0);
    for piece in pieces {
        let piece = open(piece)?;
        check_goes_with(&piece, &first)?;
        config.crs = with_crs_of(config.crs, &piece)?;
        if piece.config().rays.region != first.config().rays.region {
            config.rays.region = None;
        }
        regions.add(&piece)?;
        all += piece.tile_indices().len() as u64;
    }
    let mut writer = begin(&first, output.as_ref(), config, regions.one_build(), map_id)?;
    let mut done = 0;
    writer.link_all(pieces.iter().map(open), || {
        progress(done, all);
        done += 1;
    })?;
    progress(all, all);
    writer.finish()
}

fn check_goes_with(piece: &MapReader, first: &MapReader) -> Result<()> {
    check_grid(piece, first)?;
    check_model(piece, first)?;
    let [found, wanted] = [piece, first].map(|map| map.map_id().map(|id| hex(&id)).unwrap_or_default());
    let [storage, wanted_storage] = [piece, first].map(|map| map.config().storage);
    let path = piece.folder().to_owned();
    if found != wanted {
        Err(Error::Mismatch { path, what: "the id", found, wanted })
    } else if storage != wanted_storage {
        let [found, wanted] = [storage, wanted_storage].map(|storage| format!("{storage:?}"));
        Err(Error::Mismatch { path, what: "the storage", found, wanted })
    } else {
        Ok(())
    }
}
