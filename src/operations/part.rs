use crate::error::{Error, Result};
use crate::space::{
    Aabb, Area, BRICK_EDGE, BrickMask, ColumnMask, Grid, TileBox, VoxelBox, VoxelIndex, add_to_mask,
    mask_of_box, place_of_voxel,
};
use std::sync::{Arc, Mutex, PoisonError};

/// Part of space: the voxels whose centers are in a half-open box, as for region queries, or all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// The voxels in the box.
    Inside(Aabb),
    /// The voxels outside the box.
    Outside(Aabb),
}

/// Part of space over an area: the voxels whose centers are in the area and between two heights, or all others.
#[derive(Clone, Debug)]
pub struct AreaPart {
    /// Area in x and y.
    pub area: Area,
    /// Lowest height in metres, included, and highest, excluded. Both may be infinite.
    pub z_m: [f64; 2],
    /// Whether the part is all other voxels.
    pub is_outside: bool,
}

/// Part of space in voxels.
#[derive(Clone, Debug)]
pub(super) struct VoxelPart {
    shape: Shape,
    is_outside: bool,
}

#[derive(Clone, Debug)]
enum Shape {
    Box(VoxelBox),
    Area(Arc<AreaVoxels>),
}

/// Voxels over an area.
#[derive(Debug)]
struct AreaVoxels {
    area: Area,
    grid: Grid,
    /// Voxels between the heights, of any x and y.
    heights: VoxelBox,
    /// Columns of the tile that was looked at last. Tiles come in columns.
    last: Mutex<Option<(VoxelBox, Arc<ColumnMask>)>>,
}

/// Share of a tile that belongs to a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Share {
    Nothing,
    Some,
    Everything,
}

impl Part {
    /// Converts the part to voxels of a grid.
    ///
    /// # Errors
    ///
    /// An empty box, a box without a voxel's center, or coordinates that are not finite.
    pub(super) fn voxels(&self, grid: &Grid) -> Result<VoxelPart> {
        let (region, is_outside) = match self {
            Self::Inside(region) => (region, false),
            Self::Outside(region) => (region, true),
        };
        if !(0..3).all(|k| region.min[k] < region.max[k]) {
            let reason = format!(
                "the minimum corner {:?} must be below the maximum corner {:?} on every axis",
                region.min, region.max
            );
            return Err(Error::argument("region", reason));
        }
        let voxels = grid.voxels_in(region);
        if voxels.is_empty() {
            let reason =
                format!("the box from {:?} to {:?} contains no center of a voxel", region.min, region.max);
            return Err(Error::argument("region", reason));
        }
        Ok(VoxelPart { shape: Shape::Box(voxels), is_outside })
    }
}

impl AreaPart {
    /// Converts the part to voxels of a grid.
    ///
    /// # Errors
    ///
    /// No center of a voxel is between the heights.
    pub(super) fn voxels(&self, grid: &Grid) -> Result<VoxelPart> {
        let [min_m, max_m] = self.z_m;
        let (min, max) =
            ([f64::NEG_INFINITY, f64::NEG_INFINITY, min_m], [f64::INFINITY, f64::INFINITY, max_m]);
        let heights = grid.voxels_in(&Aabb { min, max });
        // NaN is no height.
        let is_range = min_m < max_m;
        if !is_range || heights.is_empty() {
            let reason = format!("between {min_m} and {max_m} m there is no center of a voxel");
            return Err(Error::argument("z", reason));
        }
        let voxels = AreaVoxels { area: self.area.clone(), grid: *grid, heights, last: Mutex::default() };
        Ok(VoxelPart { shape: Shape::Area(Arc::new(voxels)), is_outside: self.is_outside })
    }
}

