//! Operations on whole maps on disk. Each returns a dict with the fields that the command prints.

use crate::arrays::object;
use crate::config::storage_of;
use crate::errors::{exception, wrong};
use crate::map::region_of;
use crate::watched::{Progress, watched_with_progress};
use pyo3::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use voxtile::integrity::VerifyScope;
use voxtile::mapper::{MapReader, MapView, OctreeMap};
use voxtile::operations::{self, AreaPart, CopyScans, Decay, MaxAge, Part, Prefer};
use voxtile::space::Grid;
use voxtile::store::InputRecord;
use voxtile::{MapPath, MemoryLimit, Result, SnapshotName, Stop, TileIndex, integrity};
use voxtile_pipeline::place::{check_is_folder, place_of};
use voxtile_pipeline::{PolygonFile, check_is_no_file, octree_file};

/// A map, or a tuple of a map and the name of a snapshot.
#[derive(FromPyObject)]
pub enum MapOrSnapshot {
    /// Folder of a map.
    Map(PathBuf),
    /// Folder of a map and name of a snapshot.
    Snapshot(PathBuf, String),
}

impl MapOrSnapshot {
    /// Name of the map in messages.
    pub fn name(&self) -> PathBuf {
        match self {
            Self::Map(path) => path.clone(),
            Self::Snapshot(path, name) => named_snapshot(path, name),
        }
    }

    pub fn open(&self) -> Result<MapReader> {
        match self {
            Self::Map(path) => MapReader::open(place_to_read(path)?, MemoryLimit::DEFAULT_BYTES),
            Self::Snapshot(path, name) => MapReader::open_snapshot(
                place_to_read(path)?,
                &SnapshotName::new(name)?,
                MemoryLimit::DEFAULT_BYTES,
            ),
        }
    }
}

/// Name of a snapshot, as the command takes it.
pub fn named_snapshot(map: &Path, name: &str) -> PathBuf {
    PathBuf::from(format!("{}@{name}", map.display()))
}

/// Returns the folder of a map to change, or an error for a file and for a map in a bucket.
pub fn folder_of(map: &Path) -> Result<&Path> {
    check_is_no_file(map).and_then(|()| check_is_folder(map)).map(|()| map)
}

/// Returns the folder or the bucket of a map to read, or an error for a file.
fn place_to_read(map: &Path) -> Result<MapPath> {
    check_is_no_file(map).and_then(|()| place_of(map))
}

pub type Callback = Option<Py<PyAny>>;

/// Runs `work` and returns its report as a dict.
pub fn reported<'py, T: Serialize + Send>(
    py: Python<'py>,
    progress: Callback,
    work: impl FnOnce(&Stop, &Progress<'_>) -> Result<T> + Send,
) -> PyResult<Bound<'py, PyAny>> {
    object(py, &watched_with_progress(py, progress, work)?)
}

pub fn name_of(py: Python<'_>, name: &str) -> PyResult<SnapshotName> {
    SnapshotName::new(name).map_err(|error| exception(py, &error))
}

fn part_of(region: &Bound<'_, PyAny>, outside: bool) -> PyResult<Part> {
    let region = region_of(region)?;
    Ok(if outside { Part::Outside(region) } else { Part::Inside(region) })
}

/// Lists the snapshots of a map, ordered by flush and then by name: a list of dicts.
#[pyfunction]
pub fn snapshots<'py>(py: Python<'py>, map: PathBuf) -> PyResult<Bound<'py, PyAny>> {
    reported(py, None, |_, _| operations::snapshots(place_to_read(&map)?))
}

/// Deletes a snapshot and frees the tiles that only this snapshot uses.
#[pyfunction]
pub fn delete_snapshot(py: Python<'_>, map: PathBuf, name: &str) -> PyResult<()> {
    let name = name_of(py, name)?;
    watched_with_progress(py, None, |_, _| operations::delete_snapshot(folder_of(&map)?, &name))
}

/// Compares two maps, or snapshots `(map, name)`. Returns a dict of sums, with a list of the tiles that differ in
/// `"differing"`.
#[pyfunction]
#[pyo3(signature = (first, second, *, progress=None))]
pub fn diff<'py>(
    py: Python<'py>,
    first: MapOrSnapshot,
    second: MapOrSnapshot,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let mut tiles = Vec::new();
    let sums = reported(py, progress, |_, progress| {
        operations::diff(
            &first.open()?,
            &second.open()?,
            |tile| tiles.push(tile),
            |done, all| progress.report(done, all),
        )
    })?;
    sums.set_item("differing", object(py, &tiles)?)?;
    Ok(sums)
}

