//! Values of a layer after the voxels of a node, which viewers read:
//!
//! ```text
//! colour                   red[n] green[n] blue[n] is_there[n], one byte each; `is_there` is 0 or 255
//! intensity, class, time   f64 x 2: what 1 and 65535 stand for, linear between; low[n] high[n]: the bytes of a u16,
//!                          0 without a value
//! ```
//!
//! Intensities are in the unit of the points, times in seconds. The n values are in the order of the voxels.

use super::cells::Cells;
use super::layer_sums::LayerSums;
use crate::Layer;
use voxtile::{Layers, VoxelLayers};

/// Largest number for a value; the smallest is 1.
const MOST: f64 = 65535.0;
const SECONDS_A_NS: f64 = 1e-9;

/// Returns the number of a layer in the header of a node; 0 is none.
pub(super) fn number_of(layer: Layer) -> u8 {
    match layer {
        Layer::Colour => 1,
        Layer::Intensity => 2,
        Layer::Class => 3,
        Layer::Time => 4,
    }
}

/// Returns the layers of each voxel of a node; `None` where no point hit.
fn of_cells<'a>(cells: &'a Cells, sums: &'a LayerSums) -> impl Iterator<Item = Option<&'a VoxelLayers>> {
    // Both are sorted by position.
    let mut rest = sums.voxels.iter().peekable();
    cells.cells.iter().map(move |cell| {
        while rest.next_if(|(place, _)| *place < cell.place).is_some() {}
        rest.next_if(|(place, _)| *place == cell.place).map(|(_, voxel)| voxel)
    })
}

/// Returns the mean colour of each voxel of a node.
pub(super) fn colours(cells: &Cells, sums: &LayerSums) -> Vec<Option<[u8; 3]>> {
    of_cells(cells, sums).map(|voxel| voxel.and_then(VoxelLayers::mean_colour)).collect()
}

/// Encodes the values of a layer of the voxels of a node.
pub(super) fn encode(layer: Layer, cells: &Cells, sums: &LayerSums, layers: &Layers) -> Vec<u8> {
    if layer == Layer::Colour {
        let colours = colours(cells, sums);
        let plane = |k: usize| colours.iter().map(move |colour| colour.map_or(0, |colour| colour[k]));
        let is_there = colours.iter().map(|colour| if colour.is_some() { 255 } else { 0 });
        return plane(0).chain(plane(1)).chain(plane(2)).chain(is_there).collect();
    }
    let values: Vec<Option<f64>> =
        of_cells(cells, sums).map(|voxel| voxel.and_then(|voxel| value_of(layer, voxel, layers))).collect();
    let [least, most] = match layer {
        Layer::Class => [0.0, MOST - 1.0],
        Layer::Intensity => [0.0, f64::from(layers.intensity_max.unwrap_or(1.0))],
        _ => {
            let there = || values.iter().flatten().copied();
            [there().fold(f64::INFINITY, f64::min), there().fold(f64::NEG_INFINITY, f64::max)]
        }
    };
    let is_range = least < most;
    let numbers: Vec<u16> = values
        .iter()
        .map(|value| match value {
            None => 0,
            Some(value) if is_range => (1.0 + (value - least) / (most - least) * (MOST - 1.0)).round() as u16,
            Some(_) => 1,
        })
        .collect();
    let ends = if least <= most { [least, most] } else { [0.0; 2] };
    let mut bytes = ends.map(f64::to_le_bytes).as_flattened().to_vec();
    bytes.extend(numbers.iter().map(|number| *number as u8));
    bytes.extend(numbers.iter().map(|number| (number >> 8) as u8));
    bytes
}

fn value_of(layer: Layer, voxel: &VoxelLayers, layers: &Layers) -> Option<f64> {
    match layer {
        Layer::Colour => None,
        Layer::Intensity => voxel.mean_intensity(layers),
        Layer::Class => voxel.class().map(f64::from),
        Layer::Time => voxel.time.map(|time| time.last_ns as f64 * SECONDS_A_NS),
    }
}
