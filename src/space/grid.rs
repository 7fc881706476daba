use super::{Aabb, Point, TileBox, TileIndex, VoxelBox, VoxelIndex};
use std::fmt;
use thiserror::Error;

/// Maximum number of voxels along the edge of a tile.
pub const MAX_VOXELS_PER_TILE_EDGE: u32 = 1024;

/// Edge in metres that the tiles of a new map have, where it is a whole number of voxels.
const TILE_SIZE_M: f64 = 10.0;

/// Maximum number of voxels along the edge of a tile of default size: such a map fits in the default memory.
const MAX_VOXELS_OF_DEFAULT_TILE: f64 = 256.0;

/// Largest index of a voxel along an axis. The next value is only used as the end of half-open boxes.
pub const LAST_VOXEL_INDEX: i32 = i32::MAX - 1;

/// Grid with voxels of `resolution_m` and tiles of `tile_size_m`.
///
/// The voxel of a coordinate `x` is `floor(x * (1 / resolution))`, as computed by OctoMap: a multiple of the resolution
/// may be in the lower neighbour, as in OctoMap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    resolution_m: f64,
    inv_resolution: f64,
    tile_size_m: f64,
    voxels_per_tile_edge: i32,
    /// Inverse of `voxels_per_tile_edge`, in units of 2^-63.
    tiles_per_voxel: i64,
}

/// Reason why two lengths are not a valid grid.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GridError {
    /// The resolution is not a positive, finite length.
    #[error("resolution {0} m is not a positive, finite length")]
    Resolution(f64),
    /// The tile size is not a positive, finite length.
    #[error("tile size {0} m is not a positive, finite length")]
    TileSize(f64),
    /// The tile size is not a whole number (2 to 1024) of voxels.
    #[error(
        "tile size {tile_size_m} m is {ratio} voxels of {resolution_m} m; a tile edge holds a whole number of \
         voxels from 2 to 1024: the nearest valid tile sizes are {smaller_m} m and {larger_m} m"
    )]
    NotWhole {
        /// The rejected tile size in metres.
        tile_size_m: f64,
        /// The resolution in metres.
        resolution_m: f64,
        /// Tile size divided by resolution.
        ratio: f64,
        /// Nearest valid tile size below, in metres (or the smallest valid one).
        smaller_m: f64,
        /// Nearest valid tile size above, in metres (or the largest valid one).
        larger_m: f64,
    },
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "voxels of {} m in tiles of {} m", self.resolution_m, self.tile_size_m)
    }
}

impl Grid {
    /// Creates a grid with voxels of `resolution_m` and tiles of `tile_size_m`, both in metres.
    ///
    /// # Errors
    ///
    /// Fails if a length is not positive and finite, or a tile is not 2 to 1024 whole voxels.
    pub fn new(resolution_m: f64, tile_size_m: f64) -> Result<Self, GridError> {
        if !(resolution_m.is_normal() && resolution_m > 0.0 && (1.0 / resolution_m).is_finite()) {
            return Err(GridError::Resolution(resolution_m));
        }
        if !(tile_size_m.is_normal() && tile_size_m > 0.0) {
            return Err(GridError::TileSize(tile_size_m));
        }
        let ratio = tile_size_m / resolution_m;
        let whole = ratio.round();
        let in_range = (2.0..=f64::from(MAX_VOXELS_PER_TILE_EDGE)).contains(&whole);
        if !in_range || (ratio - whole).abs() > 1e-9 * whole {
            let most = f64::from(MAX_VOXELS_PER_TILE_EDGE);
            return Err(GridError::NotWhole {
                tile_size_m,
                resolution_m,
                ratio,
                smaller_m: readable(ratio.floor().clamp(2.0, most) * resolution_m),
                larger_m: readable(ratio.ceil().clamp(2.0, most) * resolution_m),
            });
        }
        Ok(Self {
            resolution_m,
            inv_resolution: 1.0 / resolution_m,
            tile_size_m,
            voxels_per_tile_edge: whole as i32,
            tiles_per_voxel: ((1_u64 << 63) / whole as u64) as i64,
        })
    }

    /// Creates a grid with voxels of `resolution_m` in metres. A tile is the whole number of voxels, from 2 to 256,
    /// whose edge is nearest to 10 m: exactly 10 m at 0.05, 0.1 or 0.2 m, 10.05 m at 0.15 m, 2.56 m at 0.01 m.
    ///
    /// # Errors
    ///
    /// Fails if the resolution is not positive and finite, or so large that a tile is not finite.
    pub fn with_resolution(resolution_m: f64) -> Result<Self, GridError> {
        let whole = (TILE_SIZE_M / resolution_m).round().clamp(2.0, MAX_VOXELS_OF_DEFAULT_TILE);
        let tile_size_m = whole * resolution_m;
        // The first length that is that many voxels: without noise of rounding, if it can be.
        [TILE_SIZE_M, readable(tile_size_m)]
            .into_iter()
            .filter_map(|length_m| Self::new(resolution_m, length_m).ok())
            .find(|grid| f64::from(grid.voxels_per_tile_edge) == whole)
            .map_or_else(|| Self::new(resolution_m, tile_size_m), Ok)
    }

