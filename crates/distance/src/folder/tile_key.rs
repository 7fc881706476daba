use crate::cap::Cap;
use crate::options::{DistanceOptions, UnknownRule};
use serde::{Deserialize, Serialize};
use std::fmt;
use voxtile::mapper::MapView;
use voxtile::store::TileVersion;
use voxtile::{Grid, TileIndex};

/// Identifies the content of a field's tile: a hash of the parameters and of the versions of the map's tiles within the
/// cap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct TileKey(u64);

/// Increment when distances are computed or stored differently.
const FORMAT: u64 = 1;

impl TileKey {
    /// Key of a tile that was computed although tiles of the map within the cap are damaged.
    pub(super) fn without(self, damaged: &[TileIndex]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.0.to_le_bytes());
        damaged.iter().for_each(|&tile| add_tile(&mut hasher, tile));
        Self::of(&hasher)
    }

    fn of(hasher: &blake3::Hasher) -> Self {
        let hash = hasher.finalize();
        Self(hash.as_bytes()[..8].iter().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }

    pub(super) fn to_le_bytes(self) -> [u8; 8] {
        self.0.to_le_bytes()
    }
}

impl fmt::Display for TileKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl Serialize for TileKey {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for TileKey {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        u64::from_str_radix(&text, 16).map(Self).map_err(serde::de::Error::custom)
    }
}

/// Computes keys for the tiles of a map.
pub(super) struct TileKeys {
    parameters: blake3::Hasher,
    /// Tiles that can affect others, in order; `None` if the map has no version of it.
    tiles: Vec<(TileIndex, Option<TileVersion>)>,
    /// Tiles along an axis within the cap.
    tiles_within: i32,
    /// Distinguishes tiles without versions: they are never the same.
    random: u64,
}

impl TileKeys {
    pub(super) fn new(map: &impl MapView, tiles: &[TileIndex], cap: Cap, options: &DistanceOptions) -> Self {
        let config = map.config();
        let mut parameters = blake3::Hasher::new();
        parameters.update(&FORMAT.to_le_bytes());
        parameters.update(&config.grid.resolution_m().to_le_bytes());
        parameters.update(&config.grid.voxels_per_tile_edge().to_le_bytes());
        parameters.update(&config.occupied_log_odds().to_le_bytes());
        parameters.update(&cap.squared.to_le_bytes());
        parameters.update(&[options.unknown as u8, u8::from(options.is_signed)]);
        let with_version = tiles.iter().map(|&tile| (tile, version_of(map, tile)));
        // Tiles without obstacles do not matter where unknown voxels are free.
        let matters = |version: &Option<TileVersion>| {
            options.unknown != UnknownRule::Free || version.is_none_or(|version| version.occupied > 0)
        };
        let tiles = with_version.filter(|(_, version)| matters(version)).collect();
        let random = std::hash::BuildHasher::hash_one(&std::collections::hash_map::RandomState::new(), 0);
        Self { parameters, tiles, tiles_within: tiles_within(cap, &config.grid), random }
    }

    /// The key of a tile.
    pub(super) fn key_of(&self, tile: TileIndex) -> TileKey {
        let mut hasher = self.parameters.clone();
        add_tile(&mut hasher, tile);
        let low = tile.to_array().map(|k| k.saturating_sub(self.tiles_within));
        let high = tile.to_array().map(|k| k.saturating_add(self.tiles_within));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                let (first, last) = (TileIndex::new(x, y, low[2]), TileIndex::new(x, y, high[2]));
                let from = self.tiles.partition_point(|(tile, _)| *tile < first);
                for (tile, version) in self.tiles[from..].iter().take_while(|(tile, _)| *tile <= last) {
                    add_tile(&mut hasher, *tile);
                    match version {
                        Some(version) => {
                            hasher.update(&version.table.bytes.to_le_bytes());
                            hasher.update(&version.table.crc.to_le_bytes());
                        }
                        None => {
                            hasher.update(&self.random.to_le_bytes());
                        }
                    }
                }
            }
        }
        TileKey::of(&hasher)
    }
}

/// Number of tiles along an axis that the cap reaches into.
pub(super) fn tiles_within(cap: Cap, grid: &Grid) -> i32 {
    (cap.reach as i32 + grid.voxels_per_tile_edge() - 1) / grid.voxels_per_tile_edge()
}

/// The version of a tile, if it identifies the content.
fn version_of(map: &impl MapView, tile: TileIndex) -> Option<TileVersion> {
    // Maps of the original format have no checksums.
    map.version_of_tile(tile).filter(|version| version.table.bytes > 0)
}

fn add_tile(hasher: &mut blake3::Hasher, tile: TileIndex) {
    hasher.update(tile.to_array().map(i32::to_le_bytes).as_flattened());
}
