use super::set::VoxelSet;
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::query::{Occupancy, Queries, Shape, UnknownAs, voxels_around};
use crate::scan::{MAX_RAY_STEPS, RayWalk};
use crate::space::{Grid, Point, VoxelIndex};

/// A robot's own map with the layers of others: occupied is what is occupied in any of them.
#[derive(Clone, Copy, Debug)]
pub struct WithLayers<'a, V> {
    map: &'a V,
    layers: &'a [&'a VoxelSet],
}

impl<'a, V: MapView> WithLayers<'a, V> {
    /// A map and layers over it.
    ///
    /// # Errors
    ///
    /// A layer with another grid than the map's.
    pub fn new(map: &'a V, layers: &'a [&'a VoxelSet]) -> Result<Self> {
        let own = map.config().grid.resolution_m();
        for layer in layers {
            let theirs = layer.grid().resolution_m();
            if theirs.to_bits() != own.to_bits() {
                let reason =
                    format!("{theirs} m in a layer, {own} m in the map; share maps of one resolution");
                return Err(Error::argument("resolution", reason));
            }
        }
        Ok(Self { map, layers })
    }

    /// The occupancy of the voxel that holds a point. A voxel that only layers have counts as probability 1.
    ///
    /// # Errors
    ///
    /// A tile of the map that cannot be read.
    pub fn occupancy_at(&self, point: Point) -> Result<Occupancy> {
        let own = self.map.occupancy_at(point)?;
        let voxel = self.grid().voxel_of(point);
        let is_in_layer = voxel.is_some_and(|voxel| self.is_in_layer(voxel));
        Ok(if is_in_layer && !own.is_occupied() { Occupancy::Occupied(1.0) } else { own })
    }

    /// The first obstacle on a segment: an occupied voxel, or an unknown one if `unknown` says so.
    ///
    /// # Errors
    ///
    /// Ends without a voxel, a segment of more than a million voxels, a tile of the map that cannot be read.
    pub fn first_on_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<VoxelIndex>> {
        let grid = self.grid();
        let (Some(start), Some(last)) = (grid.voxel_of(from), grid.voxel_of(to)) else {
            return Err(Error::argument("segment", format!("{from:?} to {to:?} m: an end has no voxel")));
        };
        let mut walk = RayWalk::between(grid.to_voxel_units(from), start, grid.to_voxel_units(to), last);
        if walk.steps() > MAX_RAY_STEPS {
            return Err(Error::argument("segment", "it is more than a million voxels long"));
        }
        loop {
            let voxel = walk.voxel();
            if self.is_obstacle(voxel, unknown)? {
                return Ok(Some(voxel));
            }
            if walk.is_at_end() {
                return Ok(None);
            }
            walk.advance();
        }
    }

    /// An obstacle that a sphere touches: an occupied voxel, or an unknown one if `unknown` says so.
    ///
    /// # Errors
    ///
    /// A sphere that is not finite or too large for unknown obstacles, a tile of the map that cannot be read.
    pub fn sphere_collision(
        &self,
        center: Point,
        radius_m: f64,
        unknown: UnknownAs,
    ) -> Result<Option<VoxelIndex>> {
        let own = self.map.collision(&Shape::Sphere { center, radius_m }, unknown)?;
        // A voxel unknown to the map may be occupied in a layer; either is an obstacle.
        if own.is_some() {
            return Ok(own);
        }
        let (grid, body) = (self.grid(), Shape::Sphere { center, radius_m });
        let around = voxels_around(grid, &body.bounds()?);
        for layer in self.layers {
            // Visits existing bricks, not all voxels of the sphere.
            let found = layer.in_box(&around).find(|&voxel| body.touches_voxel(grid, voxel));
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }

    fn grid(&self) -> &Grid {
        &self.map.config().grid
    }

    fn is_in_layer(&self, voxel: VoxelIndex) -> bool {
        self.layers.iter().any(|layer| layer.contains(voxel))
    }

    fn is_obstacle(&self, voxel: VoxelIndex, unknown: UnknownAs) -> Result<bool> {
        if self.is_in_layer(voxel) {
            return Ok(true);
        }
        let own = Occupancy::of(self.map.config(), self.map.evidence(voxel)?);
        Ok(own.is_occupied() || (own == Occupancy::Unknown && unknown == UnknownAs::Obstacle))
    }
}
