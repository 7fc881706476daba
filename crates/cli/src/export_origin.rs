use crate::output_file::{OutputFile, is_standard_output};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use voxtile::space::{Grid, Point, VoxelBox, VoxelIndex};
use voxtile::{Error, Result};
use voxtile_formats::VoxelFile;

/// Where in the map a file has its coordinates 0 0 0: the lower corner of a voxel, so that the file's voxels are the
/// map's, moved by whole voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExportOrigin {
    pub voxel: VoxelIndex,
    /// The voxel's lower corner in metres.
    pub corner_m: Point,
    /// What was asked for, if that is no such corner.
    pub asked_m: Option<Point>,
}

/// Nearer to the map's origin than so many voxels, `f32` is exact enough as it is: to a 128th of a voxel.
const NEAR_VOXELS: i64 = 1 << 17;
/// The origin of a file that chooses it itself: round in metres, too, where the resolution is.
const STEP_VOXELS: i64 = 10_000;

impl ExportOrigin {
    /// The voxel corner next to a point in metres.
    ///
    /// # Errors
    ///
    /// A point that is not finite, or too far away for a voxel to be there.
    pub fn near(asked_m: Point, grid: &Grid) -> Result<Self> {
        let units = grid.to_voxel_units(asked_m);
        let voxel = units.map(f64::round);
        // False for NaN, too.
        let is_index = |x: &f64| *x >= f64::from(i32::MIN) && *x <= f64::from(i32::MAX);
        if !voxel.iter().all(is_index) {
            let reason = format!(
                "{asked_m:?} m is not finite, or too far away for voxels of {} m",
                grid.resolution_m()
            );
            return Err(Error::argument("--origin", reason));
        }
        // A thousandth: what is typed in metres is seldom the corner to the last bit.
        let is_corner = (0..3).all(|k| (units[k] - voxel[k]).abs() < 1e-3);
        let origin = Self::at(voxel.map(|x| x as i32), grid);
        Ok(Self { asked_m: (!is_corner).then_some(asked_m), ..origin })
    }

    /// The origin of a PCD file of voxels in a box: the map's own where `f32` has room for the coordinates, else a
    /// round place in their middle.
    ///
    /// # Errors
    ///
    /// Voxels too far apart for any origin.
    pub fn for_pcd(voxels: &VoxelBox, grid: &Grid) -> Result<Self> {
        let reach = i64::from(VoxelFile::PCD_REACH_VOXELS);
        let mut voxel = [0; 3];
        for (axis, origin) in voxel.iter_mut().enumerate() {
            let (min, end) = (i64::from(voxels.min[axis]), i64::from(voxels.end[axis]));
            if min >= -NEAR_VOXELS && end <= NEAR_VOXELS {
                continue;
            }
            let middle = ((min + end).div_euclid(2) + STEP_VOXELS / 2).div_euclid(STEP_VOXELS) * STEP_VOXELS;
            if min - middle < -reach || end - middle > reach {
                let width_m = 2.0 * reach as f64 * grid.resolution_m();
                let reason = format!(
                    "coordinates of a .pcd are float32, which tell voxels of {} m apart over {width_m} m, and the map is wider; \
                     export .ply, or region by region (--region)",
                    grid.resolution_m()
                );
                return Err(Error::argument("--output", reason));
            }
            *origin = middle.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        }
        Ok(Self::at(voxel, grid))
    }

    fn at(voxel: VoxelIndex, grid: &Grid) -> Self {
        Self { voxel, corner_m: voxel.map(|index| grid.corner_m(index)), asked_m: None }
    }

    pub fn is_moved(&self) -> bool {
        self.voxel != [0; 3]
    }

    /// Center of a voxel of the map in the file's coordinates; `(index - origin + 0.5) * resolution`.
    pub fn center_m(&self, voxel: VoxelIndex, grid: &Grid) -> Point {
        std::array::from_fn(|k| {
            // Differences of indices are exact in f64.
            (f64::from(voxel[k]) - f64::from(self.voxel[k]) + 0.5) * grid.resolution_m()
        })
    }

    /// What a person is to know of it.
    pub fn text(&self, beside: Option<&Path>) -> String {
        let [x, y, z] = self.corner_m;
        let mut text = format!("origin {x} {y} {z} m: to be added to the file's coordinates");
        if let Some([x, y, z]) = self.asked_m {
            text += &format!("; the voxel's corner next to {x} {y} {z}");
        }
        if let Some(path) = beside {
            text += &format!("; {} says so, too", path.display());
        }
        text + "\n"
    }
}

/// The file beside an exported one that says where in the map it is: `FILE.origin.json`.
#[derive(Debug)]
pub struct OriginFile {
    path: PathBuf,
    /// Whether one is there, from an earlier export.
    is_there: bool,
}

#[derive(Debug, Deserialize, Serialize)]
struct OriginRecord {
    format: String,
    /// Of the exported file: which one this is about.
    file: String,
    blake3: String,
    /// To be added to its coordinates.
    origin_m: Point,
    origin_voxel: VoxelIndex,
    resolution_m: f64,
}

const FORMAT: &str = "voxtile-origin-1";
/// Ours are a few hundred bytes.
const MAX_BYTES: u64 = 1 << 16;

impl OriginFile {
    /// The one of an exported file, which need not be there; `None` for a stream, which has nothing beside it.
    ///
    /// # Errors
    ///
    /// Something else that has the name.
    pub fn of(output: &Path) -> Result<Option<Self>> {
        if is_standard_output(output) || output.file_name().is_none() {
            return Ok(None);
        }
        let path = output.with_added_extension("origin.json");
        let is_there = match fs::symlink_metadata(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(Error::io(&path, "look at", error)),
            Ok(metadata) if metadata.is_file() && metadata.len() <= MAX_BYTES => {
                let text = fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
                if !serde_json::from_slice(&text).is_ok_and(|record: OriginRecord| record.format == FORMAT) {
                    return Err(in_the_way(path));
                }
                true
            }
            Ok(_) => return Err(in_the_way(path)),
        };
        Ok(Some(Self { path, is_there }))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Says where a file is that is about to get its name. Who reads the two in between is told by the file's hash.
    pub fn write(
        &self,
        output: &Path,
        hash: blake3::Hash,
        origin: &ExportOrigin,
        grid: &Grid,
    ) -> anyhow::Result<()> {
        let record = OriginRecord {
            format: FORMAT.to_owned(),
            file: output.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            blake3: hash.to_hex().to_string(),
            origin_m: origin.corner_m,
            origin_voxel: origin.voxel,
            resolution_m: grid.resolution_m(),
        };
        let mut file = OutputFile::create(&self.path)?;
        let text = serde_json::to_string_pretty(&record)?;
        let written = writeln!(file.out(), "{text}");
        file.written(written)?;
        file.finish()
    }

    /// Removes what an earlier export said, for a file that is where the map is.
    pub fn remove(&self) -> Result<()> {
        match self.is_there.then(|| fs::remove_file(&self.path)) {
            Some(Err(error)) if error.kind() != io::ErrorKind::NotFound => {
                Err(Error::io(&self.path, "remove", error))
            }
            _ => Ok(()),
        }
    }
}

fn in_the_way(path: PathBuf) -> Error {
    let hint = "it is in the way of what says where the exported file is; move or remove it";
    Error::AlreadyExists { path, hint }
}
