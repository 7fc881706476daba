use super::LayerTotals;
use super::cells::{axes, place};
use super::node_key::NodeKey;
use super::scheme::Scheme;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use integer_encoding::VarInt;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use voxtile::tile::Tile;
use voxtile::{ClassVotes, ColourSums, IntensitySums, MapConfig, TimeSpan, VoxelLayers};

/// Layers of the occupied voxels of a node: for each voxel of the node, the sums over the points that hit the map's
/// occupied voxels in it.
///
/// If the tile's size is not a multiple of the coarser voxel's size, a point at the border may count in two voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LayerSums {
    /// By position in the node, ascending, as in [`Cells`](super::cells::Cells).
    pub(super) voxels: Vec<(u32, VoxelLayers)>,
    pub(super) totals: LayerTotals,
}

/// Upper bound on the size of decoded bytes.
const MAX_BYTES: u64 = 1 << 30;

impl LayerSums {
    /// Sums of a node that is a tile or a part of one.
    pub(super) fn of_tile(scheme: Scheme, key: NodeKey, tile: &Tile, config: &MapConfig) -> Self {
        let (first, edges) = (scheme.first_voxel(key), scheme.edges(key));
        let mut sums = CollectedSums::default();
        for_each_layered(tile, config, |voxel, layers| {
            let at = [0, 1, 2].map(|k| (i64::from(voxel[k]) - first[k]) >> key.level);
            if (0..3).all(|k| at[k] >= 0 && at[k] < edges[k]) {
                sums.add_voxel(place(at), layers);
            }
        });
        sums.finish()
    }

    /// Sums of all nodes of a tile: of the tile itself and of each block of it.
    pub(super) fn of_nodes_of_tile(
        scheme: Scheme,
        tile: &Tile,
        config: &MapConfig,
    ) -> BTreeMap<NodeKey, Self> {
        let index = tile.index();
        let keys = scheme.nodes_of_tile(index).into_iter();
        let mut nodes: BTreeMap<_, _> = keys.map(|key| (key, CollectedSums::default())).collect();
        for_each_layered(tile, config, |voxel, layers| {
            for level in 0..=scheme.tile_level() {
                let (key, at) = scheme.node_of_voxel(index, voxel, level);
                if let Some(node) = nodes.get_mut(&key) {
                    node.add_voxel(place(at), layers);
                }
            }
        });
        nodes.into_iter().map(|(key, node)| (key, node.finish())).collect()
    }

    /// Encodes the sums for a [`NodeStore`](super::NodeStore).
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (mut place_before, mut time_before) = (0, 0_i64);
        put(&mut bytes, self.voxels.len() as u64);
        for (place, voxel) in &self.voxels {
            put(&mut bytes, u64::from(place - std::mem::replace(&mut place_before, *place)));
            let (colour, intensity) = (&voxel.colour, &voxel.intensity);
            let numbers = [colour.points, colour.red, colour.green, colour.blue];
            numbers.into_iter().chain([intensity.points, intensity.sum]).for_each(|k| put(&mut bytes, k));
            put(&mut bytes, voxel.classes.len() as u64);
            for votes in &voxel.classes {
                bytes.push(votes.class);
                put(&mut bytes, votes.votes);
            }
            bytes.push(u8::from(voxel.time.is_some()));
            if let Some(TimeSpan { first_ns, last_ns }) = voxel.time {
                put(&mut bytes, first_ns.wrapping_sub(std::mem::replace(&mut time_before, first_ns)));
                put(&mut bytes, last_ns.wrapping_sub(first_ns) as u64);
            }
        }
        self.totals.put(&mut bytes);
        let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
        // Writes to memory cannot fail.
        gzip.write_all(&bytes).and_then(|()| gzip.finish()).unwrap_or_default()
    }

    /// Decodes the bytes of [`LayerSums::encode`].
    pub(super) fn decode(compressed: &[u8]) -> io::Result<Self> {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed).take(MAX_BYTES).read_to_end(&mut bytes)?;
        let mut reader = Reader(&bytes);
        reader.sums().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "wrong layers of a node"))
    }
}

