mod clearing;
mod layers;
mod storage;

use crate::error::{Error, Result};
use crate::maths::logit;
use crate::sensor::SensorModel;
use crate::space::{Grid, TileBox};
pub(crate) use clearing::GUARD_REACH;
pub use clearing::{Clearing, Guard};
pub use layers::Layers;
use serde::{Deserialize, Serialize};
use std::fmt;
pub use storage::Storage;

/// Maximum length of a coordinate reference system in bytes. Valid texts are far shorter.
const MAX_CRS_BYTES: usize = 1 << 16;

/// Parameters of a map, and limits of its use of memory.
///
/// Resolution, tile size, sensor model and occupancy threshold are stored with the map. Opening it with other values is
/// an error. The storage is stored too, but an opened map ignores the value given here. All other settings can change
/// from run to run.
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
    /// Sensor model. Default: OctoMap's log-odds.
    pub sensor_model: SensorModel,
    /// Probability in (0, 1) from which a voxel counts as occupied. Default: 0.5.
    pub occupancy_threshold: f64,
    /// Ray settings.
    pub rays: RayConfig,
    /// Octree of each tile, for coarse queries. Default: a view of the table's bricks.
    pub octree: OctreeConfig,
    /// Memory limit of an out-of-core mapper. Default: 512 MiB, or the minimum for tiles of this size if that is more.
    pub memory: MemoryLimit,
    /// Storage of the tiles of a new map. Default: [`Storage::OctoMap`].
    pub storage: Storage,
    /// Coordinate reference system of the map's frame: well-known text, or for example `EPSG:25832`. It does not affect
    /// voxels, but is written to exports whose format supports it. Default: none.
    pub crs: Option<String>,
    /// Whether the map keeps its scans, so that it can be remapped when poses change. A map that keeps scans continues
    /// to, regardless of this setting. Default: no.
    pub keeps_scans: bool,
    /// What the map stores of the points that hit a voxel, besides their evidence. `None` selects the layers of the map,
    /// and [`Layers::NONE`] for a new map.
    pub layers: Option<Layers>,
}

/// Memory limit of an out-of-core mapper. It affects the duration of a build, but not the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum MemoryLimit {
    /// [`MemoryLimit::DEFAULT_BYTES`], or [`MemoryLimit::min_bytes`] if that is more.
    #[default]
    Default,
    /// A number of tiles, regardless of their size.
    #[non_exhaustive]
    Tiles {
        /// Maximum number of tiles, at least 1.
        tiles: usize,
        /// Maximum bytes of pending updates for tiles on disk. Beyond it these tiles are loaded. One scan can exceed
        /// it. A larger value reduces reads and writes.
        write_buffer_bytes: usize,
    },
    /// Maximum bytes of all variable memory: active tiles, compressed tiles in memory, pending updates, buffers of scan
    /// insertion, tiles in transfer from and to disk, and the index of tiles on disk (about 250 bytes per tile).
    /// Separate threads read and write tiles. At least [`MemoryLimit::min_bytes`].
    Bytes(usize),
    /// See [`MapConfig::with_tight_memory_bytes`].
    #[doc(hidden)]
    Tight(usize),
}

/// Ray settings: ranges, region, and number of updates per voxel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RayConfig {
    /// Minimum range in metres. Nearer points are skipped. Default: 0.
    pub min_range_m: f64,
    /// Maximum range in metres. Longer rays are truncated: they mark free space only, without a hit. Default: no limit.
    pub max_range_m: Option<f64>,
    /// Rays without a return mark free space up to this range in metres, or up to the maximum range if that is less.
    /// Such a ray is a point at a distance of 1e9 m or more, see [`no_return`](crate::scan::no_return). Default: they
    /// are treated as other points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_return_range_m: Option<f64>,
    /// Region of tiles to map. Updates outside are discarded. Default: all of space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<TileBox>,
    /// Number of updates of a voxel per scan. Default: one.
    pub insert_mode: InsertMode,
    /// Rule for the voxels that rays pass. `None` is the rule of the map, and [`Clearing::Octomap`] for a new map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearing: Option<Clearing>,
}