/// Reverts a map to a snapshot. `keep_as` first keeps the current state as another snapshot.
#[pyfunction]
#[pyo3(signature = (map, name, *, keep_as=None, progress=None))]
pub fn revert<'py>(
    py: Python<'py>,
    map: PathBuf,
    name: &str,
    keep_as: Option<&str>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let (name, keep_as) = (name_of(py, name)?, keep_as.map(|name| name_of(py, name)).transpose()?);
    reported(py, progress, |_, progress| {
        operations::revert(folder_of(&map)?, &name, keep_as.as_ref(), |done, all| progress.report(done, all))
    })
}

/// Merges maps of the same resolution and tile size into a new one. `prefer` is "first", "last" or "more-observed";
/// without it the log-odds of a voxel are added.
#[pyfunction]
#[pyo3(signature = (maps, output, *, prefer=None, progress=None))]
pub fn merge<'py>(
    py: Python<'py>,
    maps: Vec<MapOrSnapshot>,
    output: PathBuf,
    prefer: Option<&str>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let prefer = match prefer {
        None => None,
        Some("first") => Some(Prefer::First),
        Some("last") => Some(Prefer::Last),
        Some("more-observed") => Some(Prefer::MoreObserved),
        Some(other) => {
            let reason = format!("{other:?} is not one of 'first', 'last', 'more-observed'");
            return Err(wrong(py, "prefer", reason));
        }
    };
    reported(py, progress, |_, progress| {
        let maps = maps.iter().map(MapOrSnapshot::open).collect::<Result<Vec<_>>>()?;
        operations::merge(&maps, folder_of(&output)?, prefer, |done, all| progress.report(done, all))
    })
}

/// Moves a map to its place as a shard of a map that `join` will make, and makes it durable. `map_id` is the id of that
/// map, 32 hexadecimal digits. A map with another id, or on another file system, is copied, and every byte of its tiles
/// is checked against the log.
#[pyfunction]
#[pyo3(signature = (map, output, map_id, *, progress=None))]
pub fn move_shard<'py>(
    py: Python<'py>,
    map: PathBuf,
    output: PathBuf,
    map_id: &str,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let id = map_id_of(py, "map_id", map_id)?;
    reported(py, progress, |_, progress| {
        operations::move_shard(&map, &output, id, |done, all| progress.report(done, all))
    })
}

/// Parses the id of a map: 32 hexadecimal digits.
pub fn map_id_of(py: Python<'_>, argument: &str, digits: &str) -> PyResult<[u8; 16]> {
    let id = u128::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 32);
    let reason = || format!("{digits:?} is not 32 hexadecimal digits");
    id.map(u128::to_be_bytes).ok_or_else(|| wrong(py, argument, reason()))
}

/// Digest of the scans that a map keeps, in their order, as `voxtile digest --scans` prints it. The same scans have the
/// same digest, whatever map keeps them.
#[pyfunction]
pub fn scan_digest(py: Python<'_>, map: MapOrSnapshot) -> PyResult<String> {
    let digest = py.detach(|| map.open().and_then(|map| voxtile_pipeline::scan_digest(&map)));
    digest.map(|digest| digest.to_string()).map_err(|error| exception(py, &error))
}

/// Joins shards with the same id and disjoint tiles into one map, without reading their tiles.
#[pyfunction]
#[pyo3(signature = (shards, output, *, progress=None))]
pub fn join<'py>(
    py: Python<'py>,
    shards: Vec<PathBuf>,
    output: PathBuf,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    reported(py, progress, |_, progress| {
        let shards: Vec<MapPath> = shards.into_iter().map(MapPath::from).collect();
        operations::join(&shards, &output, |done, all| progress.report(done, all))
    })
}

/// Replaces tiles of a map by those of shards, in one commit. The shards were made from the map at the flush
/// `of_flush`, and each holds other tiles; `scans` is the number of scans they add, of an input with the name `input`.
#[pyfunction]
#[pyo3(signature = (map, parts, *, of_flush, scans, input=None, progress=None))]
pub fn replace_tiles<'py>(
    py: Python<'py>,
    map: PathBuf,
    parts: Vec<PathBuf>,
    of_flush: u64,
    scans: u64,
    input: Option<&str>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    reported(py, progress, |_, progress| {
        let parts = parts
            .iter()
            .map(|part| MapReader::open(part, MemoryLimit::DEFAULT_BYTES))
            .collect::<Result<Vec<_>>>()?;
        operations::replace_tiles(&map, &parts, of_flush, scans, input, |done, all| {
            progress.report(done, all)
        })
    })
}

/// Returns the tile size in metres that a new map of a resolution in metres has by default.
#[pyfunction]
pub fn default_tile_size(py: Python<'_>, resolution: f64) -> PyResult<f64> {
    match Grid::with_resolution(resolution) {
        Ok(grid) => Ok(grid.tile_size_m()),
        Err(error) => Err(exception(py, &error.into())),
    }
}

