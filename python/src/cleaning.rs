//! The search for moving points in parts, which several processes share; `voxtile.dask` uses them.

use crate::config::memory_of;
use crate::errors::wrong;
use crate::map::region_of;
use crate::operations::{folder_of, map_id_of};
use crate::remapping::replay_of;
use crate::watched::watched;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::mapper::KeptSummary;
use voxtile::store::{FsDisk, UnsyncedDisk};
use voxtile::{Error, MapPath, TileBox};
use voxtile_clean::{Clean, FoundMarks, Order, SearchMaps};

/// Checks what a replay needs, before a long search for changes. Returns the number of kept scans, the number of the
/// last one (0 without scans), and whether any has marks of moving points.
#[pyfunction]
#[pyo3(signature = (map, *, keep_as=None, memory=None))]
pub fn check_replay(
    py: Python<'_>,
    map: PathBuf,
    keep_as: Option<&str>,
    memory: Option<Bound<'_, PyAny>>,
) -> PyResult<(usize, u64, bool)> {
    let how = replay_of(py, keep_as, false, memory.as_ref())?;
    watched(py, |_| {
        let scans = KeptSummary::read(folder_of(&map)?)?;
        how.check(&scans)?;
        let scans = scans.scans();
        let has_marks = scans.iter().any(|scan| scan.moving_points > 0);
        Ok((scans.len(), scans.last().map_or(0, |scan| scan.number), has_marks))
    })
}

/// Columns of tiles, by their index in units of `tiles`, that the scans of a map reach.
#[pyfunction]
pub fn search_columns(py: Python<'_>, map: PathBuf, tiles: u32) -> PyResult<Vec<(i32, i32)>> {
    watched(py, |_| {
        let columns = voxtile_clean::search_columns(folder_of(&map)?, tiles)?;
        Ok(columns.into_iter().map(Into::into).collect())
    })
}

/// Maps of a search: the scans in reverse order, the scans without marks, counts.
type Maps = (PathBuf, Option<PathBuf>, Option<PathBuf>);

fn search_maps((reversed, unmarked, counts): Maps) -> SearchMaps {
    SearchMaps {
        reversed: reversed.into(),
        unmarked: unmarked.map(Into::into),
        counts: counts.map(Into::into),
    }
}

/// Makes a shard of a map that a search needs: of the `kind` "reversed", "unmarked" or "counts". The shard is durable
/// after `move_shard`. Counts need the other `maps`.
#[pyfunction]
#[pyo3(signature = (map, kind, column, tiles, output, *, shard_of, maps=None, memory=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn map_for_search(
    py: Python<'_>,
    map: PathBuf,
    kind: &str,
    column: [i32; 2],
    tiles: u32,
    output: PathBuf,
    shard_of: &str,
    maps: Option<Maps>,
    memory: Option<Bound<'_, PyAny>>,
) -> PyResult<()> {
    let map_id = map_id_of(py, "shard_of", shard_of)?;
    let how = replay_of(py, None, false, memory.as_ref())?;
    let (region, maps) = (TileBox::of_column(column, tiles), maps.map(search_maps));
    let order = match kind {
        "reversed" => Some(Order::Reverse),
        "unmarked" => Some(Order::Forward),
        "counts" => None,
        other => return Err(wrong(py, "kind", format!("{other:?} is no map of a search"))),
    };
    watched(py, |stop| {
        let (map, how) = (folder_of(&map)?, how.with_stop(stop.clone()));
        let disk = Arc::new(UnsyncedDisk::of(Arc::new(FsDisk)));
        let output = MapPath::on(disk, folder_of(&output)?);
        match (order, &maps) {
            (Some(order), _) => voxtile_clean::map_column(map, order, region, output, map_id, &how),
            (None, Some(maps)) => voxtile_clean::count_column(map, maps, region, output, map_id, &how),
            (None, None) => Err(Error::argument("maps", "counts need the other maps")),
        }
    })
}

/// Searches the kept scans from `first` to `last` for moving points, as `clean` does. Writes their marks to the file
/// `output`; returns a text for `replay_columns`.
#[pyfunction]
#[pyo3(signature = (map, maps, first, last, output, *, region=None, parked_scans=None, memory=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn search_moving(
    py: Python<'_>,
    map: PathBuf,
    maps: Maps,
    first: u64,
    last: u64,
    output: PathBuf,
    region: Option<Bound<'_, PyAny>>,
    parked_scans: Option<u32>,
    memory: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let region = region.as_ref().map(region_of).transpose()?;
    let (memory, maps) = (memory_of(memory.as_ref())?, search_maps(maps));
    watched(py, |stop| {
        let replay = voxtile::operations::Replay::default().with_memory(memory).with_stop(stop.clone());
        let how = Clean::new(replay).with_region(region).with_parked_scans(parked_scans);
        let found = FoundMarks::search(folder_of(&map)?, &maps, &how, first..=last, &output)?;
        serde_json::to_string(&found).map_err(|error| Error::argument("output", error.to_string()))
    })
}