impl AreaVoxels {
    fn columns(&self, tile: &VoxelBox) -> Arc<ColumnMask> {
        let is_column =
            |known: &VoxelBox| (0..2).all(|k| (known.min[k], known.end[k]) == (tile.min[k], tile.end[k]));
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, columns)) = last.as_ref().filter(|(known, _)| is_column(known)) {
            return columns.clone();
        }
        let columns = Arc::new(self.area.columns(&self.grid, tile));
        *last = Some((*tile, columns.clone()));
        columns
    }

    fn share_of(&self, tile: &VoxelBox) -> Share {
        let common = self.heights.intersection(tile);
        if common.is_empty() {
            return Share::Nothing;
        }
        let columns = self.columns(tile);
        match (columns.is_empty(), columns.is_full() && common == *tile) {
            (true, _) => Share::Nothing,
            (_, true) => Share::Everything,
            _ => Share::Some,
        }
    }

    fn mask_of_brick(&self, first: VoxelIndex, tile: &VoxelBox) -> BrickMask {
        let columns = self.columns(tile);
        let mut mask = [0; 8];
        let mut column = [0; 8];
        for (dx, dy) in (0..BRICK_EDGE).flat_map(|dx| (0..BRICK_EDGE).map(move |dy| (dx, dy))) {
            if columns.contains([first[0].saturating_add(dx), first[1].saturating_add(dy)]) {
                column.fill(0);
                (0..BRICK_EDGE).for_each(|dz| add_to_mask(&mut column, place_of_voxel([dx, dy, dz])));
                (0..8).for_each(|word| mask[word] |= column[word]);
            }
        }
        let heights = mask_of_local_box(&self.heights, first);
        std::array::from_fn(|word| mask[word] & heights[word])
    }
}

/// Returns the voxels of a brick that are in a box.
fn mask_of_local_box(voxels: &VoxelBox, first: VoxelIndex) -> BrickMask {
    let local = |of: VoxelIndex| std::array::from_fn(|k| of[k].saturating_sub(first[k]));
    mask_of_box(local(voxels.min), local(voxels.end))
}

impl VoxelPart {
    /// Returns the complement of the part.
    pub(super) fn rest(&self) -> Self {
        Self { is_outside: !self.is_outside, ..self.clone() }
    }

    /// The tiles with a voxel of the bounding box of the part; `None` for all voxels outside of a box or area.
    pub(super) fn tiles(&self, grid: &Grid) -> Option<TileBox> {
        let voxels = match &self.shape {
            _ if self.is_outside => return None,
            Shape::Box(voxels) => *voxels,
            Shape::Area(over) => {
                let [[west, south], [east, north]] = over.area.bounds_m();
                let (min, max) =
                    ([west, south, f64::NEG_INFINITY], [east.next_up(), north.next_up(), f64::INFINITY]);
                over.heights.intersection(&grid.voxels_in(&Aabb { min, max }))
            }
        };
        let highest = voxels.end.map(|end| end - 1);
        (!voxels.is_empty())
            .then(|| TileBox::new(grid.tile_of_voxel(voxels.min), grid.tile_of_voxel(highest)))
    }

    pub(super) fn share_of(&self, tile: &VoxelBox) -> Share {
        let inside = match &self.shape {
            Shape::Area(voxels) => voxels.share_of(tile),
            Shape::Box(voxels) => {
                let common = voxels.intersection(tile);
                match (common.is_empty(), common == *tile) {
                    (true, _) => Share::Nothing,
                    (_, true) => Share::Everything,
                    _ => Share::Some,
                }
            }
        };
        match inside {
            Share::Nothing if self.is_outside => Share::Everything,
            Share::Everything if self.is_outside => Share::Nothing,
            share => share,
        }
    }

    /// Returns the voxels of a brick of a tile that belong to the part. `first` is the lowest voxel of the brick.
    pub(super) fn mask_of_brick(&self, first: VoxelIndex, tile: &VoxelBox) -> BrickMask {
        let mask = match &self.shape {
            Shape::Box(voxels) => mask_of_local_box(voxels, first),
            Shape::Area(voxels) => voxels.mask_of_brick(first, tile),
        };
        if self.is_outside { mask.map(|word| !word) } else { mask }
    }
}