/// Number of updates of a voxel per scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InsertMode {
    /// One update. A hit overrides any miss (OctoMap's `insertPointCloud`).
    #[default]
    PerScan,
    /// One update per ray, in the order of the points (OctoMap's `insertPointCloudRays`).
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

/// Octree of each tile, for coarse queries. It does not affect results or files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OctreeConfig {
    /// A view of the table's bricks: a few bytes per brick, without cost for updates.
    #[default]
    Bricks,
    /// OctoMap's pointer tree, which every update must modify. For research and comparison.
    Pointers(VoxelCacheMode),
}

/// Cache between a tile's updates and its pointer tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelCacheMode {
    /// No cache: every update modifies the tree individually (OctoMap).
    Off,
    /// A voxel cache. After each scan, the voxels that it evicts are written to the tree (OctoCache, serial).
    Serial(VoxelCacheConfig),
    /// Like `Serial`, with one thread per mapper that writes the trees (OctoCache, parallel).
    Parallel(VoxelCacheConfig),
}

/// Size of the voxel cache of each tile's pointer tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct VoxelCacheConfig {
    /// Maximum number of voxels that a bucket keeps after a scan, 1 to 65536. Default: 4.
    pub tau: usize,
    /// Number of buckets of each tile's cache, a power of two up to 2^24. `None` adapts it to the scans: the smallest
    /// number for which `tau * buckets` is at least three times the distinct voxels of a scan in the tile. Default:
    /// `None`.
    pub buckets: Option<usize>,
}

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            grid: Grid::new(0.1, 10.0).expect("the default lengths are valid"),
            sensor_model: SensorModel::default(),
            occupancy_threshold: 0.5,
            rays: RayConfig::default(),
            octree: OctreeConfig::default(),
            memory: MemoryLimit::default(),
            storage: Storage::default(),
            crs: None,
            keeps_scans: false,
            layers: None,
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
            clearing: None,
        }
    }
}

impl RayConfig {
    /// Rule for the voxels that rays pass.
    pub fn clearing(&self) -> Clearing {
        self.clearing.unwrap_or_default()
    }

    /// Returns these settings with the stored form of the rule: absent for [`Clearing::Octomap`].
    #[doc(hidden)]
    pub fn stored(self) -> Self {
        Self { clearing: self.clearing.filter(|clearing| *clearing != Clearing::Octomap), ..self }
    }
}

impl Default for VoxelCacheConfig {
    fn default() -> Self {
        Self { tau: 4, buckets: None }
    }
}

impl MapConfig {
    /// Returns the default configuration with another resolution and tile size, both in metres.
    ///
    /// # Errors
    ///
    /// As for [`Grid::new`].
    pub fn new(resolution_m: f64, tile_size_m: f64) -> Result<Self> {
        Ok(Self { grid: Grid::new(resolution_m, tile_size_m)?, ..Self::default() })
    }

    /// Returns the default configuration with another resolution in metres and the tile size that follows from it.
    ///
    /// # Errors
    ///
    /// As for [`Grid::with_resolution`].
    pub fn with_resolution(resolution_m: f64) -> Result<Self> {
        Ok(Self { grid: Grid::with_resolution(resolution_m)?, ..Self::default() })
    }

    /// Sets the sensor model.
    pub fn with_sensor_model(self, sensor_model: SensorModel) -> Self {
        Self { sensor_model, ..self }
    }

    /// Sets the range in metres up to which rays without a return mark free space.
    pub fn with_no_return_range(mut self, range_m: impl Into<Option<f64>>) -> Self {
        self.rays.no_return_range_m = range_m.into();
        self
    }

    /// Sets the minimum and maximum range of rays in metres.
    pub fn with_range(mut self, min_range_m: f64, max_range_m: impl Into<Option<f64>>) -> Self {
        (self.rays.min_range_m, self.rays.max_range_m) = (min_range_m, max_range_m.into());
        self
    }

    /// Sets the region: only these tiles are mapped.
    pub fn with_region(mut self, region: impl Into<Option<TileBox>>) -> Self {
        self.rays.region = region.into();
        self
    }

    /// Sets whether the map keeps its scans.
    pub fn with_kept_scans(self, keeps_scans: bool) -> Self {
        Self { keeps_scans, ..self }
    }