    /// Returns this grid with other lengths in metres, where they are given. Without a tile size it keeps its own; if
    /// that is no whole number of the new voxels, it has the one of [`Grid::with_resolution`].
    ///
    /// # Errors
    ///
    /// As for [`Grid::new`].
    pub fn replaced(&self, resolution_m: Option<f64>, tile_size_m: Option<f64>) -> Result<Self, GridError> {
        match (resolution_m, tile_size_m) {
            (None, None) => Ok(*self),
            (None, Some(tile_size_m)) => Self::new(self.resolution_m, tile_size_m),
            (Some(resolution_m), Some(tile_size_m)) => Self::new(resolution_m, tile_size_m),
            (Some(resolution_m), None) => {
                Self::new(resolution_m, self.tile_size_m).or_else(|_| Self::with_resolution(resolution_m))
            }
        }
    }

    /// Edge of a voxel in metres.
    pub const fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Edge of a tile in metres.
    pub const fn tile_size_m(&self) -> f64 {
        self.tile_size_m
    }

    /// Voxels along the edge of a tile, 2 to 1024.
    pub const fn voxels_per_tile_edge(&self) -> i32 {
        self.voxels_per_tile_edge
    }

    /// Maximum number of tile borders that a distance in voxels crosses along an axis.
    pub(crate) fn tiles_within(&self, voxels: i32) -> i32 {
        (voxels + self.voxels_per_tile_edge - 1) / self.voxels_per_tile_edge
    }

    /// Converts a point to units of voxels: its floor is the voxel index.
    #[inline]
    pub fn to_voxel_units(&self, point_m: Point) -> Point {
        point_m.map(|coordinate| self.voxel_unit_of(coordinate))
    }

    /// Returns a coordinate in units of voxels, like [`Grid::to_voxel_units`].
    #[inline]
    pub(crate) fn voxel_unit_of(&self, coordinate_m: f64) -> f64 {
        coordinate_m * self.inv_resolution
    }

    /// The voxel that contains a point; `None` if the point is not finite or its index exceeds `i32`.
    #[inline]
    pub fn voxel_of(&self, point_m: Point) -> Option<VoxelIndex> {
        Self::voxel_of_units(self.to_voxel_units(point_m))
    }

    /// The voxel of a point in units of voxels; `None` as for [`Grid::voxel_of`].
    #[inline]
    pub fn voxel_of_units(point: Point) -> Option<VoxelIndex> {
        // NaN is not in the range either.
        let is_in_range = |x: f64| x >= f64::from(i32::MIN) && x < f64::from(i32::MAX);
        point.iter().all(|&x| is_in_range(x)).then(|| point.map(Self::floor_of_fitting))
    }

    /// The voxel of a point in units of voxels, whose index is known to fit.
    #[inline]
    pub(crate) fn voxel_of_fitting_units(point: Point) -> VoxelIndex {
        point.map(Self::floor_of_fitting)
    }

    /// Floor of a number in the range of `i32`; any number outside. Without instructions that some processors lack.
    #[inline]
    pub(crate) fn floor_of_fitting(number: f64) -> i32 {
        // Adding this to a number in this range leaves the nearest integer in the lowest bits.
        const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
        let rounded = number + ROUND;
        let nearest = rounded.to_bits() as i32;
        // If rounding up exceeds the range of `i32`, the subtraction wraps back into it.
        nearest.wrapping_sub(i32::from(rounded - ROUND > number))
    }

    /// The tile that contains a voxel.
    #[inline]
    pub fn tile_of_voxel(&self, voxel: VoxelIndex) -> TileIndex {
        // Uses the upper half of a product, because integer division is slow. The middle of a voxel is at least 2^-11
        // tiles from a tile border, and the error of the quotient is below 2^-32.
        let tile_of = |index: i32| {
            let middle = 2 * i64::from(index) + 1; // In half voxels, so the product is in units of 2^-64.
            ((i128::from(middle) * i128::from(self.tiles_per_voxel)) >> 64) as i32
        };
        TileIndex::from(voxel.map(tile_of))
    }

    /// The tile of the point's voxel; `None` as for [`Grid::voxel_of`].
    #[inline]
    pub fn tile_of(&self, point_m: Point) -> Option<TileIndex> {
        self.voxel_of(point_m).map(|voxel| self.tile_of_voxel(voxel))
    }

