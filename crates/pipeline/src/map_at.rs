use crate::octree_file;
use crate::place::{check_is_folder, place_of};
use std::path::{Path, PathBuf};
use voxtile::mapper::{MapReader, MapStatistics, MapView, OctreeMap, TileRef};
use voxtile::space::{TileBox, TileIndex};
use voxtile::store::{SnapshotName, TileVersion};
use voxtile::tile::Voxel;
use voxtile::{Error, MapConfig, Result};

/// Cache size for tiles in commands that only read.
const TILES_BYTES: usize = 64 << 20;
/// Maximum number of attempts to read a map that a writer keeps flushing.
const ATTEMPTS: usize = 8;

/// A map or a snapshot of it.
#[derive(Clone, Debug)]
pub struct MapAt {
    /// Folder or bucket URL of the map.
    pub map: PathBuf,
    /// Name of the snapshot, if any.
    pub snapshot: Option<SnapshotName>,
}

impl MapAt {
    /// Parses `MAP` or `MAP@SNAPSHOT`. An existing file or folder with the whole name takes precedence.
    ///
    /// # Errors
    ///
    /// The name is not a valid snapshot name.
    pub fn of(path: &Path) -> Result<Self> {
        match named_snapshot(path) {
            Some((map, name)) => Ok(Self { map: map.to_owned(), snapshot: Some(SnapshotName::new(name)?) }),
            None => Ok(Self { map: path.to_owned(), snapshot: None }),
        }
    }

    /// Opens the map for reading.
    ///
    /// # Errors
    ///
    /// As for [`MapReader::open`]. Also fails for a file.
    pub fn open(&self) -> Result<MapReader> {
        check_is_no_file(&self.map)?;
        match &self.snapshot {
            Some(name) => MapReader::open_snapshot(place_of(&self.map)?, name, TILES_BYTES),
            None => MapReader::open(place_of(&self.map)?, TILES_BYTES),
        }
    }
}

/// Checks that a map is not a file. Maps are folders; OctoMap files are only supported by some commands.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for a file.
pub fn check_is_no_file(map: &Path) -> Result<()> {
    let reason = if OctreeMap::is_named_by(map) {
        "is an OctoMap file, which this command does not support: convert it to a map with `voxtile import`; info, \
         query, raycast, digest, export, picture and view read it directly"
    } else if map.is_file() {
        "is a file, but not an OctoMap file; a map is a folder, created with `voxtile build` or `import`"
    } else {
        return Ok(());
    };
    Err(Error::argument(map.display().to_string(), reason))
}

/// Splits `MAP@SNAPSHOT`, unless a file or folder with the whole name exists.
fn named_snapshot(path: &Path) -> Option<(&Path, &str)> {
    let text = path.to_str().filter(|_| std::fs::symlink_metadata(path).is_err())?;
    let (map, name) = text.rsplit_once('@')?;
    (!name.contains(std::path::is_separator)).then_some((Path::new(map), name))
}

/// A map in one of the supported forms.
pub enum AnyMap {
    /// A map or a snapshot.
    Map(Box<MapReader>),
    /// An OctoMap file.
    Octree(Box<OctreeMap>),
}

/// Forwards a method call to the variant.
macro_rules! whichever {
    ($map:expr, $method:ident($($argument:expr),*)) => {
        match $map {
            AnyMap::Map(map) => map.$method($($argument),*),
            AnyMap::Octree(map) => map.$method($($argument),*),
        }
    };
}

impl MapView for AnyMap {
    fn config(&self) -> &MapConfig {
        whichever!(self, config())
    }

    fn scan_number(&self) -> u64 {
        whichever!(self, scan_number())
    }

    fn tile_indices(&self) -> Vec<TileIndex> {
        whichever!(self, tile_indices())
    }

    fn tile_bounds(&self) -> Option<TileBox> {
        whichever!(self, tile_bounds())
    }

    fn has_tile(&self, index: TileIndex) -> bool {
        whichever!(self, has_tile(index))
    }

