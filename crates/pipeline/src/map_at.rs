use crate::octree_file;
use crate::place::{check_is_folder, place_of};
use std::path::{Path, PathBuf};
use voxtile::mapper::{MapReader, MapStatistics, MapView, OctreeMap, TileRef};
use voxtile::space::{TileBox, TileIndex};
use voxtile::store::{SnapshotName, TileVersion};
use voxtile::tile::Voxel;
use voxtile::{Error, MapConfig, Result};

/// Bytes of the tiles that a reading command keeps in memory.
const TILES_BYTES: usize = 64 << 20;
/// How often a map is opened again because a writer flushed it.
const ATTEMPTS: usize = 8;

/// A map as it is, or as a snapshot of it.
#[derive(Clone, Debug)]
pub struct MapAt {
    /// Its folder, or the URL of a bucket.
    pub map: PathBuf,
    /// The snapshot of it, if it is one.
    pub snapshot: Option<SnapshotName>,
}

impl MapAt {
    /// `MAP`, or `MAP@SNAPSHOT` where nothing has that as its own name.
    ///
    /// # Errors
    ///
    /// A name that no snapshot can have.
    pub fn of(path: &Path) -> Result<Self> {
        match named_snapshot(path) {
            Some((map, name)) => Ok(Self { map: map.to_owned(), snapshot: Some(SnapshotName::new(name)?) }),
            None => Ok(Self { map: path.to_owned(), snapshot: None }),
        }
    }

    /// Opens it for reading.
    ///
    /// # Errors
    ///
    /// As for [`MapReader::open`]; a file.
    pub fn open(&self) -> Result<MapReader> {
        check_is_no_file(&self.map)?;
        match &self.snapshot {
            Some(name) => MapReader::open_snapshot(place_of(&self.map)?, name, TILES_BYTES),
            None => MapReader::open(place_of(&self.map)?, TILES_BYTES),
        }
    }
}

/// A map is a folder; a file of OctoMap is another form of one.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for a file.
pub fn check_is_no_file(map: &Path) -> Result<()> {
    let reason = if OctreeMap::is_named_by(map) {
        "is a file of OctoMap, which this command does not take: `voxtile import` makes a map of it; info, query, raycast, \
         digest, export, picture and view take the file itself"
    } else if map.is_file() {
        "is a file, and none of OctoMap; a map is a folder, which `voxtile build` or `import` makes"
    } else {
        return Ok(());
    };
    Err(Error::argument(map.display().to_string(), reason))
}

/// The two parts of `MAP@SNAPSHOT`, where nothing has that as its own name.
fn named_snapshot(path: &Path) -> Option<(&Path, &str)> {
    let text = path.to_str().filter(|_| std::fs::symlink_metadata(path).is_err())?;
    let (map, name) = text.rsplit_once('@')?;
    (!name.contains(std::path::is_separator)).then_some((Path::new(map), name))
}

/// What can be read.
pub enum AnyMap {
    /// A map, or a snapshot of one.
    Map(Box<MapReader>),
    /// A file of OctoMap.
    Octree(Box<OctreeMap>),
}

/// Calls a method of whichever it is.
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

/// A map that is to be changed, made or looked at as a whole: not a snapshot of one.
///
/// # Errors
///
/// [`Error::InvalidArgument`] for `MAP@SNAPSHOT` where there is a map at `MAP`, for a URL, and for a file.
pub fn whole_map(path: &Path) -> Result<&Path> {
    check_is_folder(path)?;
    check_is_no_file(path)?;
    if let Some((map, _)) = named_snapshot(path)
        && map.join("metadata.json").exists()
    {
        let reason = format!(
            "names a snapshot, which can be read and not changed; name the map {}, or make a map of the snapshot with `voxtile \
             convert`",
            map.display()
        );
        return Err(Error::argument(path.display().to_string(), reason));
    }
    Ok(path)
}

/// Answers from one state of a map, or from a snapshot of it (`MAP@SNAPSHOT`); if a writer flushes the map meanwhile,
/// begins again with the new state.
///
/// # Errors
///
/// As for [`MapAt::open`]; those of `read`.
pub fn read_map<T>(map: &Path, mut read: impl FnMut(&MapReader) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let map = MapAt::of(map)?;
    again_if_changed(|| read(&map.open()?))
}

/// Opens a map, a snapshot, or a file of OctoMap.
///
/// # Errors
///
/// As for [`MapAt::open`]; a file that is none of OctoMap.
pub fn open_any_map(map: &Path) -> anyhow::Result<AnyMap> {
    if OctreeMap::is_named_by(map) {
        return Ok(AnyMap::Octree(Box::new(OctreeMap::of(octree_file::read(map)?)?)));
    }
    Ok(AnyMap::Map(Box::new(MapAt::of(map)?.open()?)))
}

/// Answers from one state of a map, a snapshot, or a file of OctoMap.
///
/// # Errors
///
/// As for [`open_any_map`]; those of `read`.
pub fn read_any_map<T>(map: &Path, mut read: impl FnMut(&AnyMap) -> anyhow::Result<T>) -> anyhow::Result<T> {
    again_if_changed(|| read(&open_any_map(map)?))
}

/// The same from two maps.
///
/// # Errors
///
/// As for [`MapAt::open`]; those of `read`.
pub fn read_maps<T>(
    first: &MapAt,
    second: &MapAt,
    mut read: impl FnMut(&MapReader, &MapReader) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    again_if_changed(|| read(&first.open()?, &second.open()?))
}

/// The same from any number of maps.
///
/// # Errors
///
/// As for [`MapAt::open`]; those of `read`.
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
