use super::set::VoxelSet;
use super::set_range::SetRange;
use crate::error::{Error, Result};
use crate::mapper::Mapper;
use crate::query::Questions;
use crate::scan::PointBatch;
use crate::space::Point;

/// What folding a layer into an archive has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct FoldReport {
    /// Voxels of the layer.
    pub voxels: u64,
    /// Of these, voxels that are occupied in the archive already, and stay as they are.
    pub known: u64,
    /// Voxels that got a hit.
    pub hits: u64,
}

/// Voxels of a batch: a tile may hold a billion.
const VOXELS_AT_A_TIME: usize = 1 << 16;

/// Folds a layer into an archive: every voxel of the layer that is not occupied in the archive gets one hit, tile by tile
/// in batches. So what the archive knows of its own scans weighs more, and folding the same layer again changes only what
/// one hit has not made occupied.
///
/// # Errors
///
/// An archive with other voxels, or whose sensor model needs intensities; a tile that cannot be read or written. What was
/// folded before an error stays.
pub fn fold_layer(layer: &VoxelSet, mapper: &mut impl Mapper) -> Result<FoldReport> {
    if mapper.config().grid.resolution_m().to_bits() != layer.grid().resolution_m().to_bits() {
        let reason = format!(
            "{} m in the map, {} m in the layer",
            mapper.config().grid.resolution_m(),
            layer.grid().resolution_m()
        );
        return Err(Error::argument("resolution", reason));
    }
    let mut report = FoldReport { voxels: layer.len(), ..FoldReport::default() };
    let tiles = layer.tiles().map(|tile| layer.in_range(SetRange::of_tiles(tile, tile)));
    for mut voxels in tiles {
        loop {
            let some = voxels.by_ref().take(VOXELS_AT_A_TIME);
            let centers: Vec<Point> = some.map(|voxel| layer.grid().center_m(voxel)).collect();
            if centers.is_empty() {
                break;
            }
            let occupancies = mapper.occupancy_at_points(&centers)?;
            let new = centers.iter().zip(&occupancies).filter(|(_, occupancy)| !occupancy.is_occupied());
            let points: Vec<Point> = new.map(|(center, _)| *center).collect();
            report.known += (centers.len() - points.len()) as u64;
            report.hits += points.len() as u64;
            if !points.is_empty() {
                let is_occupied = vec![true; points.len()];
                mapper.batch_update(&PointBatch {
                    points: &points,
                    intensities: None,
                    is_occupied: &is_occupied,
                })?;
            }
        }
    }
    Ok(report)
}
