use super::local_rays::LocalRays;
use super::scan_tiles::tiles_of_scan;
use super::sender::Sender;
use rustc_hash::FxHashSet;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::maths::logit;
use voxtile::scan::Scan;
use voxtile::space::{BrickMask, Grid, TileIndex, VoxelIndex};
use voxtile::{Error, Result};
use voxtile_local::{LocalMap, LocalReport, LocalState, LocalView};

/// Passes a map's occupied voxels to a sender: voxels with at least a threshold probability.
#[derive(Clone, Copy, Debug)]
pub struct MapWatch {
    threshold_log_odds: f64,
}

impl MapWatch {
    /// Creates a watch with a threshold probability.
    ///
    /// # Errors
    ///
    /// A threshold that is not between 0 and 1.
    pub fn new(threshold: f64) -> Result<Self> {
        if !(threshold > 0.0 && threshold < 1.0) {
            return Err(Error::argument("threshold", format!("{threshold} is not between 0 and 1")));
        }
        Ok(Self { threshold_log_odds: logit(threshold) })
    }

    /// Passes the whole map. Call it once, before the first scan.
    ///
    /// # Errors
    ///
    /// A map of another grid, a tile that cannot be read.
    pub fn take_all(&self, view: &impl MapView, sender: &mut Sender) -> Result<()> {
        check_grid(&view.config().grid, sender)?;
        view.tile_indices().into_iter().try_for_each(|tile| self.take_tile(view, tile, sender))
    }

    /// Passes the tiles that a scan may have changed. Call it after the map has inserted the scan.
    ///
    /// # Errors
    ///
    /// As for [`MapWatch::take_all`].
    pub fn take_scan(&self, view: &impl MapView, scan: &Scan, sender: &mut Sender) -> Result<()> {
        check_grid(&view.config().grid, sender)?;
        let config = view.config();
        let Some(near) = tiles_of_scan(scan, &config.grid, &config.rays) else { return Ok(()) };
        view.tile_indices()
            .into_iter()
            .filter(|tile| near.contains(*tile))
            .try_for_each(|tile| self.take_tile(view, tile, sender))
    }

    fn take_tile(&self, view: &impl MapView, index: TileIndex, sender: &mut Sender) -> Result<()> {
        let Some(tile) = view.tile(index)? else { return Ok(()) };
        for brick in tile.table().bricks() {
            let mut mask: BrickMask = [0; 8];
            tile.table().for_each_in(brick, |place, evidence| {
                mask[place / 64] |= u64::from(evidence.log_odds >= self.threshold_log_odds) << (place % 64);
            });
            sender.put_brick(index, brick, mask);
        }
        Ok(())
    }
}

fn check_grid(grid: &Grid, sender: &Sender) -> Result<()> {
    if grid == sender.grid() {
        return Ok(());
    }
    let reason = format!("the map has {grid}, but the sender has {}", sender.grid());
    Err(Error::argument("grid", reason))
}

/// Passes a local map's occupied voxels to a sender. A voxel that leaves the map because of the limit on voxels remains
/// in the set; a voxel that rays have cleared leaves the set.
#[derive(Clone, Debug)]
pub struct LocalWatch {
    seen: Option<Arc<LocalView>>,
}

impl LocalWatch {
    /// Creates a watch that has seen no scan.
    pub fn new() -> Self {
        Self { seen: None }
    }

    /// Passes the changes of a scan. Call it after the map has inserted the scan, and before its parameters change.
    ///
    /// # Errors
    ///
    /// A sender with another resolution.
    pub fn take_scan(
        &mut self,
        map: &LocalMap,
        report: &LocalReport,
        scan: &Scan,
        sender: &mut Sender,
    ) -> Result<()> {
        if map.resolution_m().to_bits() != sender.grid().resolution_m().to_bits() {
            let reason = format!(
                "{} m in the map, {} m in the sender",
                map.resolution_m(),
                sender.grid().resolution_m()
            );
            return Err(Error::argument("resolution", reason));
        }
        let now = map.view().clone();
        let changes = match &self.seen {
            Some(seen) => now.changes_since(seen),
            None => now.changes_since(&LocalMap::new(map.resolution_m(), *map.parameters())?.view().clone()),
        };
        self.seen = Some(now);
        let mut left: FxHashSet<VoxelIndex> = FxHashSet::default();
        for change in changes {
            if change.after == LocalState::Occupied {
                sender.put(change.voxel, true);
            } else if change.before == LocalState::Occupied {
                left.insert(change.voxel);
            }
        }
        if report.forgotten > 0 && !left.is_empty() {
            left = LocalRays::new(map, scan, sender.grid()).passed(left);
        }
        left.into_iter().for_each(|voxel| sender.put(voxel, false));
        Ok(())
    }
}

impl Default for LocalWatch {
    fn default() -> Self {
        Self::new()
    }
}