/// Describes a map: id, flush and scan numbers, number of records in its list of scans (`None` if unknown), grid and
/// range in metres, whether it keeps its scans, inputs.
#[pyfunction]
pub fn describe<'py>(py: Python<'py>, map: MapOrSnapshot) -> PyResult<Bound<'py, PyAny>> {
    reported(py, None, |_, _| {
        let map = map.open()?;
        let described = Described {
            map_id: map.metadata().ext.as_ref().map(|ext| ext.map_id.clone()),
            flush_number: map.flush_number(),
            scan_number: map.scan_number(),
            scan_records: map.metadata().ext.as_ref().and_then(|ext| ext.scan_records),
            keeps_scans: map.keeps_scans(),
            inputs: map
                .metadata()
                .ext
                .as_ref()
                .map_or(vec![], |ext| ext.inputs.iter().map(Input::of).collect()),
            resolution: map.config().grid.resolution_m(),
            tile_size: map.config().grid.tile_size_m(),
            max_range: map.config().rays.max_range_m,
        };
        Ok(described)
    })
}

/// Input of a map: its name, and the number of scans before it.
#[derive(Serialize)]
struct Input {
    name: String,
    first_scan: u64,
}

impl Input {
    fn of(input: &InputRecord) -> Self {
        Self { name: input.name.clone(), first_scan: input.first_scan }
    }
}

/// Report of [`describe`].
#[derive(Serialize)]
struct Described {
    map_id: Option<String>,
    flush_number: u64,
    scan_number: u64,
    scan_records: Option<u64>,
    keeps_scans: bool,
    inputs: Vec<Input>,
    resolution: f64,
    tile_size: f64,
    max_range: Option<f64>,
}

/// Makes a map of the part of another that is inside a box, or outside it. `polygon` replaces the box: a GeoJSON file of
/// polygons in the map's coordinates, with heights `z`, the lowest and the highest, in metres (default: all). With
/// `keep_scans` the new map keeps the kept scans that reach the part (see `voxtile crop --keep-scans`). With `shard_of`
/// it makes a shard of the map with this id, which with `keep_scans` keeps the scans that are added to it; the shard is not durable until `move_shard` has moved it.
#[pyfunction]
#[pyo3(signature = (map, output, region=None, *, polygon=None, z=None, outside=false, keep_scans=false, shard_of=None,
    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn crop<'py>(
    py: Python<'py>,
    map: MapOrSnapshot,
    output: PathBuf,
    region: Option<&Bound<'py, PyAny>>,
    polygon: Option<PathBuf>,
    z: Option<[f64; 2]>,
    outside: bool,
    keep_scans: bool,
    shard_of: Option<&str>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let scans = if keep_scans { CopyScans::Yes } else { CopyScans::No };
    let region = match (region, polygon) {
        (Some(region), None) if z.is_none() => region,
        (None, Some(_)) if shard_of.is_some() => {
            return Err(wrong(py, "shard_of", "cannot be combined with `polygon`; pass a region"));
        }
        (None, Some(polygon)) => {
            let z_m = z.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            return reported(py, progress, |_, progress| {
                let (file, map) = (PolygonFile::read(&polygon)?, map.open()?);
                let part = AreaPart { area: file.area_in(&map)?, z_m, is_outside: outside };
                operations::crop_area(&map, &part, scans, &output, |done, all| progress.report(done, all))
            });
        }
        (Some(_), None) => return Err(wrong(py, "z", "belongs to `polygon`; a region has its own heights")),
        _ => return Err(wrong(py, "region", "pass either `region` or `polygon`")),
    };
    let part = part_of(region, outside)?;
    let shard_of = shard_of.map(|digits| map_id_of(py, "shard_of", digits)).transpose()?;
    reported(py, progress, |_, progress| {
        let report = |done, all| progress.report(done, all);
        match shard_of {
            None => operations::crop(&map.open()?, &part, scans, folder_of(&output)?, report),
            Some(map_id) => {
                let output = folder_of(&output)?;
                operations::crop_shard(&map.open()?, &part, keep_scans, output, map_id, report)
            }
        }
    })
}

/// Makes a map of the same content with another storage, "octomap" or "compact". With `keep_scans=False` it does not get
/// the scans that the map keeps.
#[pyfunction]
#[pyo3(signature = (map, output, storage, *, keep_scans=true, progress=None))]
pub fn convert<'py>(
    py: Python<'py>,
    map: MapOrSnapshot,
    output: PathBuf,
    storage: &str,
    keep_scans: bool,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let storage = storage_of(py, storage)?;
    let scans = if keep_scans { CopyScans::Yes } else { CopyScans::No };
    reported(py, progress, |_, progress| {
        let output = folder_of(&output)?;
        operations::convert(&map.open()?, output, storage, scans, |done, all| progress.report(done, all))
    })
}

