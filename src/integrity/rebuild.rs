//! Rebuilds the index of a map from the readable remains of `metadata.json`, `commits.log` and tiles.

use super::snapshots::last_known_flush;
use crate::config::RayConfig;
use crate::config::{MapConfig, Storage};
use crate::error::{Error, FormatError, Result, is_of_medium};
use crate::persistence::load::{ReadTable, read_stored_table};
use crate::space::{Grid, TileIndex};
use crate::store::{
    CatalogVersion, Checksumming, Commits, Disk, Extension, FileChecksum, Layout, MAX_NUMBER, MapParameters,
    Metadata, Salvage, Snapshot, StoredTile, TileFile, TileVersion, catalog_generations, hex, id_from_hex,
    tile_of_folder,
};
use crate::tile::format::{Trailer, read_compact_front, read_trailer};
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Rebuilt index of a map.
pub(super) struct Index {
    pub map_id: [u8; 16],
    pub metadata: Metadata,
    pub commits: Commits,
    /// Tiles whose valid table is the `*.next` file, with the state of the table that it replaces.
    pub waiting: BTreeMap<TileIndex, Replaced>,
    /// Tiles without a usable table.
    pub damaged: Vec<(TileIndex, Error)>,
    /// Whether the tiles may be of different flushes, because there is no log.
    pub is_from_tiles: bool,
    /// Whether it is unknown if the map keeps scans: neither of its files is readable, or there are catalogs that
    /// neither the map nor a snapshot names.
    pub are_scans_unknown: bool,
    /// Number of inputs removed from the metadata, because the tiles may lack some of their scans.
    pub inputs_forgotten: u64,
}

/// State of a table that a `*.next` file replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Replaced {
    /// Intact, and of an earlier flush.
    Older,
    /// Damaged or missing.
    Unusable,
}

