//! `voxtile.DistanceField`, and fields in folders.

use crate::arrays::{PointSlice, Points, column, doubles, object, rows};
use crate::config::bytes_of;
use crate::errors::{exception, wrong};
use crate::map::region_of;
use crate::operations::{Callback, MapOrSnapshot, reported};
use crate::watched::finished;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::space::VoxelBox;
use voxtile::{Aabb, Error, Point, Result};
use voxtile_distance::{
    Clearance, Distance, DistanceAndGradient, DistanceOptions, FieldOptions, FieldReader, UnknownRule,
    VoxelDistance, compute_field,
};

/// Points per query before the next check for a stop.
const POINTS_AT_A_TIME: usize = 1 << 18;
/// Memory for tiles of a field in a folder.
const DEFAULT_BYTES: usize = 256 << 20;

/// Parses the parameters of a field.
pub fn options_of(
    py: Python<'_>,
    max_distance: f64,
    unknown: &str,
    signed: bool,
) -> PyResult<DistanceOptions> {
    let unknown = match unknown {
        "unknown" => UnknownRule::Unknown,
        "free" => UnknownRule::Free,
        "obstacle" => UnknownRule::Obstacle,
        other => {
            let reason = format!("{other:?} is not one of 'unknown', 'free', 'obstacle'");
            return Err(wrong(py, "unknown", reason));
        }
    };
    Ok(DistanceOptions::new(max_distance).with_unknown(unknown).with_sign(signed))
}

/// Computes the distances of a map's voxels to the nearest obstacle in a folder, or updates them by what changed in the
/// map. `map` is a folder or a tuple of a folder and the name of a snapshot. Returns the counts that `voxtile distance
/// --json` prints.
#[pyfunction]
#[pyo3(signature = (map, folder, *, max_distance=5.0, unknown="unknown", signed=false, region=None, memory=None,
    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn compute_distances<'py>(
    py: Python<'py>,
    map: MapOrSnapshot,
    folder: PathBuf,
    max_distance: f64,
    unknown: &str,
    signed: bool,
    region: Option<Bound<'py, PyAny>>,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let distances = options_of(py, max_distance, unknown, signed)?;
    let region = region.as_ref().map(region_of).transpose()?;
    let memory_bytes = memory.as_ref().map(bytes_of).transpose()?.unwrap_or(DEFAULT_BYTES);
    reported(py, progress, |stop, progress| {
        let map = map.open()?;
        let options = FieldOptions::new(distances)
            .with_region(region)
            .with_memory(memory_bytes)
            .with_map_id(map.metadata().ext.as_ref().map(|ext| ext.map_id.clone()))
            .with_stop(stop.clone());
        compute_field(&map, &folder, &options, &|done, all| progress.report(done, all))
    })
}

/// Distances to the nearest obstacle: of a box in memory (`Map.distance_field`), or in a folder
/// (`voxtile.compute_distances`).
///
/// Points are arrays of N x 3 in metres. Distances are interpolated between the centers of voxels, in metres: NaN where
/// unknown, at most `max_distance`, negative inside obstacles of a signed field.
#[pyclass(frozen, module = "voxtile")]
pub struct DistanceField(Arc<Field>);

enum Field {
    Memory(voxtile_distance::DistanceField),
    Folder(Box<FieldReader>),
}

type WithGradient<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

impl Field {
    fn options(&self) -> DistanceOptions {
        match self {
            Self::Memory(field) => field.options(),
            Self::Folder(field) => field.options(),
        }
    }

    fn grid(&self) -> voxtile::Grid {
        match self {
            Self::Memory(field) => field.grid(),
            Self::Folder(field) => field.grid(),
        }
    }

    fn at(&self, points: &[Point]) -> Result<Vec<DistanceAndGradient>> {
        match self {
            Self::Memory(field) => Ok(field.distance_and_gradient_at(points)),
            Self::Folder(field) => field.distance_and_gradient_at(points),
        }
    }

    fn voxel_box(&self) -> Option<VoxelBox> {
        match self {
            Self::Memory(field) => Some(field.voxel_box()),
            Self::Folder(field) => field.tile_bounds().map(|tiles| field.grid().voxels_of_tiles(tiles)),
        }
    }

    fn load(&self, region: Option<&Aabb>) -> Result<voxtile_distance::DistanceField> {
        match (self, region) {
            (Self::Folder(field), Some(region)) => field.load(region),
            (Self::Folder(_), None) => {
                Err(Error::argument("region", "is needed, because the field is in a folder"))
            }
            (Self::Memory(field), Some(region)) => field.part(region),
            (Self::Memory(field), None) => Ok(field.clone()),
        }
    }
}

impl DistanceField {
    pub fn new(field: voxtile_distance::DistanceField) -> Self {
        Self(Arc::new(Field::Memory(field)))
    }

    fn ask(&self, points: &Bound<'_, PyAny>) -> PyResult<Vec<DistanceAndGradient>> {
        let py = points.py();
        let points = Points::of("points", points)?;
        let points: PointSlice<'_> = points.slice()?;
        let (points, field) = (points.to_vec(), self.0.clone());
        if points.len() <= POINTS_AT_A_TIME {
            return py.detach(|| field.at(&points)).map_err(|error| exception(py, &error));
        }
        finished(py, move |stop| {
            let mut all = Vec::with_capacity(points.len());
            for points in points.chunks(POINTS_AT_A_TIME) {
                stop.check()?;
                all.extend(field.at(points)?);
            }
            Ok(all)
        })
    }

    fn in_metres(&self, found: &[DistanceAndGradient]) -> Vec<f64> {
        let max_distance_m = self.0.options().max_distance_m;
        found.iter().map(|found| found.distance.capped_m(max_distance_m).unwrap_or(f64::NAN)).collect()
    }
}

