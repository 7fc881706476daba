use crate::case::{Case, Limit};
use anyhow::Result;
use report::Samples;
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, VecDeque};
use voxtile::scan::ScanTracer;
use voxtile::space::TileIndex;
use voxtile::{InMemoryMapper, MapQueries, MapView, Mapper};

/// The tiles that the last [`WorkingSet::SCANS`] scans touched.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WorkingSet {
    pub case: Case,
}

/// Size of the working set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WorkingSetFound {
    /// Bytes of its tiles in a map in memory, 95th percentile of the run.
    pub bytes: u64,
    /// Number of its tiles, 95th percentile.
    pub tiles: u64,
    /// Bytes of all tiles at the end.
    pub map_bytes: u64,
    pub digest: String,
}

/// Tiles that the last scans touched, each with the number of these scans that touched it.
#[derive(Default)]
struct Window {
    scans: VecDeque<Vec<TileIndex>>,
    touched: HashMap<TileIndex, usize>,
}

impl WorkingSet {
    /// Number of scans in the window.
    pub const SCANS: usize = 50;
    /// The percentile that is reported.
    const SHARE: f64 = 0.95;

    /// Measures it in this process.
    ///
    /// # Errors
    ///
    /// Fails if scans cannot be read or the map cannot be created.
    pub fn run(self) -> Result<WorkingSetFound> {
        let config = self.case.config(Limit::InMemory)?;
        let mut mapper = InMemoryMapper::new(config.clone())?;
        let mut tracer = ScanTracer::default();
        let mut window = Window::default();
        let (mut bytes, mut tiles) = (Samples::default(), Samples::default());
        for scan in self.case.scans()? {
            let scan = scan?;
            let updates = tracer.trace(&config.grid, &config.sensor_model, &config.rays, &scan)?;
            mapper.insert_scan(&scan)?;
            window.push(updates.tiles.iter().map(|(tile, _)| *tile).collect());
            let mut sum = 0;
            for tile in window.touched.keys() {
                sum += mapper.tile(*tile)?.map_or(0, |tile| tile.bytes());
            }
            bytes.push(sum as f64);
            tiles.push(window.touched.len() as f64);
        }
        Ok(WorkingSetFound {
            bytes: bytes.quantile(Self::SHARE) as u64,
            tiles: tiles.quantile(Self::SHARE) as u64,
            map_bytes: mapper.statistics().cached.bytes(),
            digest: mapper.digest()?.to_string(),
        })
    }
}

impl Window {
    fn push(&mut self, scan: Vec<TileIndex>) {
        for &tile in &scan {
            *self.touched.entry(tile).or_default() += 1;
        }
        self.scans.push_back(scan);
        if self.scans.len() <= WorkingSet::SCANS {
            return;
        }
        for tile in self.scans.pop_front().unwrap_or_default() {
            let Some(count) = self.touched.get_mut(&tile) else { continue };
            *count -= 1;
            if *count == 0 {
                self.touched.remove(&tile);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_window_has_the_tiles_of_the_last_scans() {
        let scans: Vec<Vec<TileIndex>> = (0..120)
            .map(|scan: i32| {
                (0..scan % 7).map(|k| TileIndex { x: scan / 9, y: (scan * k) % 11, z: 0 }).collect()
            })
            .map(|tiles: BTreeSet<TileIndex>| tiles.into_iter().collect())
            .collect();
        let mut window = Window::default();
        for (number, scan) in scans.iter().enumerate() {
            window.push(scan.clone());
            let first = (number + 1).saturating_sub(WorkingSet::SCANS);
            let expected: BTreeSet<_> = scans[first..=number].iter().flatten().copied().collect();
            assert_eq!(window.touched.keys().copied().collect::<BTreeSet<_>>(), expected);
        }
    }
}
