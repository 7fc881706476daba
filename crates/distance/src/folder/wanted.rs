use super::tile_key::tiles_within;
use crate::cap::Cap;
use crate::options::{DistanceOptions, UnknownRule};
use rustc_hash::FxHashSet;
use voxtile::TileIndex;
use voxtile::mapper::MapView;
use voxtile::space::TileBox;

/// The tiles whose distances are stored, in order: those that differ from what absent tiles have.
pub(super) fn wanted_tiles(
    map: &impl MapView,
    tiles: &[TileIndex],
    region: Option<TileBox>,
    cap: Cap,
    options: &DistanceOptions,
) -> Vec<TileIndex> {
    let is_inside = |tile: &TileIndex| region.is_none_or(|region| region.contains(*tile));
    let has_own = match options.unknown {
        UnknownRule::Unknown => true,
        UnknownRule::Free => false,
        UnknownRule::Obstacle => !options.is_signed,
    };
    if has_own {
        return tiles.iter().copied().filter(is_inside).collect();
    }
    // Also tiles without observations within the cap: of obstacles, or of free voxels inside unknown obstacles.
    let reaches = |tile: &TileIndex| options.unknown != UnknownRule::Free || may_have_obstacles(map, *tile);
    let within = tiles_within(cap, &map.config().grid);
    let around =
        tiles.iter().copied().filter(reaches).flat_map(|tile| TileBox::new(tile, tile).grown(within).tiles());
    let mut wanted: Vec<TileIndex> = around.filter(is_inside).collect::<FxHashSet<_>>().into_iter().collect();
    wanted.sort_unstable();
    wanted
}

/// Returns whether a tile may have occupied voxels, without reading it.
pub(super) fn may_have_obstacles(map: &impl MapView, tile: TileIndex) -> bool {
    map.version_of_tile(tile).is_none_or(|version| version.table.bytes == 0 || version.occupied > 0)
}
