use super::options::WhichVoxels;
use super::run::Export;
use crate::watch::Gauge;
use voxtile::mapper::{MapReader, MapView, Stoppable};
use voxtile::maths::least_logit;
use voxtile::scan::Stop;
use voxtile::sensor::Probabilities;
use voxtile::space::{Aabb, Point, TileIndex, VoxelIndex};
use voxtile::tile::Voxel;
use voxtile::{MapQueries, Result};
use voxtile_formats::write::{RowLayers, VoxelRow};

/// Whether voxels are passed with their layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WithLayers {
    Yes,
    No,
}

/// Selection of voxels.
pub(super) struct Chosen {
    pub region: Option<Aabb>,
    /// Minimum probability. `None`: the map's threshold.
    min_probability: Option<f64>,
    /// Minimum as log-odds.
    pub min_log_odds: f64,
    /// Upper limit of log-odds, exclusive unless infinite.
    end_log_odds: f64,
}

impl Chosen {
    /// Creates the selection for a map with this threshold in log-odds.
    pub fn of(export: &Export<'_>, threshold: f64) -> Self {
        let default = if export.format.needs_free_voxels { WhichVoxels::All } else { WhichVoxels::Occupied };
        let (min_probability, min_log_odds, end_log_odds) = match export.options.which.unwrap_or(default) {
            WhichVoxels::Occupied => (None, threshold, f64::INFINITY),
            WhichVoxels::Free => (Some(0.0), f64::NEG_INFINITY, threshold),
            WhichVoxels::AtLeast(probability) if probability > 0.0 => {
                (Some(probability), least_logit(probability), f64::INFINITY)
            }
            WhichVoxels::All | WhichVoxels::AtLeast(_) => (Some(0.0), f64::NEG_INFINITY, f64::INFINITY),
        };
        Self { region: export.options.region, min_probability, min_log_odds, end_log_odds }
    }

    /// Returns whether log-odds are below the upper limit.
    pub fn is_below_end(&self, log_odds: f64) -> bool {
        log_odds < self.end_log_odds || self.end_log_odds == f64::INFINITY
    }

    /// Returns the number of voxels, without reading tiles if the map's log is sufficient.
    pub fn count(&self, map: &MapReader, stop: &Stop) -> Result<u64> {
        if self.region.is_none()
            && let Some((voxels, occupied)) = map.voxel_counts()
        {
            match self.min_probability {
                None => return Ok(occupied),
                Some(0.0) if self.end_log_odds == f64::INFINITY => return Ok(voxels),
                Some(0.0) => return Ok(voxels - occupied),
                Some(_) => {}
            }
        }
        let mut count = 0;
        self.visit(&Stoppable::new(map, stop), |voxel| {
            count += u64::from(self.is_below_end(voxel.evidence.log_odds));
        })?;
        Ok(count)
    }

    fn visit(&self, map: &impl MapView, visit: impl FnMut(Voxel)) -> Result<()> {
        map.for_each_occupied(self.min_probability, self.region.as_ref(), visit)
    }

    /// Visits the voxels tile by tile until an error, with their centers in the file's coordinates.
    pub fn for_each(
        &self,
        map: &impl MapView,
        gauge: &dyn Gauge,
        with_layers: WithLayers,
        center_m: impl Fn(VoxelIndex) -> Point,
        mut visit: impl FnMut(&VoxelRow) -> Result<()>,
    ) -> Result<()> {
        let grid = map.config().grid;
        let layers = map.config().layers();
        let has_layers = with_layers == WithLayers::Yes && !layers.is_none();
        let mut of_tile = None;
        let mut tiles = Tiles { all: map.tile_indices(), done: 0, now: None, gauge };
        let mut probabilities = Probabilities::default();
        let (failed, mut outcome) = (Stop::default(), Ok(()));
        let visited = self.visit(&Stoppable::new(map, &failed), |Voxel { index, evidence, .. }| {
            if outcome.is_err() || !self.is_below_end(evidence.log_odds) {
                return;
            }
            let tile = grid.tile_of_voxel(index);
            if tiles.reach(tile) && has_layers {
                of_tile = match map.tile_uncached(tile) {
                    Ok(found) => found,
                    Err(error) => {
                        outcome = Err(error);
                        failed.set();
                        return;
                    }
                };
            }
            let of_voxel = of_tile.as_ref().and_then(|tile| tile.layers_of(index));
            outcome = visit(&VoxelRow {
                index,
                center_m: center_m(index),
                probability: probabilities.of(evidence.log_odds),
                log_odds: evidence.log_odds,
                observation_count: evidence.observation_count,
                tile: tile.to_array(),
                layers: of_voxel.map_or(RowLayers::default(), |made| RowLayers::of(&made, &layers)),
            });
            if outcome.is_err() {
                failed.set();
            }
        });
        outcome?;
        visited?;
        tiles.pass(tiles.all.len());
        Ok(())
    }
}

/// Progress of a walk over tiles.
struct Tiles<'a> {
    all: Vec<TileIndex>,
    done: usize,
    now: Option<TileIndex>,
    gauge: &'a dyn Gauge,
}

impl Tiles<'_> {
    /// Notes the tile of the current voxel; returns whether it is another one than before.
    fn reach(&mut self, tile: TileIndex) -> bool {
        let is_next = self.now.replace(tile) != Some(tile);
        if is_next {
            self.pass(self.all.partition_point(|other| *other <= tile));
        }
        is_next
    }

    fn pass(&mut self, count: usize) {
        while self.done < count {
            self.gauge.step();
            self.done += 1;
        }
    }
}
