use rayon::prelude::*;
use std::collections::BTreeMap;
use voxtile::mapper::MapView;
use voxtile::space::TileIndex;
use voxtile::{Error, Result};

/// Maximum number of tiles that are read, evenly among the tiles.
const MAX_TILES: usize = 128;
/// Share of the voxels below the range, and above it.
const LEFT_OUT: f64 = 0.02;

/// Returns the heights in metres between which 96 % of the occupied voxels of some tiles are, for colours; `None`
/// without such a voxel. Reads up to 128 of the tiles; unreadable tiles are skipped.
///
/// # Errors
///
/// Fails on errors that do not concern a single tile, such as [`Error::Changed`].
pub fn height_range_m(map: &dyn MapView, tiles: &[TileIndex]) -> Result<Option<[f64; 2]>> {
    let (grid, occupied_from) = (map.config().grid, map.config().occupied_log_odds());
    let every = tiles.len().div_ceil(MAX_TILES).max(1);
    let some: Vec<TileIndex> = tiles.iter().copied().step_by(every).collect();
    let counts = some.par_iter().map(|&index| {
        let mut counts: BTreeMap<i32, u64> = BTreeMap::new();
        match map.tile_uncached(index) {
            Ok(Some(tile)) => tile
                .voxels_from(occupied_from)
                .for_each(|voxel| *counts.entry(voxel.index[2]).or_default() += 1),
            Ok(None) | Err(Error::Damaged { .. } | Error::Io { .. }) => {}
            Err(error) => return Err(error),
        }
        Ok(counts)
    });
    let counts = counts.try_reduce(BTreeMap::new, |mut all, counts| {
        counts.into_iter().for_each(|(z, count)| *all.entry(z).or_default() += count);
        Ok(all)
    })?;
    let voxels: u64 = counts.values().sum();
    let left_out = (LEFT_OUT * voxels as f64) as u64;
    let Some(low) = nth(counts.iter(), left_out) else { return Ok(None) };
    let Some(high) = nth(counts.iter().rev(), left_out) else { return Ok(None) };
    Ok(Some([grid.corner_m(low), grid.corner_m(high.saturating_add(1))]))
}

/// Returns the height of voxel `number`, counted from 0, of voxels counted by height.
pub(crate) fn nth<'a>(mut counts: impl Iterator<Item = (&'a i32, &'a u64)>, number: u64) -> Option<i32> {
    let mut before = 0;
    let found = counts.find(|(_, count)| {
        before += **count;
        before > number
    });
    found.map(|(z, _)| *z)
}
