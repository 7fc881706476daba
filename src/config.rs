mod storage;

use crate::error::{Error, Result};
use crate::maths::logit;
use crate::sensor::SensorModel;
use crate::space::{Grid, TileBox};
use serde::{Deserialize, Serialize};
use std::fmt;
pub use storage::Storage;

/// Texts of coordinate reference systems are far shorter.
const MAX_CRS_BYTES: usize = 1 << 16;

/// How a map is made and how much memory it may use.
///
/// Resolution, tile size, sensor model and occupancy threshold belong to the map: they are stored with it, and opening
/// it with others is an error. So does its storage, which an opened map keeps, whatever is asked for. The rest may
/// change from run to run.
///
/// ```
/// use voxtile::{InsertMode, MapConfig};
///
/// # fn main() -> voxtile::Result<()> {
/// let config = MapConfig::new(0.1, 10.0)? // Voxels of 0.1 m in tiles of 10 m.
///     .with_range(0.5, 60.0)
///     .with_insert_mode(InsertMode::PerRay)
///     .with_memory_bytes(256 << 20);
/// assert_eq!(config.grid.voxels_per_tile_edge(), 100);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapConfig {
    /// Voxels and tiles. Default: 0.1 m and 10 m.
    pub grid: Grid,
    /// How observations become evidence. Default: OctoMap's log-odds.
    pub sensor_model: SensorModel,
    /// Probability in (0, 1) from which a voxel counts as occupied. Default: 0.5.
    pub occupancy_threshold: f64,
    /// Which part of a ray counts, and how often.
    pub rays: RayConfig,
    /// What each tile keeps for coarse queries. Default: a view of the table's bricks.
    pub octree: OctreeConfig,
    /// How much an out-of-core mapper keeps in memory. Default: 512 MiB, or what tiles of this size need at least.
    pub memory: MemoryLimit,
    /// How the tiles of a new map are stored. Default: the original files.
    pub storage: Storage,
    /// The coordinate reference system of the map's frame: well-known text, or `EPSG:25832`. It changes no voxel;
    /// exports that can say it do. Default: none.
    pub crs: Option<String>,
    /// Whether the map keeps the scans that it takes, so that it can be mapped again when poses change. A map that
    /// does goes on doing so, whatever is asked for. Default: no.
    pub keeps_scans: bool,
}

/// How much an out-of-core mapper keeps in memory. The map does not depend on it, only the work to make it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryLimit {
    /// [`MemoryLimit::DEFAULT_BYTES`], or [`MemoryLimit::least_bytes`] if that is more.
    #[default]
    Default,
    /// Tiles are counted, however large they are.
    #[non_exhaustive]
    Tiles {
        /// Most tiles, at least 1.
        tiles: usize,
        /// Most bytes of updates that wait for tiles on disk before those are fetched; one scan may come on top.
        /// Larger: fewer reads and writes.
        write_buffer_bytes: usize,
    },
    /// Most bytes of all that grows: tiles in use, others in the compact form, updates that wait for tiles, what a scan
    /// takes while it is inserted, tiles on their way to and from disk, what is known of the tiles there (some 250
    /// bytes a tile). Tiles are written and fetched by threads of their own. At least [`MemoryLimit::least_bytes`].
    Bytes(usize),
    /// See [`MapConfig::with_tight_memory_bytes`].
    #[doc(hidden)]
    Tight(usize),
}

/// Which part of a ray counts, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RayConfig {
    /// Points nearer to the sensor than this many metres are skipped. Default: 0.
    pub min_range_m: f64,
    /// Rays are cut at this many metres: what lies before is free, nothing is hit. Default: no limit.
    pub max_range_m: Option<f64>,
    /// Rays without a return are free up to so many metres, or up to the max range if that is less. Such a ray is a
    /// point 1e9 m away or more: see [`no_return`](crate::scan::no_return). Default: they are treated as other points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_return_range_m: Option<f64>,
    /// Only these tiles are mapped: what scans say about others is left out. Default: all of space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<TileBox>,
    /// How often a voxel is updated by one scan. Default: once.
    pub insert_mode: InsertMode,
}

