use super::map_writer::WrittenMap;
use super::merge::{begin, check_grid, check_model, with_crs_of};
use super::regions::Regions;
use super::united_scans::{Part, unite_scans};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::store::{MapPath, hex};
use std::path::Path;

/// Joins shards ([`make_shard`](super::make_shard), [`move_shard`](super::move_shard())) with the same id to one map
/// with that id. If they keep scans, so does the map: all shards together must keep each scan up to the last number, and
/// a scan that several keep must be equal in them.
///
/// The result equals that of [`merge`](super::merge()), but no tile is read: the files get hard links in the map, or
/// are copied if the file system has no hard links. Shards are opened one at a time and are unchanged. A killed call
/// can be repeated; it first removes what the killed call has left. The shards must not have a writer. Removing them
/// does not affect the map. The map is created on the disk of the shards, and appears only when it is complete, see
/// [`MapWriter`](super::MapWriter). `progress` receives the number of tiles done and in total.
///
/// # Errors
///
/// No shard, shards with different ids, parameters or storage, or with a common tile, a kept scan that differs or is
/// missing, a file that is missing or of another length than in the log of its shard, an output with other content, or
/// an I/O error.
pub fn join(
    shards: &[MapPath],
    output: impl AsRef<Path>,
    mut progress: impl FnMut(u64, u64),
) -> Result<WrittenMap> {
    let open = |shard: &MapPath| MapReader::open(shard.clone(), 0);
    let [first, ..] = shards else {
        return Err(Error::argument("shards", "name one or more"));
    };
    let first = open(first)?;
    let Some(map_id) = first.map_id() else {
        let reason = "a map of the original format; shards need an id";
        return Err(Error::argument(first.folder().display().to_string(), reason));
    };
    let (mut config, mut regions, mut all) = (first.config().clone(), Regions::of(&first)?, 0);
    let mut parts = Vec::new();
    for path in shards {
        let shard = open(path)?;
        check_matches(&shard, &first)?;
        config.crs = with_crs_of(config.crs, &shard)?;
        if shard.config().rays.region != first.config().rays.region {
            config.rays.region = None;
        }
        regions.add(&shard)?;
        all += shard.tile_indices().len() as u64;
        if shard.keeps_scans() {
            parts.push(Part::of_shard(path, &shard));
        }
    }
    let region = config.rays.region;
    let one_build = regions.one_build();
    let region = one_build.map_or(region, |build| build.region);
    let mut writer = begin(&first, output.as_ref(), config, one_build, map_id)?;
    if !parts.is_empty() {
        unite_scans(&mut writer, parts, region, false)?;
    }
    let mut done = 0;
    writer.link_all(shards.iter().map(open), || {
        progress(done, all);
        done += 1;
    })?;
    progress(all, all);
    writer.finish()
}

fn check_matches(shard: &MapReader, first: &MapReader) -> Result<()> {
    check_grid(shard, first)?;
    check_model(shard, first)?;
    let [found, wanted] = [shard, first].map(|map| map.map_id().map(|id| hex(&id)).unwrap_or_default());
    let [storage, wanted_storage] = [shard, first].map(|map| map.config().storage);
    let path = shard.folder().to_owned();
    if found != wanted {
        Err(Error::Mismatch { path, what: "the id", found, wanted })
    } else if shard.keeps_scans() != first.keeps_scans() {
        let [found, wanted] =
            [shard, first].map(|map| if map.keeps_scans() { "kept" } else { "not kept" }.to_owned());
        Err(Error::Mismatch { path, what: "the scans", found, wanted })
    } else if storage != wanted_storage {
        let [found, wanted] = [storage, wanted_storage].map(|storage| format!("{storage:?}"));
        Err(Error::Mismatch { path, what: "the storage", found, wanted })
    } else {
        Ok(())
    }
}
