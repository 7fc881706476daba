use super::{Error, FileUnit, Result};
use std::path::{Path, PathBuf};

/// Settings for writing voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Final path of the output. The names of companion files, and names within files, are derived from it.
    pub final_path: PathBuf,
    /// Folder for companion files, named after the output: `map.yaml`, `map.pgm`.
    pub companion_folder: PathBuf,
    /// Folder for unnamed temporary files. They need about as much space as the output.
    pub scratch_folder: PathBuf,
    /// Coordinate reference system of the coordinates: well-known text, or `EPSG:25832` if only the code is known.
    /// Ignored by formats that cannot store it.
    pub crs: Option<String>,
    /// Unit of the voxels and of the head, for formats that take [`OutputOption::Unit`](super::OutputOption::Unit).
    pub unit: FileUnit,
    /// Whether voxels have the mean of their points in place of their center.
    pub has_mean_points: bool,
    /// 2D grids and heightmaps: only voxels that reach above this height, in metres.
    pub z_min_m: Option<f64>,
    /// 2D grids and heightmaps: only voxels that reach below this height, in metres.
    pub z_max_m: Option<f64>,
    /// Autoware: edge of the square of a file, in whole metres.
    pub cell_m: f64,
    /// Origin of the file's coordinates in the map, in metres: the offset to add to them. Ignored by formats that
    /// cannot store it.
    pub origin_m: [f64; 3],
    /// Meshes: heights of the first and the last colour, in metres. `None`: those of the lowest and the highest voxel.
    pub colour_heights_m: Option<[f64; 2]>,
    /// Meshes: 16-bit positions where these suffice (`KHR_mesh_quantization`). Not all programs support them.
    pub is_quantized: bool,
    /// Recordings: frame of the clouds.
    pub frame: String,
    /// Recordings: time stamp of the clouds, in nanoseconds since 1970.
    pub stamp_ns: u64,
}

impl WriteOptions {
    /// Creates options for an output path. Companion and temporary files are in its folder.
    pub fn for_path(final_path: &Path) -> Self {
        let folder = match final_path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        Self {
            final_path: final_path.to_owned(),
            companion_folder: folder.clone(),
            scratch_folder: folder,
            crs: None,
            unit: FileUnit::Metre,
            has_mean_points: false,
            z_min_m: None,
            z_max_m: None,
            cell_m: 20.0,
            origin_m: [0.0; 3],
            colour_heights_m: None,
            is_quantized: false,
            frame: "map".to_owned(),
            stamp_ns: 0,
        }
    }

    /// Returns the final file name.
    pub(super) fn final_name(&self) -> Result<&str> {
        let name = self.final_path.file_name().and_then(|name| name.to_str());
        name.ok_or_else(|| {
            let reason = "the output needs a Unicode file name, because its companion files contain it";
            Error::argument(self.final_path.display().to_string(), reason)
        })
    }

    /// Returns the path of a companion file: the final name with another extension. `own` is the recommended extension
    /// of the output itself.
    pub(super) fn companion(&self, extension: &str, own: &str) -> Result<PathBuf> {
        let name = self.final_name()?;
        let companion = Path::new(name).with_extension(extension);
        // Some file systems are case-insensitive.
        if companion.to_str().is_some_and(|companion| companion.eq_ignore_ascii_case(name)) {
            let hint = self.final_path.with_extension(own);
            let reason = format!("a companion file needs this name: name the output {}", hint.display());
            return Err(Error::argument(self.final_path.display().to_string(), reason));
        }
        Ok(self.companion_folder.join(companion))
    }
}

#[cfg(test)]
mod tests {
    use super::super::OutputFormats;
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn outputs_do_not_use_names_of_companion_files() {
        let rows = [row([0, 0, 0], 0.9)];
        for (format, name, hint) in [
            ("nav2", "map.yaml", "map.pgm"),
            ("nav2", "map.YAML", "map.pgm"),
            ("heightmap", "h.json", "h.png"),
            ("heightmap", "h.Pgw", "h.png"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(name);
            let format = *OutputFormats::default().of_name(format).unwrap();
            let opened = format.open(&head_of(&rows), &path, &WriteOptions::for_path(&path));
            let error = opened.err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(name) && error.contains(hint), "{name}: {error:?}");
            assert!(!path.exists());
        }
    }
}