/// How often a voxel is updated by one scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InsertMode {
    /// Once; a hit wins over any miss (OctoMap's `insertPointCloud`).
    #[default]
    PerScan,
    /// Once a ray, in the order of the points (OctoMap's `insertPointCloudRays`).
    PerRay,
}

impl fmt::Display for InsertMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PerScan => "per-scan",
            Self::PerRay => "per-ray",
        })
    }
}

/// What each tile keeps for coarse queries. The answers and the files are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OctreeConfig {
    /// A view of the table's bricks: a few bytes a brick, and an update costs it nothing.
    #[default]
    Bricks,
    /// OctoMap's pointer tree, which must be told of updates: the form of the literature, for study and comparison.
    Pointers(VoxelCacheMode),
}

/// What stands between the updates of a tile and its pointer tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelCacheMode {
    /// Nothing: every update goes straight into the tree, one by one (OctoMap).
    Off,
    /// A voxel cache; after each scan, what leaves it goes into the tree (OctoCache, serial).
    Serial(VoxelCacheConfig),
    /// The same, and the trees are written by a thread of their own, one a mapper (OctoCache, parallel).
    Parallel(VoxelCacheConfig),
}

/// Shape of the voxel cache in front of each tile's pointer tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct VoxelCacheConfig {
    /// Most voxels that a bucket keeps after a scan, 1 to 65536. Default: 4.
    pub tau: usize,
    /// Number of buckets of each tile's cache, a power of two up to 2^24; `None` fits it to the scans that a tile
    /// sees: the fewest with which `tau * buckets` is three times the distinct voxels of one. Default: `None`.
    pub buckets: Option<usize>,
}

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            grid: Grid::new(0.1, 10.0).expect("the default lengths make a grid"),
            sensor_model: SensorModel::default(),
            occupancy_threshold: 0.5,
            rays: RayConfig::default(),
            octree: OctreeConfig::default(),
            memory: MemoryLimit::default(),
            storage: Storage::default(),
            crs: None,
            keeps_scans: false,
        }
    }
}

impl Default for RayConfig {
    fn default() -> Self {
        Self {
            min_range_m: 0.0,
            max_range_m: None,
            no_return_range_m: None,
            region: None,
            insert_mode: InsertMode::PerScan,
        }
    }
}

impl Default for VoxelCacheConfig {
    fn default() -> Self {
        Self { tau: 4, buckets: None }
    }
}

impl MapConfig {
    /// The defaults with another resolution and tile size, both in metres.
    ///
    /// # Errors
    ///
    /// As for [`Grid::new`].
    pub fn new(resolution_m: f64, tile_size_m: f64) -> Result<Self> {
        Ok(Self { grid: Grid::new(resolution_m, tile_size_m)?, ..Self::default() })
    }

    /// The same with another sensor model.
    pub fn with_sensor_model(self, sensor_model: SensorModel) -> Self {
        Self { sensor_model, ..self }
    }

    /// The same with rays without a return, which are free up to so many metres.
    pub fn with_no_return_range(mut self, range_m: impl Into<Option<f64>>) -> Self {
        self.rays.no_return_range_m = range_m.into();
        self
    }

    /// The same with rays from `min_range_m` to `max_range_m`, in metres.
    pub fn with_range(mut self, min_range_m: f64, max_range_m: impl Into<Option<f64>>) -> Self {
        (self.rays.min_range_m, self.rays.max_range_m) = (min_range_m, max_range_m.into());
        self
    }

    /// The same with a region: only these tiles are mapped.
    pub fn with_region(mut self, region: impl Into<Option<TileBox>>) -> Self {
        self.rays.region = region.into();
        self
    }

    /// The same, keeping the scans that the map takes or not.
    pub fn with_kept_scans(self, keeps_scans: bool) -> Self {
        Self { keeps_scans, ..self }
    }

    /// The same with another insert mode.
    pub fn with_insert_mode(mut self, insert_mode: InsertMode) -> Self {
        self.rays.insert_mode = insert_mode;
        self
    }

    /// The same with at most so many tiles in memory.
    pub fn with_cache_tiles(self, cache_tiles: usize) -> Self {
        let write_buffer_bytes = self.write_buffer_bytes();
        Self { memory: MemoryLimit::Tiles { tiles: cache_tiles, write_buffer_bytes }, ..self }
    }

