use super::options::WhichVoxels;
use super::run::Export;
use crate::watch::Gauge;
use voxtile::mapper::{MapReader, MapView, Stoppable};
use voxtile::maths::least_logit;
use voxtile::scan::Stop;
use voxtile::sensor::probability_of;
use voxtile::space::{Aabb, Grid, Point, TileIndex, VoxelBox, VoxelIndex};
use voxtile::tile::{Voxel, VoxelLayers};
use voxtile::{Error, Layers, MapQueries, Result};
use voxtile_formats::write::{RowLayers, VoxelRow};

/// Selection of voxels, and of their content.
pub(super) struct Chosen {
    pub region: Option<Aabb>,
    /// Minimum probability. `None`: the map's threshold.
    min_probability: Option<f64>,
    /// Minimum as log-odds.
    pub min_log_odds: f64,
    /// Upper limit of log-odds, exclusive unless infinite.
    end_log_odds: f64,
    /// Layers to write.
    pub layers: Layers,
    /// Whether the points of voxels are written in place of their centers.
    pub mean_points: bool,
    /// Classes of the voxels; empty for all.
    only_classes: Vec<u8>,
}

/// Offset of a point from the center of its voxel, as a share of the voxel's edge.
pub(super) type Offset = [f64; 3];

impl Chosen {
    /// Creates the selection for a map with this threshold in log-odds.
    ///
    /// # Errors
    ///
    /// Mean points or classes are requested, and the map does not have the layer.
    pub fn of(export: &Export<'_>, threshold: f64, layers: Layers) -> Result<Self> {
        let mean_points = export.options.mean_points;
        if mean_points && !layers.shape {
            let reason = "the map has no layer shape: build it with `layers` shape; a map that keeps its scans gets \
                          layers by `voxtile remap MAP -o NEW --layers shape`";
            return Err(Error::argument("mean_points", reason));
        }
        let only_classes = export.options.only_classes.clone();
        if !only_classes.is_empty() && !layers.class {
            let reason = "the map has no layer class: build it with `layers` class; a map that keeps its scans gets \
                          layers by `voxtile remap MAP -o NEW --layers class`";
            return Err(Error::argument("only_class", reason));
        }
        let default = if export.format.needs_free_voxels { WhichVoxels::All } else { WhichVoxels::Occupied };
        let (min_probability, min_log_odds, end_log_odds) = match export.options.which.unwrap_or(default) {
            WhichVoxels::Occupied => (None, threshold, f64::INFINITY),
            WhichVoxels::Free => (Some(0.0), f64::NEG_INFINITY, threshold),
            WhichVoxels::AtLeast(probability) if probability > 0.0 => {
                (Some(probability), least_logit(probability), f64::INFINITY)
            }
            WhichVoxels::All | WhichVoxels::AtLeast(_) => (Some(0.0), f64::NEG_INFINITY, f64::INFINITY),
        };
        let layers = if export.options.with_layers { layers } else { Layers::NONE };
        let region = export.options.region;
        Ok(Self { region, min_probability, min_log_odds, end_log_odds, layers, mean_points, only_classes })
    }

    /// Returns whether log-odds are below the upper limit.
    pub fn is_below_end(&self, log_odds: f64) -> bool {
        log_odds < self.end_log_odds || self.end_log_odds == f64::INFINITY
    }

    /// Returns the number of voxels, without reading tiles if the map's log is sufficient.
    pub fn count(&self, map: &MapReader, stop: &Stop) -> Result<u64> {
        if self.region.is_none()
            && self.only_classes.is_empty()
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
        self.visit(&Stoppable::new(map, stop), |_| count += 1)?;
        Ok(count)
    }

    /// Visits the voxels tile by tile, without their layers.
    pub fn visit(&self, map: &impl MapView, mut visit: impl FnMut(Voxel)) -> Result<()> {
        if !self.only_classes.is_empty() {
            return self.visit_with_layers(
                map,
                |_| (),
                |voxel, _, _| {
                    visit(voxel);
                    Ok(())
                },
            );
        }
        map.for_each_occupied(self.min_probability, self.region.as_ref(), |voxel| {
            if self.is_below_end(voxel.evidence.log_odds) {
                visit(voxel);
            }
        })
    }