    /// Center of a voxel in metres: `(index + 0.5) * resolution`.
    pub fn center_m(&self, voxel: VoxelIndex) -> Point {
        voxel.map(|index| self.center_along_m(index))
    }

    /// Coordinate in metres of the centers of the voxels with this index along an axis.
    #[inline]
    pub(crate) fn center_along_m(&self, index: i32) -> f64 {
        (f64::from(index) + 0.5) * self.resolution_m
    }

    /// Lower border in metres of the voxels with this index along an axis, without rounding noise (0.3 instead of
    /// 0.30000000000000004): for display and storage.
    pub fn corner_m(&self, index: i32) -> f64 {
        let corner_m = f64::from(index) * self.resolution_m;
        let readable_m = readable(corner_m);
        // For voxels of nanometres, rounding would lose digits.
        if (readable_m - corner_m).abs() < 1e-3 * self.resolution_m { readable_m } else { corner_m }
    }

    /// The voxels whose center is in a box.
    pub fn voxels_in(&self, region: &Aabb) -> VoxelBox {
        // Centers ascend with their index, so a binary search finds the first one from a bound on.
        let first_from = |bound_m: f64| {
            let (mut low, mut high) = (i64::from(i32::MIN), i64::from(i32::MAX));
            while low < high {
                let middle = (low + high).div_euclid(2);
                let [center_m, ..] = self.center_m([middle as i32; 3]);
                if center_m >= bound_m { high = middle } else { low = middle + 1 }
            }
            low as i32
        };
        VoxelBox { min: region.min.map(first_from), end: region.max.map(first_from) }
    }

    /// The voxels of a tile. The upper end saturates for the last tile of the `i32` range.
    pub fn voxels_of_tile(&self, tile: TileIndex) -> VoxelBox {
        let n = i64::from(self.voxels_per_tile_edge);
        let min = tile.to_array().map(|index| clamp_to_i32(i64::from(index) * n));
        let end = tile.to_array().map(|index| clamp_to_i32((i64::from(index) + 1) * n));
        VoxelBox { min, end }
    }

    /// The voxels of a box of tiles; saturates like [`Grid::voxels_of_tile`].
    pub fn voxels_of_tiles(&self, tiles: TileBox) -> VoxelBox {
        let [low, high] = [tiles.min(), tiles.max()].map(|corner| self.voxels_of_tile(corner));
        VoxelBox { min: low.min, end: high.end }
    }
}