    /// The same with at most so many bytes of updates waiting for tiles on disk.
    pub fn with_write_buffer_bytes(self, write_buffer_bytes: usize) -> Self {
        let tiles = match self.memory {
            MemoryLimit::Tiles { tiles, .. } => tiles,
            _ => usize::MAX,
        };
        Self { memory: MemoryLimit::Tiles { tiles, write_buffer_bytes }, ..self }
    }

    /// Most bytes of all that grows; `None` where tiles are counted.
    pub fn memory_bytes(&self) -> Option<usize> {
        self.memory.bytes(&self.grid)
    }

    /// The same with at most so many bytes for all that grows.
    pub fn with_memory_bytes(self, bytes: usize) -> Self {
        Self { memory: MemoryLimit::Bytes(bytes), ..self }
    }

    /// [`MapConfig::with_memory_bytes`] below what is the least, for tests of maps that are short of memory: the map is
    /// the same, but the limit does not hold.
    #[doc(hidden)]
    pub fn with_tight_memory_bytes(self, bytes: usize) -> Self {
        Self { memory: MemoryLimit::Tight(bytes), ..self }
    }

    /// The same with another storage for a new map.
    pub fn with_storage(self, storage: Storage) -> Self {
        Self { storage, ..self }
    }

    fn write_buffer_bytes(&self) -> usize {
        match self.memory {
            MemoryLimit::Tiles { write_buffer_bytes, .. } => write_buffer_bytes,
            _ => DEFAULT_WRITE_BUFFER_BYTES,
        }
    }

    /// The same with another form of octree.
    pub fn with_octree(self, octree: OctreeConfig) -> Self {
        Self { octree, ..self }
    }

    /// The same with pointer trees, behind voxel caches or not.
    pub fn with_voxel_cache(self, mode: VoxelCacheMode) -> Self {
        self.with_octree(OctreeConfig::Pointers(mode))
    }

    /// The configuration, or the first argument that is wrong.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] with the argument's name.
    pub fn validated(self) -> Result<Self> {
        self.sensor_model.validated()?;
        let RayConfig { min_range_m, max_range_m, no_return_range_m, .. } = self.rays;
        if !(self.occupancy_threshold > 0.0 && self.occupancy_threshold < 1.0) {
            return Err(wrong(
                "occupancy threshold",
                self.occupancy_threshold,
                "a probability between 0 and 1",
            ));
        }
        if !(min_range_m >= 0.0 && min_range_m.is_finite()) {
            return Err(wrong("min range", min_range_m, "a length of at least 0 m"));
        }
        if no_return_range_m.is_some_and(|range| !(range > 0.0 && range <= 1e6)) {
            let range = no_return_range_m.unwrap_or_default();
            return Err(wrong("no return range", range, "a length above 0 and up to 1000000 m"));
        }
        if max_range_m.is_some_and(|max| !(max > min_range_m && max.is_finite())) {
            let max = max_range_m.unwrap_or_default();
            return Err(wrong("max range", max, "a length above the min range, in metres"));
        }
        if self.crs.as_ref().is_some_and(|crs| crs.len() > MAX_CRS_BYTES) {
            let reason = format!("a coordinate reference system of more than {MAX_CRS_BYTES} bytes");
            return Err(Error::argument("crs", reason));
        }
        self.memory.check(&self.grid)?;
        if let OctreeConfig::Pointers(mode) = self.octree
            && let Some(cache) = mode.cache()
        {
            cache.check()?;
        }
        Ok(self)
    }

    /// The same for a map that is to be made: there is no coordinate reference system with control characters, which a
    /// file or a terminal would take for something else. A map that has one keeps it.
    pub(crate) fn validated_as_new(self) -> Result<Self> {
        // Well-known text may have several lines.
        let is_wrong = |c: &char| c.is_control() && !matches!(c, '\t' | '\n' | '\r');
        if let Some(c) = self.crs.iter().flat_map(|crs| crs.chars()).find(is_wrong) {
            let reason = format!(
                "has the control character {c:?}; name it as plain text, EPSG:25832 or well-known text"
            );
            return Err(Error::argument("crs", reason));
        }
        self.validated()
    }