/// Makes a map of a file of OctoMap.
#[pyfunction]
#[pyo3(signature = (file, output, *, storage="octomap", progress=None))]
pub fn import_octree<'py>(
    py: Python<'py>,
    file: PathBuf,
    output: PathBuf,
    storage: &str,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let storage = storage_of(py, storage)?;
    reported(py, progress, |_, progress| {
        let map = OctreeMap::of(octree_file::read(&file)?)?;
        operations::import(&map, folder_of(&output)?, storage, |done, all| progress.report(done, all))
    })
}

/// Removes all voxels inside a box, or outside it.
#[pyfunction]
#[pyo3(signature = (map, region, *, outside=false, progress=None))]
pub fn clear<'py>(
    py: Python<'py>,
    map: PathBuf,
    region: &Bound<'py, PyAny>,
    outside: bool,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let part = part_of(region, outside)?;
    reported(py, progress, |_, progress| {
        operations::clear(folder_of(&map)?, &part, |done, all| progress.report(done, all))
    })
}

/// Decays evidence: log-odds halve every `halflife_scans` scans. `scans` is the number of scans that have passed, by
/// default those since the last decay. Log-odds closer to 0 than `forget_below` are removed.
#[pyfunction]
#[pyo3(signature = (map, halflife_scans, *, scans=None, forget_below=0.0, progress=None))]
pub fn decay<'py>(
    py: Python<'py>,
    map: PathBuf,
    halflife_scans: f64,
    scans: Option<u64>,
    forget_below: f64,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let mut how = Decay::new(halflife_scans).with_forget_below(forget_below);
    how.scans = scans;
    reported(py, progress, |_, progress| {
        operations::decay(folder_of(&map)?, &how, |done, all| progress.report(done, all))
    })
}

/// Makes occupied voxels unknown that no scan has hit for more than `seconds`. Ages count from the map's last hit, or
/// from `now_ns`. The map needs the layer time; free voxels and those without a time remain.
#[pyfunction]
#[pyo3(signature = (map, seconds, *, now_ns=None, progress=None))]
pub fn forget_old<'py>(
    py: Python<'py>,
    map: PathBuf,
    seconds: f64,
    now_ns: Option<i64>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let age = Duration::try_from_secs_f64(seconds)
        .map_err(|_| wrong(py, "seconds", format!("must be at least 0 and finite, not {seconds}")))?;
    let rule = now_ns.map_or(MaxAge::new(age), |now_ns| MaxAge::new(age).with_now(now_ns));
    reported(py, progress, |_, progress| {
        operations::forget_old(folder_of(&map)?, &rule, |done, all| progress.report(done, all))
    })
}

/// Checks every file of a map. Returns a dict of sums, with a list of problems in `"findings"`. The map is intact if
/// `"damage"` is 0. With `tiles`, only the files of these tiles are checked; with `but_tiles`, all files that belong to
/// no tile.
#[pyfunction]
#[pyo3(signature = (map, *, tiles=None, but_tiles=false, progress=None))]
pub fn verify<'py>(
    py: Python<'py>,
    map: PathBuf,
    tiles: Option<Vec<[i32; 3]>>,
    but_tiles: bool,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let scope = match (tiles, but_tiles) {
        (None, false) => VerifyScope::All,
        (None, true) => VerifyScope::AllButTiles,
        (Some(tiles), false) => {
            VerifyScope::Tiles(tiles.into_iter().map(|[x, y, z]| TileIndex { x, y, z }).collect())
        }
        (Some(_), true) => {
            return Err(wrong(py, "but_tiles", "cannot be combined with tiles; leave out one of the two"));
        }
    };
    let mut findings = Vec::new();
    let sums = reported(py, progress, |_, progress| {
        integrity::verify_scope(
            place_to_read(&map)?,
            &scope,
            |finding| findings.push(finding.clone()),
            |done, all| progress.report(done, all),
        )
    })?;
    sums.set_item("findings", object(py, &findings)?)?;
    Ok(sums)
}

/// Repairs a map and moves unrecoverable files aside. Returns a dict of sums, with a list of the repairs in `"done"`.
#[pyfunction]
#[pyo3(signature = (map, *, progress=None))]
pub fn repair<'py>(py: Python<'py>, map: PathBuf, progress: Callback) -> PyResult<Bound<'py, PyAny>> {
    let mut done = Vec::new();
    let sums = reported(py, progress, |_, progress| {
        integrity::repair(
            folder_of(&map)?,
            |action| done.push(action.clone()),
            |done, all| progress.report(done, all),
        )
    })?;
    sums.set_item("done", object(py, &done)?)?;
    Ok(sums)
}