    /// Visits the voxels tile by tile until an error. `point_m` returns the point of a voxel in the file's coordinates.
    pub fn for_each(
        &self,
        map: &impl MapView,
        gauge: &dyn Gauge,
        point_m: impl Fn(VoxelIndex, Offset) -> Point,
        mut put: impl FnMut(&VoxelRow) -> Result<()>,
    ) -> Result<()> {
        let grid = map.config().grid;
        let of_map = map.config().layers();
        let mut tiles = Tiles { all: map.tile_indices(), done: 0, gauge };
        let row_of = |Voxel { index, evidence, .. }, tile: TileIndex, made: Option<VoxelLayers>| {
            let offset =
                made.as_ref().filter(|_| self.mean_points).and_then(|made| made.mean_offset(&of_map));
            VoxelRow {
                index,
                center_m: point_m(index, offset.unwrap_or_default()),
                probability: probability_of(evidence.log_odds),
                log_odds: evidence.log_odds,
                observation_count: evidence.observation_count,
                tile: tile.to_array(),
                layers: made.map_or(RowLayers::NONE, |made| RowLayers::of(&made, &self.layers)),
            }
        };
        if self.layers.is_none() && !self.mean_points && self.only_classes.is_empty() {
            let (failed, mut outcome) = (Stop::default(), Ok(()));
            let visited = self.visit(&Stoppable::new(map, &failed), |voxel| {
                let tile = grid.tile_of_voxel(voxel.index);
                tiles.reach(tile);
                if outcome.is_ok() {
                    outcome = put(&row_of(voxel, tile, None));
                }
                if outcome.is_err() {
                    failed.set();
                }
            });
            outcome?;
            visited?;
        } else {
            self.visit_with_layers(
                map,
                |index| tiles.reach(index),
                |voxel, index, made| put(&row_of(voxel, index, made)),
            )?;
        }
        tiles.pass(tiles.all.len());
        Ok(())
    }

    /// Visits the voxels with their tiles and layers until an error. Each tile is read once; `reach` receives its index
    /// before.
    fn visit_with_layers(
        &self,
        map: &impl MapView,
        mut reach: impl FnMut(TileIndex),
        mut visit: impl FnMut(Voxel, TileIndex, Option<VoxelLayers>) -> Result<()>,
    ) -> Result<()> {
        let grid = map.config().grid;
        for index in map.tile_indices() {
            reach(index);
            if !self.may_have_voxels(&grid.voxels_of_tile(index), &grid) {
                continue;
            }
            let Some(tile) = map.tile_uncached(index)? else { continue };
            for voxel in tile.voxels_from(self.min_log_odds).filter(|voxel| self.is_chosen(voxel, &grid)) {
                let made = tile.layers_of(voxel.index);
                let class = made.as_ref().and_then(VoxelLayers::class);
                if self.only_classes.is_empty()
                    || class.is_some_and(|class| self.only_classes.contains(&class))
                {
                    visit(voxel, index, made)?;
                }
            }
        }
        Ok(())
    }

    /// Returns whether a box of voxels may have some in the region.
    fn may_have_voxels(&self, voxels: &VoxelBox, grid: &Grid) -> bool {
        self.region.is_none_or(|region| !grid.voxels_in(&region).intersection(voxels).is_empty())
    }

    /// Returns whether a voxel with at least the minimum log-odds is selected.
    fn is_chosen(&self, voxel: &Voxel, grid: &Grid) -> bool {
        self.is_below_end(voxel.evidence.log_odds)
            && self.region.is_none_or(|region| region.contains(grid.center_m(voxel.index)))
    }
}

/// Progress of a walk over tiles.
struct Tiles<'a> {
    all: Vec<TileIndex>,
    done: usize,
    gauge: &'a dyn Gauge,
}

impl Tiles<'_> {
    /// Notes the tile of the current voxel.
    fn reach(&mut self, tile: TileIndex) {
        if self.all.get(self.done).is_none_or(|next| *next <= tile) {
            self.pass(self.all.partition_point(|other| *other <= tile));
        }
    }

    fn pass(&mut self, count: usize) {
        while self.done < count {
            self.gauge.step();
            self.done += 1;
        }
    }
}
