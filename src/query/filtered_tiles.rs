use crate::error::Result;
use crate::mapper::MapView;
use crate::space::TileIndex;
use crate::tile::Voxel;
use rayon::prelude::*;

/// Maximum number of voxels of tiles that are read together: 8 MB. A tile with more voxels is read alone.
const MAX_VOXELS: u64 = 1 << 18;
/// Maximum number of tiles that are read together.
const MAX_TILES: usize = 64;

/// Upper bound on the number of a tile's voxels with log-odds of at least `from`, known without reading it.
fn max_count_from(view: &impl MapView, tile: TileIndex, from: f64) -> Option<u64> {
    let version = view.version_of_tile(tile)?;
    Some(if from >= view.config().occupied_log_odds() { version.occupied } else { version.voxels })
}

/// Returns the first of `tiles` that are read together; empty if the first one has too many voxels or an unknown
/// number.
fn first_together<'a>(view: &impl MapView, tiles: &'a [TileIndex], from: f64) -> &'a [TileIndex] {
    let mut budget = MAX_VOXELS;
    let fits = |&&tile: &&TileIndex| {
        let left = max_count_from(view, tile, from).and_then(|most| budget.checked_sub(most));
        budget = left.unwrap_or(0);
        left.is_some()
    };
    &tiles[..tiles.iter().take(MAX_TILES).take_while(fits).count()]
}

/// Visits the observed voxels of tiles whose log-odds are at least `from`: tile by tile in their order, in Morton order
/// within each. Small tiles are read on all cores; `whole` visits the voxels of a tile that may be too large to be in
/// memory twice.
pub(super) fn for_each_from<F: FnMut(Voxel)>(
    view: &impl MapView,
    tiles: &[TileIndex],
    from: f64,
    visit: &mut F,
    whole: impl Fn(TileIndex, &mut F) -> Result<()>,
) -> Result<()> {
    let mut tiles = tiles;
    while let Some(&first) = tiles.first() {
        let together = first_together(view, tiles, from);
        if together.is_empty() {
            whole(first, visit)?;
            tiles = &tiles[1..];
            continue;
        }
        let read: Vec<Result<Vec<Voxel>>> =
            together.par_iter().map(|&tile| view.voxels_from(tile, from)).collect();
        for voxels in read {
            voxels?.into_iter().for_each(&mut *visit);
        }
        tiles = &tiles[together.len()..];
    }
    Ok(())
}
