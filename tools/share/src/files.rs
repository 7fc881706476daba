use anyhow::Context;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use voxtile::share::{VoxelSet, read_layer, write_layer};
use voxtile::{MapConfig, MapReader, OutOfCoreTileMapper};

/// Where the layers of a map lie: beside it.
pub fn layers_folder(map: &Path) -> PathBuf {
    let mut name = map.file_name().unwrap_or_default().to_os_string();
    name.push(".layers");
    map.with_file_name(name)
}

/// Reads a robot's layer.
pub fn load_layer(path: &Path, max_voxels: u64) -> anyhow::Result<VoxelSet> {
    let file = File::open(path).with_context(|| format!("{}: cannot open the layer", path.display()))?;
    Ok(read_layer(&mut BufReader::new(file), max_voxels).map_err(|error| error.in_input(path))?)
}

/// Writes a robot's layer: whole, or not at all.
pub fn save_layer(path: &Path, layer: &mut VoxelSet) -> anyhow::Result<()> {
    let next = path.with_extension("layer.next");
    let write = || -> std::io::Result<()> {
        let mut out = BufWriter::new(File::create(&next)?);
        write_layer(layer, &mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        drop(out);
        fs::rename(&next, path)
    };
    let mut write = write;
    write().with_context(|| format!("{}: cannot write the layer", path.display()))
}

/// Opens a map to write to, or makes one with the voxels of a layer.
pub fn open_map(folder: &Path, layer: &VoxelSet) -> anyhow::Result<OutOfCoreTileMapper> {
    match MapReader::config_of(folder) {
        Ok(config) => Ok(OutOfCoreTileMapper::open(folder, config.with_cache_tiles(64))?),
        Err(voxtile::Error::NoMap { .. }) => {
            let grid = layer.grid();
            let config = MapConfig::new(grid.resolution_m(), grid.tile_size_m())?;
            Ok(OutOfCoreTileMapper::create(folder, config.with_cache_tiles(64))?)
        }
        Err(error) => Err(error.into()),
    }
}