#[pymethods]
impl DistanceField {
    /// Opens a field in a folder. `memory` is for its tiles, such as "256MiB".
    #[staticmethod]
    #[pyo3(signature = (folder, *, memory=None))]
    fn open(py: Python<'_>, folder: PathBuf, memory: Option<Bound<'_, PyAny>>) -> PyResult<Self> {
        let memory_bytes = memory.as_ref().map(bytes_of).transpose()?.unwrap_or(DEFAULT_BYTES);
        let field = finished(py, move |_| FieldReader::open(folder, memory_bytes))?;
        Ok(Self(Arc::new(Field::Folder(Box::new(field)))))
    }

    /// Edge of a voxel in metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.0.grid().resolution_m()
    }

    /// Cap of the distances in metres.
    #[getter]
    fn max_distance(&self) -> f64 {
        self.0.options().max_distance_m
    }

    /// Treatment of unknown voxels: "unknown", "free" or "obstacle".
    #[getter]
    fn unknown(&self) -> &'static str {
        match self.0.options().unknown {
            UnknownRule::Unknown => "unknown",
            UnknownRule::Free => "free",
            UnknownRule::Obstacle => "obstacle",
        }
    }

    /// Whether distances inside obstacles are negative.
    #[getter]
    fn signed(&self) -> bool {
        self.0.options().is_signed
    }

    /// Lower and upper corner of the field in metres, 2 x 3; `None` if it is empty.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let grid = self.0.grid();
        let corners = self
            .0
            .voxel_box()
            .map(|voxels| [voxels.min, voxels.end].map(|corner| corner.map(|k| grid.corner_m(k))));
        corners.map(|corners| rows(py, corners.to_vec())).transpose()
    }

    /// Distances at points: `float64`.
    fn at<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(column(points.py(), self.in_metres(&self.ask(points)?)))
    }

    /// Distances at points, and their gradients (N x 3): the change of the distance per metre, away from obstacles. Zero
    /// where the distance is unknown or beyond `max_distance`.
    fn at_with_gradient<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<WithGradient<'py>> {
        let found = self.ask(points)?;
        let gradients = found.iter().map(|found| found.gradient).collect();
        Ok((column(points.py(), self.in_metres(&found)), rows(points.py(), gradients)?))
    }

    /// Checks that a path, given by its corners, is at least `radius` away from obstacles. Unknown distances block it.
    /// Returns a dict: "clear", "min_distance" in metres, and "blocked", the first point that is not clear, or `None`.
    fn clearance_along<'py>(&self, path: &Bound<'py, PyAny>, radius: f64) -> PyResult<Bound<'py, PyAny>> {
        let py = path.py();
        let (shape, corners) = doubles("path", path)?;
        if !matches!(shape[..], [_, 3] | [0]) {
            return Err(wrong(py, "path", format!("must be an array of N x 3, not of {shape:?}")));
        }
        let path = corners.as_chunks().0.to_vec();
        let field = self.0.clone();
        let Clearance { min_distance_m, blocked } = finished(py, move |_| match &*field {
            Field::Memory(field) => field.clearance_along(&path, radius),
            Field::Folder(field) => field.clearance_along(&path, radius),
        })?;
        let found = serde_json::json!({
            "clear": blocked.is_none(),
            "min_distance": min_distance_m,
            "blocked": blocked.map(|blocked| blocked.point),
        });
        object(py, &found)
    }

    /// Distances of the voxels of a region as an array with axes x, y, z, and the center of the first voxel in metres. A
    /// field in a folder needs a region.
    ///
    /// `values` is "metres" (`float32`: NaN for unknown, infinite beyond `max_distance`) or "squared_voxels" (`int16`,
    /// exact: 32766 beyond, 32767 unknown).
    #[pyo3(signature = (region=None, values="metres"))]
    fn to_dense<'py>(
        &self,
        py: Python<'py>,
        region: Option<Bound<'py, PyAny>>,
        values: &str,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>)> {
        let is_metres = match values {
            "metres" => true,
            "squared_voxels" => false,
            other => {
                let reason = format!("{other:?} is neither 'metres' nor 'squared_voxels'");
                return Err(wrong(py, "values", reason));
            }
        };
        let region = region.as_ref().map(region_of).transpose()?;
        let field = self.0.clone();
        let loaded = finished(py, move |_| field.load(region.as_ref()))?;
        let (voxels, resolution_m) = (loaded.voxel_box(), loaded.grid().resolution_m());
        let distances = py.detach(|| loaded.to_array());
        let edges = [2, 1, 0].map(|k| i64::from(voxels.end[k]) - i64::from(voxels.min[k]));
        let array = match is_metres {
            true => {
                let metres = |distance: &VoxelDistance| match distance.in_metres(resolution_m) {
                    Distance::Unknown => f32::NAN,
                    Distance::Within(distance_m) => distance_m as f32,
                    Distance::Beyond => f32::INFINITY,
                    Distance::DeepInside => f32::NEG_INFINITY,
                };
                column(py, distances.iter().map(metres).collect()).into_any()
            }
            false => column(py, distances.iter().map(|distance| distance.to_bits()).collect()).into_any(),
        };
        let by_z = array.call_method1("reshape", (edges.map(|edge| edge.max(0)),))?;
        Ok((by_z.getattr("T")?, column(py, loaded.grid().center_m(voxels.min).to_vec())))
    }

    fn __repr__(&self) -> String {
        let (resolution_m, options) = (self.0.grid().resolution_m(), self.0.options());
        let signed = if options.is_signed { ", signed" } else { "" };
        format!(
            "<voxtile.DistanceField: voxels of {resolution_m} m, up to {} m{signed}>",
            options.max_distance_m
        )
    }
}
