use super::{MapReader, OutOfCoreTileMapper};
use crate::config::{MapConfig, MemoryLimit};
use crate::error::{Error, Result};
use crate::store::{MapPath, SnapshotName};

/// Options for opening or creating a map on disk.
///
/// ```
/// use voxtile::{MapConfig, MapOptions, Mapper, Scan};
///
/// # fn main() -> voxtile::Result<()> {
/// # let folder = tempfile::tempdir().unwrap();
/// # let folder = folder.path().join("city");
/// let config = MapConfig::new(0.1, 10.0)?.with_range(0.5, 60.0);
/// let options = MapOptions::new().config(config).create_if_missing(true).memory_bytes(256 << 20);
/// let mut mapper = options.open(&folder)?;
/// mapper.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.0, 0.0, 0.0]], intensities: None })?;
/// mapper.flush()?;
///
/// // Readers may be opened while the mapper is open, in this process or another. They need no configuration.
/// let reader = MapOptions::new().memory_bytes(64 << 20).open_read_only(&folder)?;
/// assert_eq!(reader.flush_number(), 1);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
#[must_use]
pub struct MapOptions {
    config: Option<MapConfig>,
    memory_bytes: Option<usize>,
    create_if_missing: bool,
    create_new: bool,
}

impl MapOptions {
    /// Options for opening an existing map with its own configuration.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the configuration of a new map ([`MapConfig::default`] otherwise). An existing map must have the same
    /// resolution, tile size, sensor model and occupancy threshold; the other settings apply from now on.
    pub fn config(mut self, config: MapConfig) -> Self {
        self.config = Some(config);
        self
    }

    /// Sets the limit for all memory that grows with the map, instead of the limit in the configuration. See
    /// [`MapConfig::with_memory_bytes`]. A reader uses it for tiles only.
    pub fn memory_bytes(mut self, bytes: usize) -> Self {
        self.memory_bytes = Some(bytes);
        self
    }

    /// Sets whether a missing map is created.
    pub fn create_if_missing(mut self, creates: bool) -> Self {
        self.create_if_missing = creates;
        self
    }

    /// Sets whether a new map is created; an existing one is then an error.
    pub fn create_new(mut self, creates: bool) -> Self {
        self.create_new = creates;
        self
    }

    /// Opens the map for inserting scans.
    ///
    /// # Errors
    ///
    /// - [`Error::NoMap`] if there is no map and none is to be created;
    /// - [`Error::AlreadyExists`] if the folder has other content, or a map where a new one is wanted;
    /// - [`Error::Locked`] if another process writes to the map;
    /// - [`Error::Mismatch`] if the map has other parameters;
    /// - an invalid configuration, a damaged list of tiles, or a failed disk operation.
    pub fn open(&self, map: impl Into<MapPath>) -> Result<OutOfCoreTileMapper> {
        let map = map.into();
        if self.create_new {
            return OutOfCoreTileMapper::create(
                map,
                self.with_memory(self.config.clone().unwrap_or_default()),
            );
        }
        let own = match MapReader::config_of(map.clone()) {
            Err(Error::NoMap { .. }) if self.create_if_missing => {
                let config = self.config.clone().unwrap_or_default();
                return OutOfCoreTileMapper::create(map, self.with_memory(config));
            }
            // An error is returned below if no configuration is given; otherwise `open` reports it.
            own => own,
        };
        let config = match &self.config {
            Some(config) => config.clone(),
            None => own?,
        };
        OutOfCoreTileMapper::open(map, self.with_memory(config))
    }

    /// Opens the map for queries; a writer may be active. Settings that concern only mapping have no effect.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::NoMap`] if there is no map; also fails if its list of tiles is damaged.
    pub fn open_read_only(&self, map: impl Into<MapPath>) -> Result<MapReader> {
        MapReader::open_within(map.into(), self.reader_memory())
    }

    /// Opens a snapshot of the map for queries.
    ///
    /// # Errors
    ///
    /// Same errors as [`MapOptions::open_read_only`]; also fails if there is no such snapshot or it is damaged.
    pub fn open_snapshot(&self, map: impl Into<MapPath>, name: &SnapshotName) -> Result<MapReader> {
        MapReader::open_snapshot_within(map.into(), name, self.reader_memory())
    }

    fn with_memory(&self, config: MapConfig) -> MapConfig {
        match self.memory_bytes {
            Some(bytes) => config.with_memory_bytes(bytes),
            None => config,
        }
    }

    fn reader_memory(&self) -> MemoryLimit {
        let of_config = self.config.as_ref().map_or(MemoryLimit::default(), |config| config.memory);
        self.memory_bytes.map_or(of_config, MemoryLimit::Bytes)
    }
}
