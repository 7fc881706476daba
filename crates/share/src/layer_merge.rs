use super::set::VoxelSet;
use super::set_range::SetRange;
use voxtile::mapper::Mapper;
use voxtile::query::Queries;
use voxtile::scan::PointBatch;
use voxtile::space::Point;
use voxtile::{Error, Result};

/// Counts of a layer that was merged into a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct LayerMergeReport {
    /// Voxels of the layer.
    pub voxels: u64,
    /// Voxels that are already occupied in the map and are left unchanged.
    pub known: u64,
    /// Voxels that received a hit.
    pub hits: u64,
}

/// Maximum voxels per batch: a tile may hold a billion voxels.
const VOXELS_AT_A_TIME: usize = 1 << 16;

/// Merges a layer into a map: each voxel of the layer that is not occupied in the map gets one hit. The map's own scans
/// therefore weigh more, and merging the same layer again changes only the voxels that are still not occupied after one
/// hit.
///
/// # Errors
///
/// A map with another resolution or with a sensor model that needs intensities; a tile that cannot be read or written.
/// After an error, the voxels merged so far remain in the map.
pub fn merge_layer(layer: &VoxelSet, mapper: &mut impl Mapper) -> Result<LayerMergeReport> {
    if mapper.config().grid.resolution_m().to_bits() != layer.grid().resolution_m().to_bits() {
        let reason = format!(
            "{} m in the map, {} m in the layer",
            mapper.config().grid.resolution_m(),
            layer.grid().resolution_m()
        );
        return Err(Error::argument("resolution", reason));
    }
    let mut report = LayerMergeReport { voxels: layer.len(), ..LayerMergeReport::default() };
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
