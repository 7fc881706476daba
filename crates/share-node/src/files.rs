use anyhow::Context;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use voxtile::space::Grid;
use voxtile::{MapConfig, MapReader, MemoryLimit, OutOfCoreTileMapper};
use voxtile_share::{VoxelSet, read_layer, write_layer};

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
    let write = || -> io::Result<()> {
        // Of a run that was killed, or a link that somebody put there: not written through.
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

/// Moves a layer that cannot be used to a name that is free: `NAME.layer.aside-1` and so on.
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
    Err(io::Error::other("a thousand layers lie aside already"))
}

/// Opens a map to write to, in about so much memory, or makes one with the voxels of a grid.
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

/// The lengths of a grid, as a person reads them.
pub fn lengths(grid: &Grid) -> String {
    format!("voxels of {} m and tiles of {} m", grid.resolution_m(), grid.tile_size_m())
}
