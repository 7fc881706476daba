use voxtile::scan::Stop;
use voxtile::space::Area;
use voxtile::{Aabb, Error, Grid, Result};

/// Largest number of blocks of columns in an area.
pub(crate) const MAX_BLOCKS: i64 = 1 << 22;

/// Options of [`volumes`](crate::volumes()).
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct VolumeOptions {
    /// Box in metres: surfaces are looked for in its voxels only, so ceilings and trees above it do not count. Default:
    /// all.
    pub region: Option<Aabb>,
    /// Polygons: only columns whose center is inside count. Default: all.
    pub area: Option<Area>,
    /// Difference of heights in metres, rounded to voxels, from which on a column has fill or cut. Default: 0.
    pub least_m: f64,
    /// Bytes of memory for tiles, but at least what one block of columns needs. Default: 256 MiB.
    pub memory_bytes: usize,
    /// Stops the computation.
    pub stop: Stop,
}

impl Default for VolumeOptions {
    fn default() -> Self {
        Self { region: None, area: None, least_m: 0.0, memory_bytes: 256 << 20, stop: Stop::default() }
    }
}

impl VolumeOptions {
    /// Sets the box in metres.
    pub fn with_region(self, region: impl Into<Option<Aabb>>) -> Self {
        Self { region: region.into(), ..self }
    }

    /// Sets the polygons.
    pub fn with_area(self, area: impl Into<Option<Area>>) -> Self {
        Self { area: area.into(), ..self }
    }

    /// Sets the least difference of heights in metres.
    pub fn with_least(self, least_m: f64) -> Self {
        Self { least_m, ..self }
    }

    /// Sets the bytes of memory for tiles.
    pub fn with_memory(self, memory_bytes: usize) -> Self {
        Self { memory_bytes, ..self }
    }

    /// Sets what stops the computation.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }

    /// The least difference of heights in voxels.
    pub(crate) fn least_voxels(&self, grid: &Grid) -> Result<u64> {
        let voxels = (self.least_m / grid.resolution_m()).round();
        if self.least_m >= 0.0 && voxels < f64::from(u32::MAX) {
            return Ok(voxels as u64);
        }
        Err(Error::argument("least", format!("must be 0 m or more, not {}", self.least_m)))
    }
}
