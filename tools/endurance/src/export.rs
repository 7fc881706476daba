use crate::build::remove_folder;
use crate::process_memory;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;
use voxtile::octree::OctreeFormat;
use voxtile::query::OctreeExport;
use voxtile::{MapQueries, MapReader, MapView};
use voxtile_formats::write::{OutputFormats, RowLayers, VoxelRow, VoxelsHead, WriteOptions};

/// An export of a map in little memory.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Export {
    pub map: PathBuf,
    pub format: ExportFormat,
    /// Memory for the part of an octree that is assembled at a time, in bytes.
    pub memory_bytes: usize,
    /// Folder for the files, created and removed again.
    pub folder: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ExportFormat {
    /// The centers of the occupied voxels.
    Ply,
    /// OctoMap's binary octree.
    Bt,
    /// OctoMap's full octree.
    Ot,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Exported {
    pub voxels: u64,
    pub file_bytes: u64,
    pub wall_s: f64,
    /// Largest resident memory of the process, in bytes.
    pub peak_resident_bytes: u64,
    /// Resident memory before the map was opened, in bytes.
    pub start_resident_bytes: u64,
}

impl ExportFormat {
    pub const ALL: [Self; 3] = [Self::Ply, Self::Bt, Self::Ot];

    /// Extension of the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Bt => "bt",
            Self::Ot => "ot",
        }
    }
}

impl Export {
    /// Exports the map in this process.
    ///
    /// # Errors
    ///
    /// Fails if the map cannot be read or the file cannot be written.
    pub fn run(self) -> Result<Exported> {
        let start_resident_bytes = process_memory::resident_bytes()?;
        fs::create_dir_all(&self.folder)
            .with_context(|| format!("{}: cannot create the folder", self.folder.display()))?;
        let path = self.folder.join("map").with_extension(self.format.name());
        let begin = Instant::now();
        let voxels = self.write(&path).with_context(|| format!("{}: cannot export", path.display()))?;
        let wall_s = begin.elapsed().as_secs_f64();
        let file_bytes = fs::metadata(&path)?.len();
        remove_folder(&self.folder)?;
        let peak_resident_bytes = process_memory::peak_bytes()?;
        Ok(Exported { voxels, file_bytes, wall_s, peak_resident_bytes, start_resident_bytes })
    }

    fn write(&self, path: &Path) -> Result<u64> {
        let map = MapReader::open(&self.map, 0)?;
        match self.format {
            ExportFormat::Ply => write_occupied(&map, path),
            ExportFormat::Bt => self.write_octree(&map, OctreeFormat::Bt, path),
            ExportFormat::Ot => self.write_octree(&map, OctreeFormat::Ot, path),
        }
    }

    fn write_octree(&self, map: &MapReader, format: OctreeFormat, path: &Path) -> Result<u64> {
        let mut out = BufWriter::with_capacity(1 << 18, File::create(path)?);
        let spool = self.folder.join("spool");
        let mut spool = File::options().read(true).write(true).create_new(true).open(spool)?;
        let export = OctreeExport { format, region: None, origin: [0; 3], memory_bytes: self.memory_bytes };
        let voxels = map.write_octree::<anyhow::Error>(&export, &mut spool, &mut out)?;
        out.flush()?;
        Ok(voxels)
    }
}

fn write_occupied(map: &MapReader, path: &Path) -> Result<u64> {
    let grid = map.config().grid;
    let (_, count) = map.voxel_counts().context("the map has no voxel counts")?;
    let formats = OutputFormats::default();
    let format = formats.of_name("ply").context("PLY is not supported")?;
    let head = VoxelsHead::of_stream(count, grid.resolution_m());
    let mut sink = format.open(&head, path, &WriteOptions::for_path(path))?;
    let mut written = Ok(());
    map.for_each_occupied(None, None, |voxel| {
        if written.is_ok() {
            written = sink.put(&VoxelRow {
                index: voxel.index,
                center_m: grid.center_m(voxel.index),
                probability: voxel.evidence.probability(),
                log_odds: voxel.evidence.log_odds,
                observation_count: voxel.evidence.observation_count,
                tile: grid.tile_of_voxel(voxel.index).to_array(),
                layers: RowLayers::default(),
            });
        }
    })?;
    written?;
    sink.finish()?;
    Ok(count)
}
