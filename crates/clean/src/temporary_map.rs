use std::path::Path;
use voxtile::store::StagedMap;
use voxtile::{Error, MapConfig, MapPath, MapReader, OutOfCoreTileMapper, Result};

/// Creates a temporary map in `NAME.KIND.unfinished` next to the map `NAME`. It is never finished, so that it is removed
/// when it is dropped, or by the next search after a kill.
///
/// # Errors
///
/// A running search of this map, or an I/O error.
pub(crate) fn begin(
    map: &MapReader,
    kind: &str,
    config: MapConfig,
) -> Result<StagedMap<OutOfCoreTileMapper>> {
    // The path of the map may be relative, such as `..`, or a link.
    let real = map.folder().canonicalize().map_err(|error| Error::io(map.folder(), "find", error))?;
    let disk = map.disk();
    let create = |folder: &Path| OutOfCoreTileMapper::create(MapPath::on(disk.clone(), folder), config);
    StagedMap::begin_by(disk.clone(), &real.with_added_extension(kind), create)
}
