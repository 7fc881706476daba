use std::path::Path;
use voxtile::mapper::MapReader;
use voxtile::{Error, Result};

/// Tiles that a reading command keeps in memory.
const CACHE_TILES: usize = 32;
/// How often a map is opened again because a writer flushed it.
const ATTEMPTS: usize = 8;

/// Answers from one state of the map; if a writer flushes it meanwhile, begins again with the new state.
pub fn read_map<T>(map: &Path, mut read: impl FnMut(&MapReader) -> anyhow::Result<T>) -> anyhow::Result<T> {
    for _ in 1..ATTEMPTS {
        match read(&open(map)?) {
            Err(error) if matches!(error.downcast_ref(), Some(Error::Changed { .. })) => {}
            outcome => return outcome,
        }
    }
    read(&open(map)?)
}

fn open(map: &Path) -> Result<MapReader> {
    MapReader::open(map, CACHE_TILES)
}

/// Three coordinates that the argument parser has counted.
pub fn point_of(numbers: &[f64]) -> voxtile::space::Point {
    std::array::from_fn(|axis| numbers.get(axis).copied().unwrap_or(f64::NAN))
}
