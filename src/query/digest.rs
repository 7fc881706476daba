use crate::error::Result;
use crate::mapper::MapView;
use crate::tile::format::encode_entries;
use crate::tile::{ClassVotes, ColourSums, IntensitySums, Tile, TimeSpan, VoxelLayers};
use std::convert::Infallible;
use std::fmt;

/// Digest of the content of a map or a set: equal for equal content, however it was built. 32 bytes of BLAKE3 over the
/// data specified in `docs/format.md`; printed as 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest([u8; 32]);

impl Digest {
    /// Creates a digest from the bytes returned by [`Digest::to_bytes`].
    pub const fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// The bytes of the digest.
    pub const fn to_bytes(self) -> [u8; 32] {
        self.0
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Digest({self})")
    }
}

const LABEL: &[u8] = b"voxtile-digest-1";

pub(super) fn digest(view: &impl MapView) -> Result<Digest> {
    let grid = &view.config().grid;
    let mut hasher = blake3::Hasher::new();
    hasher.update(LABEL);
    hasher.update(&grid.resolution_m().to_bits().to_le_bytes());
    hasher.update(&grid.tile_size_m().to_bits().to_le_bytes());
    for tile in view.tiles() {
        let tile = tile?;
        if tile.table().is_empty() {
            continue;
        }
        for index in tile.index().to_array() {
            hasher.update(&index.to_le_bytes());
        }
        hasher.update(digest_of_tile(&tile).as_bytes());
    }
    Ok(Digest(*hasher.finalize().as_bytes()))
}

const LAYERS_LABEL: &[u8] = b"voxtile-layers-digest-1";

/// Digest of the layers of a map.
pub(super) fn layer_digest(view: &impl MapView) -> Result<Digest> {
    let grid = &view.config().grid;
    let layers = view.config().layers();
    let mut hasher = blake3::Hasher::new();
    hasher.update(LAYERS_LABEL);
    hasher.update(&grid.resolution_m().to_bits().to_le_bytes());
    hasher.update(&grid.tile_size_m().to_bits().to_le_bytes());
    hasher.update(layers.to_string().as_bytes());
    for tile in view.tiles() {
        let tile = tile?;
        let Some(layers) = tile.table().layers() else { continue };
        for index in tile.index().to_array() {
            hasher.update(&index.to_le_bytes());
        }
        layers.for_each(|voxel, made| {
            for key in voxel.to_key().0 {
                hasher.update(&key.to_le_bytes());
            }
            hash_layers(&made, &mut hasher);
        });
    }
    Ok(Digest(*hasher.finalize().as_bytes()))
}

fn hash_layers(made: &VoxelLayers, hasher: &mut blake3::Hasher) {
    let VoxelLayers { points, colour, intensity, classes, time, shape } = made;
    let ColourSums { points: coloured, red, green, blue } = colour;
    let IntensitySums { points: measured, sum, squares } = intensity;
    let sums = [points, coloured, red, green, blue, measured, sum, squares];
    for sum in sums {
        hasher.update(&sum.to_le_bytes());
    }
    hasher.update(&(classes.len() as u64).to_le_bytes());
    for ClassVotes { class, votes } in classes {
        hasher.update(&[*class]);
        hasher.update(&votes.to_le_bytes());
    }
    hasher.update(&[u8::from(time.is_some())]);
    if let Some(TimeSpan { first_ns, last_ns }) = time {
        hasher.update(&first_ns.to_le_bytes());
        hasher.update(&last_ns.to_le_bytes());
    }
    let sums = shape.offsets.iter().chain(&shape.products);
    for sum in sums {
        hasher.update(&sum.to_le_bytes());
    }
}

/// Hashes key, log-odds and count of each entry, as in `iwlo_meta.bin`.
fn digest_of_tile(tile: &Tile) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let Ok(()) = encode_entries(tile.table(), |entries| {
        hasher.update(entries);
        Ok::<(), Infallible>(())
    });
    hasher.finalize()
}
