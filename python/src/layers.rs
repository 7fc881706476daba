//! Layers of maps: their names, attributes of points, and answers as arrays.

use crate::arrays::{PointSlice, column, doubles, rows};
use crate::errors::wrong;
use crate::source::Source;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use voxtile::mapper::MapView;
use voxtile::{Layers, MapConfig, PointAttributes, Result, Stop, VoxelLayers};
use voxtile_render::ColorMap;
use voxtile_render::classes::{class_color, class_label};

/// Reads layers from a text, such as `"colour,class"`, or from a sequence of names.
pub fn layers_of(layers: &Bound<'_, PyAny>) -> PyResult<Layers> {
    let text = match layers.extract::<String>() {
        Ok(text) => text,
        Err(_) => layers.extract::<Vec<String>>()?.join(","),
    };
    text.parse().map_err(|error: voxtile::Error| wrong(layers.py(), "layers", error.to_string()))
}

/// Label of a class, by the names of LAS, and its color: red, green and blue, 0 to 255.
#[pyfunction]
#[pyo3(signature = (class, /))]
pub fn class_style(class: u8) -> (String, (u8, u8, u8)) {
    (class_label(class), class_color(class).into())
}

/// Colors of a color map at even distances, as red, green and blue, 0 to 255. Raises ValueError for an unknown name.
#[pyfunction]
#[pyo3(signature = (name, /))]
pub fn color_map(py: Python<'_>, name: &str) -> PyResult<Vec<(u8, u8, u8)>> {
    let names = || ColorMap::all().iter().map(|map| map.name).collect::<Vec<_>>().join(", ");
    let map = ColorMap::named(name)
        .ok_or_else(|| wrong(py, "color_map", format!("{name:?} is none of {}", names())))?;
    Ok(map.stops.iter().map(|&stop| stop.into()).collect())
}

/// Takes the attributes of `points` points: colours as an array of N x 3 numbers from 0 to 255, classes as N numbers
/// from 0 to 255. NaN, and classes below 0, mean that a point has none.
pub fn attributes_of(
    points: usize,
    colours: Option<&Bound<'_, PyAny>>,
    classes: Option<&Bound<'_, PyAny>>,
) -> PyResult<PointAttributes> {
    let mut attributes = PointAttributes::default();
    if let Some(given) = colours {
        let (shape, numbers) = doubles("colours", given)?;
        if shape != [points, 3] {
            let reason = format!("must be an array of {points} x 3, not of {shape:?}");
            return Err(wrong(given.py(), "colours", reason));
        }
        let channels = numbers.iter().filter(|channel| !channel.is_nan());
        if let Some(channel) = channels.into_iter().find(|channel| !(0.0..=255.0).contains(*channel)) {
            return Err(wrong(given.py(), "colours", format!("must be from 0 to 255, not {channel}")));
        }
        let colour = |rgb: &[f64; 3]| {
            let has_colour = rgb.iter().all(|channel| !channel.is_nan());
            has_colour.then(|| rgb.map(|channel| channel.round() as u8))
        };
        attributes.colours = numbers.as_chunks().0.iter().map(colour).collect();
    }
    if let Some(given) = classes {
        let (shape, numbers) = doubles("classes", given)?;
        if shape != [points] {
            let reason = format!("must be an array of {points}, not of {shape:?}");
            return Err(wrong(given.py(), "classes", reason));
        }
        if let Some(class) = numbers.iter().find(|class| **class > 255.0 || class.fract() > 0.0) {
            return Err(wrong(
                given.py(),
                "classes",
                format!("must be whole numbers up to 255, not {class}"),
            ));
        }
        attributes.classes = numbers.iter().map(|class| (*class >= 0.0).then_some(*class as u8)).collect();
    }
    Ok(attributes)
}