    fn empty_around(&self, index: TileIndex) -> Option<TileBox> {
        whichever!(self, empty_around(index))
    }

    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        whichever!(self, cached_tile_indices())
    }

    fn tile(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        whichever!(self, tile(index))
    }

    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        whichever!(self, tile_uncached(index))
    }

    fn voxels_from(&self, index: TileIndex, from: f64) -> Result<Vec<Voxel>> {
        whichever!(self, voxels_from(index, from))
    }

    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        whichever!(self, voxels_of_tile_hint(index))
    }

    fn version_of_tile(&self, index: TileIndex) -> Option<TileVersion> {
        whichever!(self, version_of_tile(index))
    }

    fn statistics(&self) -> MapStatistics {
        whichever!(self, statistics())
    }
}

/// Checks that a path names a map that can be written, not a snapshot.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for `MAP@SNAPSHOT` if there is a map at `MAP`, for a URL, and for a file.
pub fn whole_map(path: &Path) -> Result<&Path> {
    check_is_folder(path)?;
    check_is_no_file(path)?;
    if let Some((map, _)) = named_snapshot(path)
        && map.join("metadata.json").exists()
    {
        let reason = format!(
            "is a snapshot, which is read-only; use the map {}, or create a map from the snapshot with `voxtile \
             convert`",
            map.display()
        );
        return Err(Error::argument(path.display().to_string(), reason));
    }
    Ok(path)
}

/// Reads one state of a map or a snapshot (`MAP@SNAPSHOT`). If a writer flushes the map during the read, `read` is
/// called again with the new state.
///
/// # Errors
///
/// As for [`MapAt::open`], and errors of `read`.
pub fn read_map<T>(map: &Path, mut read: impl FnMut(&MapReader) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let map = MapAt::of(map)?;
    again_if_changed(|| read(&map.open()?))
}

/// Opens a map, a snapshot, or an OctoMap file.
///
/// # Errors
///
/// As for [`MapAt::open`]. Also fails for a file that is not an OctoMap file.
pub fn open_any_map(map: &Path) -> anyhow::Result<AnyMap> {
    if OctreeMap::is_named_by(map) {
        return Ok(AnyMap::Octree(Box::new(OctreeMap::of(octree_file::read(map)?)?)));
    }
    Ok(AnyMap::Map(Box::new(MapAt::of(map)?.open()?)))
}

/// As [`read_map`], also for OctoMap files.
///
/// # Errors
///
/// As for [`open_any_map`], and errors of `read`.
pub fn read_any_map<T>(map: &Path, mut read: impl FnMut(&AnyMap) -> anyhow::Result<T>) -> anyhow::Result<T> {
    again_if_changed(|| read(&open_any_map(map)?))
}

/// As [`read_any_map`], for two maps.
///
/// # Errors
///
/// As for [`open_any_map`], and errors of `read`.
pub fn read_any_maps<T>(
    first: &Path,
    second: &Path,
    mut read: impl FnMut(&AnyMap, &AnyMap) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    again_if_changed(|| read(&open_any_map(first)?, &open_any_map(second)?))
}

/// As [`read_map`], for two maps.
///
/// # Errors
///
/// As for [`MapAt::open`], and errors of `read`.
pub fn read_maps<T>(
    first: &MapAt,
    second: &MapAt,
    mut read: impl FnMut(&MapReader, &MapReader) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    again_if_changed(|| read(&first.open()?, &second.open()?))
}

/// As [`read_map`], for any number of maps.
///
/// # Errors
///
/// As for [`MapAt::open`], and errors of `read`.
pub fn read_all_maps<T>(
    maps: &[PathBuf],
    mut read: impl FnMut(&[MapReader]) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let maps = maps.iter().map(|map| MapAt::of(map)).collect::<Result<Vec<_>>>()?;
    again_if_changed(|| read(&maps.iter().map(MapAt::open).collect::<Result<Vec<_>>>()?))
}

fn again_if_changed<T>(mut attempt: impl FnMut() -> anyhow::Result<T>) -> anyhow::Result<T> {
    for _ in 1..ATTEMPTS {
        match attempt() {
            Err(error) if matches!(error.downcast_ref(), Some(Error::Changed { .. })) => {}
            outcome => return outcome,
        }
    }
    attempt()
}
