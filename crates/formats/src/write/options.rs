use super::{Error, Result};
use std::path::{Path, PathBuf};

/// How voxels are written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// The name that the output has in the end: files beside it, and names within it, follow this one.
    pub final_path: PathBuf,
    /// Where files beside the output are written, under names that follow the final one: `map.yaml`, `map.pgw`.
    pub companion_folder: PathBuf,
    /// Where files without a name are kept until the output is whole. They need about as much room as the output.
    pub scratch_folder: PathBuf,
    /// The coordinate reference system that the coordinates are in, in metres: well-known text or, where only its
    /// number is known, `EPSG:25832`. Formats that name none leave it out.
    pub crs: Option<String>,
    /// Flat maps and heightmaps: voxels that reach above this height alone, in metres.
    pub z_min_m: Option<f64>,
    /// Flat maps and heightmaps: voxels that reach below this height alone, in metres.
    pub z_max_m: Option<f64>,
    /// Autoware: edge of the square of a file, in whole metres.
    pub cell_m: f64,
    /// Where in the map the file's coordinates begin, in metres: what is to be added to the centers of voxels. Formats
    /// without room for it leave it out.
    pub origin_m: [f64; 3],
    /// Meshes: the heights of the first and the last colour, in metres; of the lowest and highest voxel if not given.
    pub colour_heights_m: Option<[f64; 2]>,
    /// Meshes: positions are numbers of 16 bits where these suffice (`KHR_mesh_quantization`), which not every program
    /// reads.
    pub is_quantized: bool,
    /// Recordings: the frame of the clouds.
    pub frame: String,
    /// Recordings: the time of the clouds, in nanoseconds since 1970.
    pub stamp_ns: u64,
}

impl WriteOptions {
    /// All that follows from where the output ends up: files beside it and scratch files lie in its folder.
    pub fn beside(final_path: &Path) -> Self {
        let folder = match final_path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        Self {
            final_path: final_path.to_owned(),
            companion_folder: folder.clone(),
            scratch_folder: folder,
            crs: None,
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

    /// The final name without its folder.
    pub(super) fn final_name(&self) -> Result<&str> {
        let name = self.final_path.file_name().and_then(|name| name.to_str());
        name.ok_or_else(|| {
            let reason = "the output needs a name in Unicode, for files beside it name it";
            Error::argument(self.final_path.display().to_string(), reason)
        })
    }

    /// Where a file beside the output is written: its name is the final one with another end. `own` is the end that the
    /// output itself should have.
    pub(super) fn companion(&self, extension: &str, own: &str) -> Result<PathBuf> {
        let name = self.final_name()?;
        let beside = Path::new(name).with_extension(extension);
        // Some disks take names that differ in case for one.
        if beside.to_str().is_some_and(|beside| beside.eq_ignore_ascii_case(name)) {
            let hint = self.final_path.with_extension(own);
            let reason =
                format!("a file beside the output has this name; name the output {}", hint.display());
            return Err(Error::argument(self.final_path.display().to_string(), reason));
        }
        Ok(self.companion_folder.join(beside))
    }
}

#[cfg(test)]
mod tests {
    use super::super::OutputFormats;
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn no_output_takes_the_name_of_what_belongs_beside_it() {
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
            let opened = format.open(&head_of(&rows), &path, &WriteOptions::beside(&path));
            let error = opened.err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(name) && error.contains(hint), "{name}: {error:?}");
            assert!(!path.exists());
        }
    }
}
