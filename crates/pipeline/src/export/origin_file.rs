use super::origin::ExportOrigin;
use crate::output::{OutputFile, is_standard_output};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile::{Error, Result};

/// Companion file of an exported file that stores its origin in the map: `FILE.origin.json`.
#[derive(Debug)]
pub struct OriginFile {
    path: PathBuf,
    /// Whether the file exists, from an earlier export.
    is_there: bool,
}

#[derive(Debug, Deserialize, Serialize)]
struct OriginRecord {
    format: String,
    /// Name and hash of the exported file that this record describes.
    file: String,
    blake3: String,
    /// Offset to add to the file's coordinates, in metres.
    origin_m: Point,
    origin_voxel: VoxelIndex,
    resolution_m: f64,
}

const FORMAT: &str = "voxtile-origin-1";
/// Size limit; these files have a few hundred bytes.
const MAX_BYTES: u64 = 1 << 16;

impl OriginFile {
    /// Returns the companion file of an exported file, which need not exist; `None` for a stream.
    ///
    /// # Errors
    ///
    /// Another file has its name.
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

    /// Writes the companion file of an output that is about to be renamed into place. A reader that sees the new
    /// companion file next to the old output detects this by the hash.
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

    /// Removes the companion file of an earlier export, because the new file has the map's origin.
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
    let hint = "this name is needed for the origin of the exported file: move or remove the existing file";
    Error::AlreadyExists { path, hint }
}