/// Returns the layers at points, in their order.
pub fn layers_at(source: &Source, stop: &Stop, points: PointSlice<'_>) -> Result<Vec<Option<VoxelLayers>>> {
    let points = points.to_vec();
    source.ask(stop, |map| {
        let grid = map.config().grid;
        // In the order of tiles, so that each is read once.
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|&number| grid.tile_of(points[number]));
        let mut answers = vec![None; points.len()];
        for of_tile in order.chunk_by(|&a, &b| grid.tile_of(points[a]) == grid.tile_of(points[b])) {
            stop.check()?;
            let Some(tile) = of_tile.first().and_then(|&first| grid.tile_of(points[first])) else { continue };
            let Some(tile) = map.tile(tile)? else { continue };
            for &number in of_tile {
                answers[number] = grid.voxel_of(points[number]).and_then(|voxel| tile.layers_of(voxel));
            }
        }
        Ok(answers)
    })
}

/// Converts the layers of voxels to arrays by name.
pub fn arrays<'py>(
    py: Python<'py>,
    config: &MapConfig,
    voxels: &[Option<VoxelLayers>],
) -> PyResult<Bound<'py, PyDict>> {
    let (layers, edge_m) = (config.layers(), config.grid.resolution_m());
    let arrays = PyDict::new(py);
    let each = |of: &dyn Fn(&VoxelLayers) -> Option<f64>| -> Vec<f64> {
        voxels.iter().map(|voxel| voxel.as_ref().and_then(of).unwrap_or(f64::NAN)).collect()
    };
    let points = |voxel: &Option<VoxelLayers>| voxel.as_ref().map_or(0, |voxel| voxel.points);
    arrays.set_item("points", column(py, voxels.iter().map(points).collect::<Vec<u64>>()))?;
    if layers.colour {
        let colour = |voxel: &Option<VoxelLayers>| {
            let sums = voxel.as_ref().map(|voxel| voxel.colour).filter(|sums| sums.points > 0);
            sums.map_or([f64::NAN; 3], |sums| {
                [sums.red, sums.green, sums.blue].map(|sum| sum as f64 / sums.points as f64)
            })
        };
        arrays.set_item("colour", rows(py, voxels.iter().map(colour).collect())?)?;
    }
    if layers.intensity_max.is_some() {
        arrays.set_item("intensity", column(py, each(&|voxel| voxel.mean_intensity(&layers))))?;
        arrays
            .set_item("intensity_deviation", column(py, each(&|voxel| voxel.intensity_deviation(&layers))))?;
    }
    if layers.class {
        let class =
            |voxel: &Option<VoxelLayers>| voxel.as_ref().and_then(VoxelLayers::class).map_or(-1, i16::from);
        arrays.set_item("class", column(py, voxels.iter().map(class).collect::<Vec<i16>>()))?;
    }
    if layers.time {
        // NumPy's "not a time" is the lowest integer.
        let times = voxels.iter().map(|voxel| voxel.as_ref().and_then(|voxel| voxel.time));
        let first: Vec<i64> = times.clone().map(|time| time.map_or(i64::MIN, |time| time.first_ns)).collect();
        let last: Vec<i64> = times.map(|time| time.map_or(i64::MIN, |time| time.last_ns)).collect();
        arrays.set_item("first_ns", column(py, first))?;
        arrays.set_item("last_ns", column(py, last))?;
    }
    if layers.shape {
        let offset = |voxel: &Option<VoxelLayers>| {
            let mean = voxel.as_ref().and_then(|voxel| voxel.mean_offset(&layers));
            mean.map_or([f64::NAN; 3], |mean| mean.map(|share| share * edge_m))
        };
        let covariance = |voxel: &Option<VoxelLayers>| {
            let all = voxel.as_ref().and_then(|voxel| voxel.covariance(&layers));
            all.map_or([f64::NAN; 6], |all| all.map(|share| share * edge_m * edge_m))
        };
        arrays.set_item("mean_offset", rows(py, voxels.iter().map(offset).collect())?)?;
        arrays.set_item("covariance", rows(py, voxels.iter().map(covariance).collect())?)?;
    }
    Ok(arrays)
}
