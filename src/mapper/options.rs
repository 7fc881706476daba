use super::{MapReader, OutOfCoreTileMapper};
use crate::config::{MapConfig, MemoryLimit};
use crate::error::{Error, Result};
use crate::store::{MapPath, SnapshotName};

/// Opens or creates a map on disk.
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
/// // Beside the mapper, in this process or in another; the map knows how it was made.
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
    /// Opens a map that is there, as it was made.
    pub fn new() -> Self {
        Self::default()
    }

    /// How a new map is made ([`MapConfig::default`] if this is not called). A map that is there must have the same
    /// resolution, tile size, sensor model and occupancy threshold; the rest holds from now on.
    pub fn config(mut self, config: MapConfig) -> Self {
        self.config = Some(config);
        self
    }

    /// Most bytes of memory of all that grows with the map, instead of what the config says. See
    /// [`MapConfig::with_memory_bytes`]. A reader takes it for tiles alone.
    pub fn memory_bytes(mut self, bytes: usize) -> Self {
        self.memory_bytes = Some(bytes);
        self
    }

    /// Whether a map is created where there is none.
    pub fn create_if_missing(mut self, creates: bool) -> Self {
        self.create_if_missing = creates;
        self
    }

    /// Whether a map is created, and it is an error if there is one.
    pub fn create_new(mut self, creates: bool) -> Self {
        self.create_new = creates;
        self
    }

    /// Opens the map to insert scans.
    ///
    /// # Errors
    ///
    /// [`Error::NoMap`] if there is none and none is to be created; [`Error::AlreadyExists`] for another folder than an
    /// empty one, or for a map where a new one is wanted; [`Error::Locked`] if another process writes to it;
    /// [`Error::Mismatch`] if the map has other parameters; a wrong configuration, damage to what tells which tiles
    /// there are, a disk that refuses.
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
            // Opening says what else is wrong, and to whom it belongs.
            own => own,
        };
        let config = match &self.config {
            Some(config) => config.clone(),
            None => own?,
        };
        OutOfCoreTileMapper::open(map, self.with_memory(config))
    }

    /// Opens the map to be asked, beside a writer too. What only concerns mapping does not matter.
    ///
    /// # Errors
    ///
    /// [`Error::NoMap`] if there is none; damage to what tells which tiles there are.
    pub fn open_read_only(&self, map: impl Into<MapPath>) -> Result<MapReader> {
        MapReader::open_within(map.into(), self.reader_memory())
    }

    /// Opens a snapshot of the map to be asked.
    ///
    /// # Errors
    ///
    /// As for [`MapOptions::open_read_only`]; no snapshot of this name, or a damaged one.
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
