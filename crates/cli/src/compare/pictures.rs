use crate::progress::Progress;
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, VoxelBox};
use voxtile::{Grid, Result};
use voxtile_compare::{Change, ChangeKind, CompareOptions, Comparison, VoxelClass, for_each_voxel};
use voxtile_pipeline::{AnyMap, common_voxels};
use voxtile_render::{Drawing, Drawn, Picture, SideAxis, View};

/// Pictures of a comparison.
pub struct Pictures {
    /// The space of both maps from above; `None` if it is empty.
    pub overlap: Option<Drawn>,
    /// The largest changes, from above and from the side.
    pub changes: Vec<[Drawn; 2]>,
}

/// Sizes in pixels: sharp in print, with a page of at most a few megabytes.
const OVERLAP_PX: [usize; 2] = [1400, 1400];
const CHANGE_PX: [usize; 2] = [480, 360];
/// Maximum number of changes with pictures.
const MAX_CHANGES: usize = 12;
/// Space around a change: a share of its longest edge, and a minimum in voxels.
const AROUND_SHARE: f64 = 0.4;
const MIN_AROUND_VOXELS: f64 = 6.0;

impl Pictures {
    /// Draws all pictures in one pass over the voxels of both maps. Memory depends on the pictures only.
    pub fn draw(
        [before, after]: [&AnyMap; 2],
        options: &CompareOptions,
        comparison: &Comparison,
        title: &str,
    ) -> Result<Self> {
        let grid = after.config().grid;
        let largest = &comparison.changes[..comparison.changes.len().min(MAX_CHANGES)];
        let overview = Picture::new().with_size_px(OVERLAP_PX).with_title(title).with_grid(false);
        let close_ups: Vec<[Picture; 2]> = largest.iter().map(close_ups).collect();
        let mut overlap = match overlap_of(before, after, options, &grid) {
            Some(voxels) => Some(overview.start_comparison(after.config(), voxels)?),
            None => None,
        };
        let mut of_changes = Vec::new();
        for (change, pictures) in largest.iter().zip(&close_ups) {
            let voxels = around(change, &grid);
            let [above, side] = pictures;
            let drawings = [
                above.start_comparison(after.config(), voxels)?,
                side.start_comparison(after.config(), voxels)?,
            ];
            of_changes.push(CloseUp { number: change.number, drawings, voxels });
            if let Some(overlap) = &mut overlap {
                overlap.add_box(change.bounds_m, change.number.to_string());
            }
        }
        let progress = Progress::over_blocks();
        for_each_voxel(
            before,
            after,
            options,
            comparison,
            &VoxelClass::ALL,
            |voxel| {
                if let Some(overlap) = &mut overlap {
                    overlap.add_compared(voxel.index, voxel.class, false);
                }
                for close_up in &mut of_changes {
                    if close_up.voxels.contains(voxel.index) {
                        let is_own = voxel.change == Some(close_up.number);
                        for drawing in &mut close_up.drawings {
                            drawing.add_compared(voxel.index, voxel.class, is_own);
                        }
                    }
                }
                Ok(())
            },
            &|done, all| progress.set(done, all),
        )?;
        // Without voxels the space of both maps is empty as well.
        let overlap = overlap.map(Drawing::finish).filter(|drawn| drawn.region_m.is_some());
        let changes = of_changes.into_iter().map(|one| one.drawings.map(Drawing::finish)).collect();
        Ok(Self { overlap, changes })
    }
}

/// A change whose pictures are drawn.
struct CloseUp<'a> {
    number: u32,
    drawings: [Drawing<'a>; 2],
    /// Voxels in the pictures.
    voxels: VoxelBox,
}

/// Returns the common space of both maps, in the region.
fn overlap_of(before: &AnyMap, after: &AnyMap, options: &CompareOptions, grid: &Grid) -> Option<VoxelBox> {
    let common = common_voxels(before, after)?;
    let voxels = match &options.region {
        Some(region) => common.intersection(&grid.voxels_in(region)),
        None => common,
    };
    (!voxels.is_empty()).then_some(voxels)
}

/// Returns the pictures of a change from above and from the side that shows its longer edge.
fn close_ups(change: &Change) -> [Picture; 2] {
    let [x, y, _] = size_m(&change.bounds_m);
    let side = View::Side(if x >= y { SideAxis::X } else { SideAxis::Y });
    [View::Above, side].map(|view| {
        Picture::new().with_view(view).with_size_px(CHANGE_PX).with_legend(false).with_grid(false)
    })
}

/// Returns the voxels of a change and around it.
fn around(change: &Change, grid: &Grid) -> VoxelBox {
    let Aabb { min, max } = change.bounds_m;
    let longest_m = size_m(&change.bounds_m).into_iter().fold(0.0, f64::max);
    let margin_m = (AROUND_SHARE * longest_m).max(MIN_AROUND_VOXELS * grid.resolution_m());
    grid.voxels_in(&Aabb { min: min.map(|k| k - margin_m), max: max.map(|k| k + margin_m) })
}

/// Returns the edges of a box in metres.
pub fn size_m(bounds_m: &Aabb) -> [f64; 3] {
    std::array::from_fn(|k| bounds_m.max[k] - bounds_m.min[k])
}

/// Returns the class of the voxels of a change.
pub fn class_of(kind: ChangeKind) -> VoxelClass {
    match kind {
        ChangeKind::Vanished => VoxelClass::Vanished,
        ChangeKind::Appeared => VoxelClass::Appeared,
    }
}
