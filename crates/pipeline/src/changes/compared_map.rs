use crate::map_at::AnyMap;
use std::path::Path;
use voxtile::MapConfig;
use voxtile::mapper::MapView;
use voxtile::space::TileBox;
use voxtile::store::Extension;

/// One of two compared maps, without its voxels.
#[derive(Clone, Copy, Debug)]
pub struct ComparedMap<'a> {
    /// Name of the map in messages.
    pub path: &'a Path,
    /// Configuration of the map.
    pub config: &'a MapConfig,
    /// A box around its tiles; `None` for an empty map.
    pub tile_bounds: Option<TileBox>,
    /// Its id and inputs, if they are known.
    pub extension: Option<&'a Extension>,
}

impl<'a, P: AsRef<Path> + ?Sized> From<(&'a P, &'a AnyMap)> for ComparedMap<'a> {
    fn from((path, map): (&'a P, &'a AnyMap)) -> Self {
        let extension = match map {
            AnyMap::Map(reader) => reader.metadata().ext.as_ref(),
            AnyMap::Octree(_) => None,
        };
        Self { path: path.as_ref(), config: map.config(), tile_bounds: map.tile_bounds(), extension }
    }
}