    /// Sets the layers.
    pub fn with_layers(self, layers: impl Into<Option<Layers>>) -> Self {
        Self { layers: layers.into(), ..self }
    }

    /// Layers of the map.
    pub fn layers(&self) -> Layers {
        self.layers.unwrap_or(Layers::NONE)
    }

    /// Sets the insert mode.
    pub fn with_insert_mode(mut self, insert_mode: InsertMode) -> Self {
        self.rays.insert_mode = insert_mode;
        self
    }

    /// Sets the rule for the voxels that rays pass.
    pub fn with_clearing(mut self, clearing: impl Into<Option<Clearing>>) -> Self {
        self.rays.clearing = clearing.into();
        self
    }

    /// Limits the number of tiles in memory.
    pub fn with_cache_tiles(self, cache_tiles: usize) -> Self {
        let write_buffer_bytes = self.write_buffer_bytes();
        Self { memory: MemoryLimit::Tiles { tiles: cache_tiles, write_buffer_bytes }, ..self }
    }

    /// Limits the bytes of pending updates for tiles on disk.
    pub fn with_write_buffer_bytes(self, write_buffer_bytes: usize) -> Self {
        let tiles = match self.memory {
            MemoryLimit::Tiles { tiles, .. } => tiles,
            _ => usize::MAX,
        };
        Self { memory: MemoryLimit::Tiles { tiles, write_buffer_bytes }, ..self }
    }

    /// Maximum bytes of all variable memory; `None` if the limit is a number of tiles.
    pub fn memory_bytes(&self) -> Option<usize> {
        self.memory.bytes(&self.grid)
    }

    /// Limits all variable memory to this number of bytes.
    pub fn with_memory_bytes(self, bytes: usize) -> Self {
        Self { memory: MemoryLimit::Bytes(bytes), ..self }
    }

    /// Like [`MapConfig::with_memory_bytes`], but accepts less than the minimum, for tests of low memory: the map is
    /// the same, but the limit can be exceeded.
    #[doc(hidden)]
    pub fn with_tight_memory_bytes(self, bytes: usize) -> Self {
        Self { memory: MemoryLimit::Tight(bytes), ..self }
    }

    /// Sets the storage of a new map.
    pub fn with_storage(self, storage: Storage) -> Self {
        Self { storage, ..self }
    }

    fn write_buffer_bytes(&self) -> usize {
        match self.memory {
            MemoryLimit::Tiles { write_buffer_bytes, .. } => write_buffer_bytes,
            _ => DEFAULT_WRITE_BUFFER_BYTES,
        }
    }

    /// Sets the form of the octree.
    pub fn with_octree(self, octree: OctreeConfig) -> Self {
        Self { octree, ..self }
    }

    /// Selects pointer trees with this voxel cache.
    pub fn with_voxel_cache(self, mode: VoxelCacheMode) -> Self {
        self.with_octree(OctreeConfig::Pointers(mode))
    }

    /// Returns the configuration, or the first invalid argument.
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
        if let Some(guard) = self.rays.clearing().guard() {
            guard.validated()?;
            if self.rays.insert_mode == InsertMode::PerRay {
                let reason =
                    "guarded clearing needs all rays of a scan together; use the insert mode per-scan";
                return Err(Error::argument("clearing", reason));
            }
        }
        if self.crs.as_ref().is_some_and(|crs| crs.len() > MAX_CRS_BYTES) {
            let reason = format!("the coordinate reference system exceeds {MAX_CRS_BYTES} bytes");
            return Err(Error::argument("crs", reason));
        }
        self.layers().validated()?;
        self.memory.check(&self.grid)?;
        if let OctreeConfig::Pointers(mode) = self.octree
            && let Some(cache) = mode.cache()
        {
            cache.check()?;
        }
        Ok(self)
    }

    /// Like [`Self::validated`], for a new map: rejects a coordinate reference system with control characters, which
    /// could corrupt files and terminals. An existing map with such a text can be opened.
    pub(crate) fn validated_as_new(self) -> Result<Self> {
        // Well-known text may have several lines.
        let is_wrong = |c: &char| c.is_control() && !matches!(c, '\t' | '\n' | '\r');
        if let Some(c) = self.crs.iter().flat_map(|crs| crs.chars()).find(is_wrong) {
            let reason = format!(
                "contains the control character {c:?}; use plain text, such as EPSG:25832 or well-known text"
            );
            return Err(Error::argument("crs", reason));
        }
        self.validated()
    }

    /// Log-odds from which a voxel counts as occupied.
    #[inline]
    pub fn occupied_log_odds(&self) -> f64 {
        // Every query calls this, so the logarithm is avoided for the default.
        if self.occupancy_threshold == 0.5 { 0.0 } else { logit(self.occupancy_threshold) }
    }
}