/// Rebuilds the index. Returns `None` for a map of the original format, which has none.
///
/// # Errors
///
/// Too little data to identify the map, or an I/O error.
pub(super) fn index_of(
    disk: &dyn Disk,
    layout: &Layout,
    remains: &Salvage,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Option<Index>> {
    if let Some((map_id, mut metadata)) = identity_from_log(disk, layout, remains)? {
        clear_scan_records(&mut metadata);
        let commits = remains.commits.clone();
        return Ok(Some(Index {
            map_id,
            metadata,
            commits,
            waiting: BTreeMap::new(),
            damaged: Vec::new(),
            is_from_tiles: false,
            are_scans_unknown: false,
            inputs_forgotten: 0,
        }));
    }
    if let Ok(metadata) = &remains.metadata
        && metadata.ext.is_none()
    {
        return Ok(None);
    }
    index_from_tiles(disk, layout, remains, progress).map(Some)
}

/// Clears the number of records in the list of scans, which is unknown for a rebuilt index.
fn clear_scan_records(metadata: &mut Metadata) {
    if let Some(ext) = &mut metadata.ext {
        ext.scan_records = None;
    }
}

/// Returns id and metadata of the log, if the log is known to end with the last flush.
fn identity_from_log(
    disk: &dyn Disk,
    layout: &Layout,
    remains: &Salvage,
) -> Result<Option<([u8; 16], Metadata)>> {
    let (Some(map_id), Some(logged)) = (remains.log_map_id, &remains.commits.metadata) else {
        return Ok(None);
    };
    let Some(logged_id) = id_of(logged) else { return Ok(None) };
    // The incomplete last record may belong to a flush that was committed or to one that was not.
    let is_whole = remains.commits.torn.is_none();
    let is_last = match &remains.metadata {
        Ok(Metadata { ext: Some(ext), .. }) if ext.map_id == hex(&map_id) => {
            ext.flush_number <= remains.commits.flush_number
        }
        // One of the two files belongs to another map. The tiles decide which.
        Ok(Metadata { ext: Some(_), .. }) => {
            is_whole && logged_id == map_id && {
                let trailers = Trailers::of(disk, layout, &tiles_of(disk, layout)?);
                trailers.most().is_some_and(|trailer| trailer.map_id == map_id)
            }
        }
        _ => is_whole,
    };
    Ok(is_last.then(|| (map_id, logged.clone())))
}

/// Returns the id in the metadata; `None` in the original format.
fn id_of(metadata: &Metadata) -> Option<[u8; 16]> {
    id_from_hex(&metadata.ext.as_ref()?.map_id)
}

/// Lists the tiles that have a folder, in order.
fn tiles_of(disk: &dyn Disk, layout: &Layout) -> Result<Vec<TileIndex>> {
    let names = disk.list(layout.folder()).map_err(|error| Error::io(layout.folder(), "list", error))?;
    let mut tiles: Vec<_> = names.iter().filter_map(|name| tile_of_folder(name)).collect();
    tiles.sort_unstable();
    Ok(tiles)
}

fn index_from_tiles(
    disk: &dyn Disk,
    layout: &Layout,
    remains: &Salvage,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Index> {
    let tiles = tiles_of(disk, layout)?;
    let trailers = Trailers::of(disk, layout, &tiles);
    let (map_id, mut metadata) = identity(layout, remains, &trailers)?;
    clear_scan_records(&mut metadata);
    let config = crate::persistence::config_from(&metadata, &layout.metadata())?;
    // Ignore the numbers in files of another map.
    let written = remains.metadata.as_ref().ok().filter(|metadata| id_of(metadata) == Some(map_id));
    let logged_id = remains.log_map_id.or_else(|| id_of(remains.commits.metadata.as_ref()?));
    let logged = Some(&remains.commits).filter(|_| logged_id.is_none_or(|id| id == map_id));
    let (logged_flush, logged_scan) =
        logged.map_or((0, 0), |commits| (commits.flush_number, commits.scan_number));
    let known_scan = written.and_then(|metadata| metadata.ext.as_ref()).map(|ext| ext.scan_number);
    let written_flush = written.and_then(|metadata| metadata.ext.as_ref()).map(|ext| ext.flush_number);
    let known_flush = last_known_flush(disk, layout, map_id, &tiles);
    // A tile of an earlier flush is indistinguishable from one that the last scans did not change. So the number of
    // ingested scans is unknown, and the inputs cannot be resumed.
    let inputs = metadata.ext.as_mut().map(|ext| std::mem::take(&mut ext.inputs)).unwrap_or_default();
    let mut index = Index {
        map_id,
        metadata,
        commits: Commits {
            flush_number: known_flush.max(written_flush.unwrap_or(0)).max(logged_flush) + 1,
            scan_number: known_scan.unwrap_or(0).max(logged_scan),
            ..Commits::default()
        },
        waiting: BTreeMap::new(),
        damaged: Vec::new(),
        is_from_tiles: true,
        are_scans_unknown: false,
        inputs_forgotten: inputs.len() as u64,
    };
    index.join_snapshots(disk, layout, written);
    let logged_catalog = logged.and_then(|commits| commits.catalog);
    index.choose_catalog(disk, layout, [catalog_of(written), logged_catalog]);
    for (done, &tile) in (1..).zip(&tiles) {
        index.add(disk, layout, &config, tile, known_scan)?;
        progress(done, tiles.len() as u64);
    }
    let files = [written, logged.and_then(|commits| commits.metadata.as_ref())];
    if files.into_iter().flatten().all(|metadata| metadata.ext.is_none())
        && let Some(ext) = &mut index.metadata.ext
    {
        // Tiles do not record their decay. Assume that all evidence has decayed: too little decay is better than
        // repeated decay.
        ext.decayed_scan = index.commits.scan_number;
        index.are_scans_unknown = true;
    }
    Ok(index)
}

impl Index {
    /// Sets the snapshots to those that `metadata.json` names and those that exist: without the log, deleted ones
    /// cannot be excluded. Without a list all files in the folder count.
    fn join_snapshots(&mut self, disk: &dyn Disk, layout: &Layout, written: Option<&Metadata>) {
        let Some(ext) = &mut self.metadata.ext else { return };
        ext.snapshots = written.and_then(|metadata| metadata.ext.as_ref()?.snapshots.clone());
        let Some(listed) = &mut ext.snapshots else { return };
        for name in Snapshot::list(disk, layout).unwrap_or_default() {
            if !listed.contains(&name)
                && let Ok(snapshot) = Snapshot::read(disk, layout, &name, self.map_id, None)
            {
                listed.insert(name, Some(snapshot.commits.flush_number));
            }
        }
    }

    /// Chooses the catalog of kept scans: the newest one that the map's files or a snapshot prove to be committed. If
    /// there is a newer file, scans may have been removed since: then the kept scans are unknown, and no catalog is
    /// named.
    fn choose_catalog(&mut self, disk: &dyn Disk, layout: &Layout, named: [Option<CatalogVersion>; 2]) {
        let mut chosen = named.into_iter().flatten().max().map(|catalog| (catalog, 0));
        let (mut of_snapshots, mut of_repairs) = (BTreeSet::new(), BTreeSet::new());
        for name in Snapshot::list(disk, layout).unwrap_or_default() {
            let Ok(snapshot) = Snapshot::read(disk, layout, &name, self.map_id, None) else { continue };
            let Commits { flush_number, scan_number, catalog: Some(catalog), .. } = snapshot.commits else {
                continue;
            };
            of_snapshots.insert(catalog.generation);
            if catalog.generation > flush_number {
                // Written by a repair for the snapshot: it never belonged to the map.
                of_repairs.insert(catalog.generation);
            } else if chosen.is_none_or(|(chosen, _)| chosen < catalog) {
                chosen = Some((catalog, scan_number));
            }
        }
        let generations = catalog_generations(disk, layout);
        // Later catalogs must not reuse the name of an existing one.
        let newest = generations.last().copied().unwrap_or_default();
        self.commits.flush_number = self.commits.flush_number.max(newest + 1);
        if !self.metadata.ext.as_ref().is_some_and(|ext| ext.keeps_scans) {
            self.are_scans_unknown = generations.iter().any(|generation| !of_snapshots.contains(generation));
            return;
        }
        let Some((catalog, scan_number)) = chosen else { return };
        let is_newer =
            |generation: &u64| *generation > catalog.generation && !of_repairs.contains(generation);
        if generations.iter().any(is_newer) {
            self.commits.catalog = Some(CatalogVersion::NONE);
        } else {
            self.commits.catalog = Some(catalog);
            self.commits.scan_number = self.commits.scan_number.max(scan_number);
        }
    }

    fn add(
        &mut self,
        disk: &dyn Disk,
        layout: &Layout,
        config: &MapConfig,
        tile: TileIndex,
        known_scan: Option<u64>,
    ) -> Result<()> {
        let read = |file: &Path| read_alone(disk, file, layout.storage(), &config.grid, self.map_id, tile);
        let (current, next) = (layout.current(tile, TileFile::Table), layout.next(tile, TileFile::Table));
        let table = match (read(&current)?, read(&next)?) {
            // The `*.next` table is older than the last known flush, so that flush contains it, and it should have
            // replaced the current table.
            (Some(Ok(table)), Some(Ok(next)))
                if scan_number_of(&table) < scan_number_of(&next) && scan_number_of(&next) <= known_scan =>
            {
                self.waiting.insert(tile, Replaced::Older);
                next
            }
            (Some(Ok(table)), _) => table,
            (_, Some(Ok(table))) if scan_number_of(&table) <= known_scan => {
                self.waiting.insert(tile, Replaced::Unusable);
                table
            }
            (Some(Err(error)), _) => {
                self.damaged.push((tile, error));
                return Ok(());
            }
            (None, next_table) => {
                let folder = layout.tile_folder(tile);
                let is_kept = |name: &String| layout.flush_of_kept(name).is_some();
                let (path, reason) = match next_table {
                    Some(_) => (&next, "it is unknown whether this version was committed"),
                    // Perhaps a removed tile that a snapshot uses.
                    None if disk.list(&folder).is_ok_and(|names| names.iter().all(is_kept)) => return Ok(()),
                    None => (&current, "the file is missing"),
                };
                self.damaged.push((tile, FormatError::at_offset(0, reason).in_map(path, Some(tile))));
                return Ok(());
            }
        };
        let version = version_of(&table, config);
        self.commits.scan_number = self.commits.scan_number.max(version.scan_number);
        self.commits.tiles.insert(tile, version);
        Ok(())
    }
}

fn catalog_of(written: Option<&Metadata>) -> Option<CatalogVersion> {
    written?.ext.as_ref()?.catalog
}

fn scan_number_of(table: &ReadTable) -> Option<u64> {
    table.trailer.as_ref().map(|trailer| trailer.scan_number)
}

/// Reads a table without the log. It must be intact and belong to this map and tile. Returns `None` if there is no
/// file.
pub(super) fn read_alone(
    disk: &dyn Disk,
    path: &Path,
    storage: Storage,
    grid: &Grid,
    map_id: [u8; 16],
    tile: TileIndex,
) -> Result<Option<Result<ReadTable>>> {
    let input = match disk.open(path) {
        Ok(input) => input,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) if error.kind() == std::io::ErrorKind::InvalidInput => {
            let error = FormatError::at_offset(0, error.to_string()).in_map(path, Some(tile));
            return Ok(Some(Err(error)));
        }
        Err(error) if is_of_medium(&error) => return Ok(Some(Err(Error::io(path, "open", error)))),
        Err(error) => return Err(Error::io(path, "open", error)),
    };
    let bytes = input.file_bytes();
    let (path, input, map_id) = (path.to_owned(), Checksumming::new(input), Some(map_id));
    match read_stored_table(grid, tile, StoredTile { path, input, bytes, map_id, version: None, storage }) {
        Err(error) if matches!(error, Error::Damaged { .. }) || error.is_of_medium() => Ok(Some(Err(error))),
        Err(error) => Err(error),
        Ok(table) => Ok(Some(Ok(table))),
    }
}

fn version_of(table: &ReadTable, config: &MapConfig) -> TileVersion {
    let threshold = config.occupied_log_odds();
    let occupied = table.table.iter().filter(|(_, evidence)| evidence.log_odds >= threshold).count();
    let trailer = table.trailer.as_ref();
    TileVersion {
        // The number in a file may be invalid. Limit it, so that numbering can continue.
        scan_number: trailer.map_or(0, |trailer| trailer.scan_number.min(MAX_NUMBER)),
        table: table.file,
        octree: trailer.map_or(FileChecksum::default(), |trailer| FileChecksum {
            bytes: trailer.octree_bytes,
            crc: trailer.octree_crc,
        }),
        voxels: table.table.len() as u64,
        occupied: occupied as u64,
    }
}

/// Map ids in the trailers of tiles.
struct Trailers {
    /// For each map id, one trailer and the number of tiles.
    by_map: FxHashMap<[u8; 16], (Trailer, u64)>,
}

impl Trailers {
    fn of(disk: &dyn Disk, layout: &Layout, tiles: &[TileIndex]) -> Self {
        let mut by_map: FxHashMap<_, (Trailer, u64)> = FxHashMap::default();
        let read = |path: &Path| {
            let mut input = disk.open(path).ok()?;
            let bytes = input.file_bytes();
            match layout.storage() {
                Storage::OctoMap => read_trailer(&mut input, bytes).ok()?,
                Storage::Compact => read_compact_front(&mut input, bytes).ok(),
            }
        };
        for &tile in tiles {
            let paths = [layout.current(tile, TileFile::Table), layout.next(tile, TileFile::Table)];
            if let Some(trailer) = paths.iter().find_map(|path| read(path)) {
                by_map.entry(trailer.map_id).or_insert((trailer, 0)).1 += 1;
            }
        }
        Self { by_map }
    }

    /// Returns whether there are tiles, and all of them belong to other maps.
    fn are_of_others(&self, map_id: [u8; 16]) -> bool {
        !self.by_map.is_empty() && !self.by_map.contains_key(&map_id)
    }

    /// Returns a trailer of the map that most tiles belong to.
    fn most(&self) -> Option<&Trailer> {
        let most = self.by_map.values().max_by_key(|(trailer, count)| (*count, trailer.map_id));
        most.map(|(trailer, _)| trailer)
    }
}

/// Returns id and metadata from the best remaining source.
fn identity(layout: &Layout, remains: &Salvage, trailers: &Trailers) -> Result<([u8; 16], Metadata)> {
    let written = remains.metadata.as_ref().ok().filter(|metadata| metadata.ext.is_some());
    let logged = remains.commits.metadata.as_ref().filter(|metadata| metadata.ext.is_some());
    let of_tiles = trailers.most();
    // If the two files disagree, the tiles decide.
    let candidates =
        [written, logged].into_iter().flatten().filter_map(|metadata| Some((id_of(metadata)?, metadata)));
    let mut candidates: Vec<_> = candidates.collect();
    candidates.sort_by_key(|(id, _)| of_tiles.is_some_and(|trailer| trailer.map_id != *id));
    match &candidates[..] {
        // A single file that matches no tile belongs to another map.
        [(id, _)] if trailers.are_of_others(*id) => {}
        [(id, metadata), ..] => return Ok((*id, (*metadata).clone())),
        [] => {}
    }
    let Some(trailer) = of_tiles else {
        let reason = "no readable metadata.json, commits.log or tile with a trailer identifies the map; \
                      write metadata.json with its resolution and tile size by hand";
        return Err(FormatError::at_offset(0, reason).in_map(&layout.metadata(), None));
    };
    let path = layout.current(trailer.tile, TileFile::Table);
    let parameters = MapParameters::from_text(&trailer.parameters)
        .map_err(|error| error.in_map(&path, Some(trailer.tile)))?;
    let ext = Extension {
        empty: false,
        map_id: hex(&trailer.map_id),
        flush_number: 0,
        scan_number: 0,
        sensor_model: parameters.sensor_model,
        occupancy_threshold: parameters.occupancy_threshold,
        rays: RayConfig { clearing: parameters.clearing, ..RayConfig::default() },
        inputs: Vec::new(),
        decayed_scan: 0,
        storage: layout.storage(),
        layers: parameters.layers,
        crs: None,
        keeps_scans: false,
        keeps_motion: false,
        catalog: None,
        scan_records: None,
        snapshots: None,
    };
    let (resolution_m, tile_size_m) = (parameters.resolution, parameters.tile_size);
    Ok((trailer.map_id, Metadata { resolution_m, tile_size_m, bounds: None, ext: Some(ext) }))
}
