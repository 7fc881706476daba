use super::UnknownAs;
use super::region::{tiles_in, voxels_around, voxels_in};
use super::tile_cursor::TileCursor;
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Aabb, Grid, Point, VoxelBox, VoxelIndex};

/// A solid body; touching counts as collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Its center in metres.
        center: Point,
        /// Its radius in metres.
        radius_m: f64,
    },
    /// An axis-aligned box.
    Box(Aabb),
}

/// Unknown space is searched voxel by voxel, up to this number.
const MAX_UNKNOWN_VOXELS: u64 = 1 << 28;

pub(super) fn collision(view: &impl MapView, body: &Shape, unknown: UnknownAs) -> Result<Option<VoxelIndex>> {
    let config = view.config();
    let around = voxels_around(&config.grid, &body.bounds()?);
    let occupied_from = config.occupied_log_odds();
    let touches = |voxel: VoxelIndex| body.touches_voxel(&config.grid, voxel);
    if unknown == UnknownAs::Obstacle {
        return first_not_free(view, &around, touches);
    }
    for index in tiles_in(view, &around) {
        let Some(tile) = view.tile(index)? else { continue };
        let mut occupied = voxels_in(&tile, &around)
            .filter(|voxel| voxel.evidence.log_odds >= occupied_from)
            .map(|voxel| voxel.index);
        if let Some(voxel) = occupied.find(|&voxel| touches(voxel)) {
            return Ok(Some(voxel));
        }
    }
    Ok(None)
}

fn first_not_free(
    view: &impl MapView,
    around: &VoxelBox,
    touches: impl Fn(VoxelIndex) -> bool,
) -> Result<Option<VoxelIndex>> {
    let size: u64 =
        (0..3).map(|k| u64::from(around.end[k].abs_diff(around.min[k]))).fold(1, u64::saturating_mul);
    if size > MAX_UNKNOWN_VOXELS {
        let hint = "take a smaller body, or count unknown as free";
        return Err(Error::TooLarge {
            what: "number of voxels in the body",
            size,
            limit: MAX_UNKNOWN_VOXELS,
            hint,
        });
    }
    let occupied_from = view.config().occupied_log_odds();
    let mut tiles = TileCursor::new(view);
    for x in around.min[0]..around.end[0] {
        for y in around.min[1]..around.end[1] {
            for z in around.min[2]..around.end[2] {
                let voxel = [x, y, z];
                if touches(voxel) {
                    let evidence = tiles.tile_of(voxel)?.and_then(|tile| tile.evidence(voxel));
                    if evidence.is_none_or(|evidence| evidence.log_odds >= occupied_from) {
                        return Ok(Some(voxel));
                    }
                }
            }
        }
    }
    Ok(None)
}

impl Shape {
    /// The smallest box around the body.
    pub(crate) fn bounds(&self) -> Result<Aabb> {
        let bounds = match *self {
            Self::Sphere { radius_m, .. } if radius_m < 0.0 || radius_m.is_nan() => {
                return Err(Error::argument("radius", format!("{radius_m} m is not a length of at least 0")));
            }
            Self::Sphere { center, radius_m } => {
                Aabb { min: center.map(|c| c - radius_m), max: center.map(|c| c + radius_m) }
            }
            Self::Box(bounds) => bounds,
        };
        let finite = bounds.min.iter().chain(&bounds.max).all(|coordinate| coordinate.is_finite());
        if finite { Ok(bounds) } else { Err(Error::argument("body", format!("{bounds} is not finite"))) }
    }

    /// Whether the body touches a voxel.
    pub(crate) fn touches_voxel(&self, grid: &Grid, voxel: VoxelIndex) -> bool {
        self.touches(&voxel_bounds(grid, voxel))
    }

    fn touches(&self, voxel: &Aabb) -> bool {
        match self {
            Self::Sphere { center, radius_m } => voxel.distance_squared(*center) <= radius_m * radius_m,
            Self::Box(body) => (0..3).all(|k| body.min[k] <= voxel.max[k] && voxel.min[k] <= body.max[k]),
        }
    }
}

fn voxel_bounds(grid: &Grid, voxel: VoxelIndex) -> Aabb {
    let corner = |index: i32| f64::from(index) * grid.resolution_m();
    Aabb { min: voxel.map(corner), max: voxel.map(|index| corner(index.saturating_add(1))) }
}