impl VoxelCacheMode {
    /// Size of the caches, if there are any.
    pub fn cache(self) -> Option<VoxelCacheConfig> {
        match self {
            Self::Off => None,
            Self::Serial(cache) | Self::Parallel(cache) => Some(cache),
        }
    }
}

impl VoxelCacheConfig {
    /// Returns the size with this `tau` and number of buckets. [`MapConfig::validated`] checks the values.
    pub fn new(tau: usize, buckets: impl Into<Option<usize>>) -> Self {
        Self { tau, buckets: buckets.into() }
    }

    fn check(&self) -> Result<()> {
        let Self { tau, buckets } = *self;
        if tau == 0 || tau > 1 << 16 {
            return Err(wrong("tau", tau, "1 to 65536 voxels per bucket"));
        }
        if buckets.is_some_and(|buckets| !buckets.is_power_of_two() || buckets > 1 << 24) {
            return Err(wrong("buckets", buckets.unwrap_or_default(), "a power of two up to 2^24"));
        }
        Ok(())
    }
}

/// Default limit of pending updates in bytes.
const DEFAULT_WRITE_BUFFER_BYTES: usize = 32 << 20;

impl MemoryLimit {
    /// Default limit in bytes of library, command and Python package.
    pub const DEFAULT_BYTES: usize = 512 << 20;

    /// Returns a limit of this number of tiles, regardless of their size.
    pub fn tiles(tiles: usize) -> Self {
        Self::Tiles { tiles, write_buffer_bytes: DEFAULT_WRITE_BUFFER_BYTES }
    }

    /// Minimum number of bytes for any map: `16 MiB + 2 (12 n^3 + 256 b^3)` for tiles with `n` voxels and `b = ceil(n /
    /// 8) + 1` bricks along their edge. This is the memory of a scan and of two tiles in which every voxel is observed
    /// and all differ: one active, and one in transfer.
    pub fn min_bytes(grid: &Grid) -> usize {
        min_bytes(grid.voxels_per_tile_edge() as usize)
    }

    /// Maximum bytes of all variable memory of a map with this grid; `None` if the limit is a number of tiles.
    pub fn bytes(self, grid: &Grid) -> Option<usize> {
        match self {
            Self::Default => Some(Self::DEFAULT_BYTES.max(Self::min_bytes(grid))),
            Self::Bytes(bytes) | Self::Tight(bytes) => Some(bytes),
            Self::Tiles { .. } => None,
        }
    }

    fn check(self, grid: &Grid) -> Result<()> {
        match self {
            Self::Tiles { tiles: 0, .. } => Err(wrong("cache tiles", 0, "at least 1")),
            Self::Bytes(bytes) if bytes < Self::min_bytes(grid) => {
                let least = Self::min_bytes(grid);
                let fits = (2..grid.voxels_per_tile_edge()).rev().find(|&n| min_bytes(n as usize) <= bytes);
                let hint = fits.map_or(String::new(), |n| {
                    let length_m = (f64::from(n) * grid.resolution_m() * 1e6).round() / 1e6;
                    format!(", or use tiles of at most {length_m} m")
                });
                let reason = format!(
                    "{bytes} bytes are too few for tiles of {} m at {} m: allow at least {least} ({} MiB){hint}",
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

fn min_bytes(voxels_per_edge: usize) -> usize {
    // One more brick, for tiles that do not begin at the edge of a brick.
    let bricks_per_edge = voxels_per_edge.div_ceil(8) + 1;
    (16 << 20) + 2 * (12 * voxels_per_edge.pow(3) + 256 * bricks_per_edge.pow(3))
}

fn wrong(argument: &str, value: impl std::fmt::Display, right: &str) -> Error {
    Error::argument(argument, format!("must be {right}, not {value}"))
}