/// Visits the occupied voxels of a tile that points have hit.
fn for_each_layered(tile: &Tile, config: &MapConfig, mut visit: impl FnMut([i32; 3], &VoxelLayers)) {
    let threshold = config.occupied_log_odds();
    for voxel in tile.voxels_from(threshold) {
        if let Some(mut layers) = tile.layers_of(voxel.index) {
            // Neither shown nor stored.
            (layers.points, layers.intensity.squares, layers.shape) = Default::default();
            visit(voxel.index, &layers);
        }
    }
}

/// Sums of a node in progress.
#[derive(Default)]
pub(super) struct CollectedSums {
    voxels: FxHashMap<u32, VoxelLayers>,
    totals: LayerTotals,
}

impl CollectedSums {
    fn add_voxel(&mut self, place: u32, layers: &VoxelLayers) {
        self.totals.add_voxel(layers);
        self.voxels.entry(place).or_default().add(layers);
    }

    /// Adds the sums of a child node.
    pub(super) fn add_child(&mut self, scheme: Scheme, own: NodeKey, child: NodeKey, sums: &LayerSums) {
        self.totals.add(&sums.totals);
        for (at, layers) in &sums.voxels {
            for coarser in scheme.coarser(own, child, axes(*at)) {
                self.voxels.entry(place(coarser)).or_default().add(layers);
            }
        }
    }

    pub(super) fn finish(self) -> LayerSums {
        let mut voxels: Vec<_> = self.voxels.into_iter().collect();
        voxels.sort_unstable_by_key(|(place, _)| *place);
        LayerSums { voxels, totals: self.totals }
    }
}

/// Appends a number in as few bytes as it needs.
pub(super) fn put(bytes: &mut Vec<u8>, number: impl VarInt) {
    let mut buffer = [0; 10];
    let length = number.encode_var(&mut buffer);
    bytes.extend(&buffer[..length]);
}

/// Rest of the bytes of a node.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

impl Reader<'_> {
    pub(super) fn number<T: VarInt>(&mut self) -> Option<T> {
        let (number, length) = T::decode_var(self.0)?;
        self.0 = self.0.get(length..)?;
        Some(number)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn sums(&mut self) -> Option<LayerSums> {
        let mut sums = LayerSums::default();
        let (mut place, mut time) = (0_u32, 0_i64);
        for _ in 0..self.number::<u64>()? {
            place = place.checked_add(self.number()?)?;
            let mut voxel = VoxelLayers::default();
            let [points, red, green, blue] = self.numbers()?;
            voxel.colour = ColourSums { points, red, green, blue };
            let [points, sum] = self.numbers()?;
            voxel.intensity = IntensitySums { points, sum, squares: 0 };
            for _ in 0..self.number::<u64>()? {
                voxel.classes.push(ClassVotes { class: self.byte()?, votes: self.number()? });
            }
            if self.byte()? > 0 {
                time = time.wrapping_add(self.number()?);
                let last_ns = time.wrapping_add(self.number::<u64>()? as i64);
                voxel.time = Some(TimeSpan { first_ns: time, last_ns });
            }
            sums.voxels.push((place, voxel));
        }
        sums.totals = LayerTotals::read(self)?;
        self.0.is_empty().then_some(sums)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[u64; N]> {
        let mut numbers = [0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decoded_sums_equal_the_encoded_ones() {
        let mut voxel = VoxelLayers::default();
        voxel.colour = ColourSums { points: 3, red: 1 << 40, green: 0, blue: 7 };
        voxel.intensity = IntensitySums { points: 1, sum: 65535, squares: 0 };
        voxel.classes = vec![ClassVotes { class: 2, votes: 5 }, ClassVotes { class: 255, votes: 1 << 31 }];
        voxel.time = Some(TimeSpan { first_ns: i64::MIN, last_ns: i64::MAX });
        let mut sums = LayerSums::default();
        for (place, voxel) in [(0, VoxelLayers::default()), (0x7f, voxel.clone()), (0x0001_0000, voxel)] {
            sums.totals.add_voxel(&voxel);
            sums.voxels.push((place, voxel));
        }
        let bytes = sums.encode();
        assert_eq!(LayerSums::decode(&bytes).unwrap(), sums);
        for cut in 0..bytes.len() {
            assert!(LayerSums::decode(&bytes[..cut]).is_err(), "cut to {cut} bytes");
        }
    }
}