    /// Log-odds from which a voxel counts as occupied.
    #[inline]
    pub fn occupied_log_odds(&self) -> f64 {
        // Used by every query: the default needs no logarithm.
        if self.occupancy_threshold == 0.5 { 0.0 } else { logit(self.occupancy_threshold) }
    }
}

impl VoxelCacheMode {
    /// The shape of the caches, if there are any.
    pub fn cache(self) -> Option<VoxelCacheConfig> {
        match self {
            Self::Off => None,
            Self::Serial(cache) | Self::Parallel(cache) => Some(cache),
        }
    }
}

impl VoxelCacheConfig {
    /// Caches with this `tau` and number of buckets; what they may be is checked with the [`MapConfig`].
    pub fn new(tau: usize, buckets: impl Into<Option<usize>>) -> Self {
        Self { tau, buckets: buckets.into() }
    }

    fn check(&self) -> Result<()> {
        let Self { tau, buckets } = *self;
        if tau == 0 || tau > 1 << 16 {
            return Err(wrong("tau", tau, "1 to 65536 voxels a bucket"));
        }
        if buckets.is_some_and(|buckets| !buckets.is_power_of_two() || buckets > 1 << 24) {
            return Err(wrong("buckets", buckets.unwrap_or_default(), "a power of two up to 2^24"));
        }
        Ok(())
    }
}

/// Bytes of updates that wait, unless something else is asked for.
const DEFAULT_WRITE_BUFFER_BYTES: usize = 32 << 20;

impl MemoryLimit {
    /// What library, command and Python use unless something else is asked for.
    pub const DEFAULT_BYTES: usize = 512 << 20;

    /// So many tiles, however large they are.
    pub fn tiles(tiles: usize) -> Self {
        Self::Tiles { tiles, write_buffer_bytes: DEFAULT_WRITE_BUFFER_BYTES }
    }

    /// The least number of bytes that will do, whatever is mapped: `16 MiB + 2 (12 n^3 + 256 b^3)` for tiles of `n`
    /// voxels and `b = ceil(n / 8) + 1` bricks along their edge. That is two tiles of which every voxel is observed and
    /// no two alike, one at work and one on its way in or out, and what a scan takes.
    pub fn least_bytes(grid: &Grid) -> usize {
        least_bytes(grid.voxels_per_tile_edge() as usize)
    }

    /// Most bytes of all that grows in a map with this grid; `None` where tiles are counted.
    pub fn bytes(self, grid: &Grid) -> Option<usize> {
        match self {
            Self::Default => Some(Self::DEFAULT_BYTES.max(Self::least_bytes(grid))),
            Self::Bytes(bytes) | Self::Tight(bytes) => Some(bytes),
            Self::Tiles { .. } => None,
        }
    }

    fn check(self, grid: &Grid) -> Result<()> {
        match self {
            Self::Tiles { tiles: 0, .. } => Err(wrong("cache tiles", 0, "at least 1")),
            Self::Bytes(bytes) if bytes < Self::least_bytes(grid) => {
                let least = Self::least_bytes(grid);
                let fits = (2..grid.voxels_per_tile_edge()).rev().find(|&n| least_bytes(n as usize) <= bytes);
                let hint = fits.map_or(String::new(), |n| {
                    let length_m = (f64::from(n) * grid.resolution_m() * 1e6).round() / 1e6;
                    format!(", or make tiles of at most {length_m} m")
                });
                let reason = format!(
                    "{bytes} bytes are too few for tiles of {} m at {} m: give at least {least} ({} MiB){hint}",
                    grid.tile_size_m(),
                    grid.resolution_m(),
                    least.div_ceil(1 << 20)
                );
                Err(Error::argument("memory", reason))
            }
            _ => Ok(()),
        }
    }
}

fn least_bytes(voxels_per_edge: usize) -> usize {
    // One more, for tiles that begin in the midst of a brick.
    let bricks_per_edge = voxels_per_edge.div_ceil(8) + 1;
    (16 << 20) + 2 * (12 * voxels_per_edge.pow(3) + 256 * bricks_per_edge.pow(3))
}

fn wrong(argument: &str, value: impl std::fmt::Display, right: &str) -> Error {
    Error::argument(argument, format!("{value} is not {right}"))
}