fn clamp_to_i32(value: i64) -> i32 {
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// Removes rounding noise (0.3 instead of 0.30000000000000004) from a length for display.
fn readable(length_m: f64) -> f64 {
    format!("{length_m:.9}").parse().unwrap_or(length_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_equals_the_library_function() {
        let whole = [-2_147_483_648.0, -7.0, -1.0, 0.0, 1.0, 6.0, 2_147_483_646.0];
        for number in whole.into_iter().flat_map(|x: f64| [x, x.next_up(), x + 0.25, x + 0.5, x + 0.75]) {
            assert_eq!(Grid::floor_of_fitting(number), number.floor() as i32, "{number}");
            let below = (number + 1.0).next_down();
            assert_eq!(Grid::floor_of_fitting(below), below.floor() as i32, "{below}");
        }
        assert_eq!(Grid::floor_of_fitting(-0.0), 0);
        assert_eq!(Grid::floor_of_fitting(-1e-300), -1);
    }

    #[test]
    fn example_points_have_known_voxels() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        assert_eq!(grid.voxels_per_tile_edge(), 100);
        assert_eq!(grid.tile_of([5.0, 15.0, -3.0]), Some(TileIndex::new(0, 1, -1)));
        assert_eq!(grid.tile_of([-5.0, 0.0, 25.0]), Some(TileIndex::new(-1, 0, 2)));
        assert_eq!(grid.voxel_of([-0.0, 0.05, -0.05]), Some([0, 0, -1]));
    }

    #[test]
    fn points_outside_the_grid_have_no_voxel() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9, -1e9] {
            assert_eq!(grid.voxel_of([0.0, x, 0.0]), None, "{x}");
        }
        assert!(grid.voxel_of([6_378_137.0, -6_378_137.0, 2e8]).is_some());
    }

    #[test]
    fn an_invalid_tile_size_suggests_valid_ones() {
        let message = Grid::new(0.3, 10.0).unwrap_err().to_string();
        assert!(message.contains("9.9 m and 10.2 m"), "{message}");
        let message = Grid::new(0.005, 10.0).unwrap_err().to_string();
        assert!(message.contains("5.12 m"), "{message}");
        for (resolution, tile) in
            [(0.0, 1.0), (-0.1, 1.0), (f64::NAN, 1.0), (0.1, f64::INFINITY), (1e-320, 1e-318)]
        {
            assert!(Grid::new(resolution, tile).is_err());
        }
        assert_eq!(Grid::new(0.05, 10.0).unwrap().voxels_per_tile_edge(), 200);
        assert_eq!(Grid::new(0.1, 102.4).unwrap().voxels_per_tile_edge(), 1024);
    }

    #[test]
    fn a_tile_of_any_resolution_is_nearly_10_m() {
        for resolution in [0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0 / 3.0, 0.333_333_333_3] {
            let grid = Grid::with_resolution(resolution).unwrap();
            assert_eq!(grid, Grid::new(resolution, 10.0).unwrap(), "{resolution}");
        }
        let expected = [
            (0.15, 10.05, 67),
            (0.3, 9.9, 33),
            (0.07, 10.01, 143),
            (3.0, 9.0, 3),
            (4.0, 12.0, 3),
            (7.0, 14.0, 2),
            (25.0, 50.0, 2),
            (0.04, 10.0, 250),
            (0.02, 5.12, 256),
            (0.001, 0.256, 256),
            (1e-12, 256e-12, 256),
        ];
        for (resolution, tile, voxels) in expected {
            let grid = Grid::with_resolution(resolution).unwrap();
            assert_eq!((grid.tile_size_m(), grid.voxels_per_tile_edge()), (tile, voxels), "{resolution}");
        }
        for step in 1..4000 {
            let resolution = f64::from(step) * 0.0037;
            let grid = Grid::with_resolution(resolution).unwrap();
            let off = (grid.tile_size_m() - 10.0).abs();
            let is_near = off <= resolution * 0.500_001;
            assert!(is_near || [2, 256].contains(&grid.voxels_per_tile_edge()), "{resolution}");
        }
        for wrong in [0.0, -0.1, f64::NAN, f64::INFINITY, 1e-320] {
            let error = Grid::with_resolution(wrong).unwrap_err();
            assert!(matches!(error, GridError::Resolution(_)), "{wrong}: {error}");
        }
        assert!(Grid::with_resolution(f64::MAX).is_err());
    }

    #[test]
    fn a_grid_keeps_the_lengths_that_are_not_replaced() {
        let grid = Grid::new(0.1, 5.0).unwrap();
        let lengths = |resolution, tile| {
            grid.replaced(resolution, tile).map(|grid| (grid.resolution_m(), grid.tile_size_m()))
        };
        assert_eq!(lengths(None, None), Ok((0.1, 5.0)));
        assert_eq!(lengths(None, Some(2.0)), Ok((0.1, 2.0)));
        assert_eq!(lengths(Some(0.25), None), Ok((0.25, 5.0)));
        assert_eq!(lengths(Some(0.15), None), Ok((0.15, 10.05)));
        assert!(lengths(Some(0.15), Some(5.0)).is_err());
    }

    #[test]
    fn tiles_equal_integer_division() {
        for n in 2..=1024 {
            let grid = Grid::new(1.0, f64::from(n)).unwrap();
            let borders = (-5..5).flat_map(|tile| [n * tile - 1, n * tile, n * tile + 1]);
            let far = [i32::MIN, i32::MIN + 1, i32::MAX - 1, i32::MAX, i32::MAX / n * n, i32::MIN / n * n];
            for x in borders.chain(far.into_iter().filter(|x| *x != 0)) {
                let tile = x.div_euclid(n);
                assert_eq!(grid.tile_of_voxel([x; 3]), TileIndex::new(tile, tile, tile), "{x} of {n}");
            }
        }
    }

    #[test]
    fn voxels_in_a_box_are_selected_by_center() {
        let grid = Grid::new(0.1, 0.7).unwrap();
        let bounds =
            [f64::NEG_INFINITY, -3e8, -2.95, -1.0, -0.05, 0.0, 0.049, 0.05, 0.75, 2.0, 3e8, f64::INFINITY];
        for min in bounds {
            for max in bounds {
                let region = Aabb { min: [min, -1.0, min], max: [max, 1.0, max] };
                let voxels = grid.voxels_in(&region);
                for x in (-40..40).chain([i32::MIN, i32::MAX - 1]) {
                    let voxel = [x, 3, x];
                    assert_eq!(
                        voxels.contains(voxel),
                        region.contains(grid.center_m(voxel)),
                        "{x} in {min} to {max}"
                    );
                }
            }
        }
        let nothing = grid.voxels_in(&Aabb { min: [f64::NAN; 3], max: [1.0; 3] });
        assert!(nothing.is_empty());
    }

    #[test]
    fn voxels_of_a_tile_belong_to_it() {
        let grid = Grid::new(0.1, 0.7).unwrap();
        for x in -30..30 {
            let tile = grid.tile_of_voxel([x, 0, 0]);
            let voxels = grid.voxels_of_tile(tile);
            assert!(voxels.min[0] <= x && x < voxels.end[0]);
        }
    }
}
