use anyhow::Context;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use voxtile::space::Grid;
use voxtile::{MapConfig, MapReader, MemoryLimit, OutOfCoreTileMapper};
use voxtile_share::{VoxelSet, read_layer, write_layer};

/// Returns the folder of a map's layers: `MAP.layers`, next to the map.
pub fn layers_folder(map: &Path) -> PathBuf {
    let mut name = map.file_name().unwrap_or_default().to_os_string();
    name.push(".layers");
    map.with_file_name(name)
}

pub fn load_layer(path: &Path, max_voxels: u64) -> anyhow::Result<VoxelSet> {
    let file = File::open(path).with_context(|| format!("{}: cannot open the layer", path.display()))?;
    Ok(read_layer(&mut BufReader::new(file), max_voxels).map_err(|error| error.in_input(path))?)
}

/// Writes a robot's layer atomically.
pub fn save_layer(path: &Path, layer: &mut VoxelSet) -> anyhow::Result<()> {
    let next = path.with_extension("layer.next");
    let write = || -> io::Result<()> {
        // Remove a leftover file of an interrupted run. A link with this name must not be followed.
        match fs::remove_file(&next) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut out = BufWriter::new(File::options().write(true).create_new(true).open(&next)?);
        write_layer(layer, &mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        drop(out);
        fs::rename(&next, path)
    };
    let mut write = write;
    write()
        .inspect_err(|_| drop(fs::remove_file(&next)))
        .with_context(|| format!("{}: cannot write the layer", path.display()))
}

/// Renames an unusable layer to a free name: `NAME.layer.aside-1`, `NAME.layer.aside-2` ...
pub fn set_aside(path: &Path) -> io::Result<PathBuf> {
    for number in 1..=1000 {
        let aside = path.with_extension(format!("layer.aside-{number}"));
        match fs::symlink_metadata(&aside) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                fs::rename(path, &aside)?;
                return Ok(aside);
            }
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("1000 files NAME.layer.aside-N exist already; remove some"))
}

/// Opens a map for writing with about `memory_bytes`, or creates one with the voxel and tile size of `grid`.
pub fn open_map(folder: &Path, grid: &Grid, memory_bytes: usize) -> anyhow::Result<OutOfCoreTileMapper> {
    let limit = |config: MapConfig| {
        let least = MemoryLimit::min_bytes(&config.grid);
        config.with_memory_bytes(memory_bytes.max(least))
    };
    match MapReader::config_of(folder) {
        Ok(config) => Ok(OutOfCoreTileMapper::open(folder, limit(config))?),
        Err(voxtile::Error::NoMap { .. }) => {
            let config = MapConfig::new(grid.resolution_m(), grid.tile_size_m())?;
            Ok(OutOfCoreTileMapper::create(folder, limit(config))?)
        }
        Err(error) => Err(error.into()),
    }
}

pub fn lengths(grid: &Grid) -> String {
    format!("voxels of {} m and tiles of {} m", grid.resolution_m(), grid.tile_size_m())
}
