use crate::config::Layers;
use crate::space::VoxelIndex;

/// Offsets along the edge of a voxel: a point's offset from the center is an integer from -512 to 511.
pub const OFFSETS_PER_VOXEL: i32 = 1024;

/// Points of one scan that hit voxels of one tile, with what the map's layers store of them, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerHits {
    /// Layers of the map.
    pub layers: Layers,
    /// Time stamp of the scan in nanoseconds, if known.
    pub stamp_ns: Option<i64>,
    hits: Vec<LayerHit>,
}

/// Point that hit a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LayerHit {
    /// Voxel relative to the tile's lowest, 10 bits per axis from x at bit 0.
    pub voxel: u32,
    /// Offset from the center of the voxel along x, y and z ([`OFFSETS_PER_VOXEL`]).
    pub offset: [i16; 3],
    /// Stored intensity ([`Layers::intensity_max`]).
    pub intensity: Option<u16>,
    /// Red, green and blue.
    pub colour: Option<[u8; 3]>,
    /// Class.
    pub class: Option<u8>,
}

impl LayerHit {
    /// The voxel relative to the tile's lowest.
    #[inline]
    pub fn voxel_offset(&self) -> VoxelIndex {
        [self.voxel & 1023, self.voxel >> 10 & 1023, self.voxel >> 20 & 1023].map(|k| k as i32)
    }

    /// Packs a voxel relative to the tile's lowest, below 1024 along each axis.
    #[inline]
    pub(crate) fn packed_voxel(offset: VoxelIndex) -> u32 {
        let [x, y, z] = offset.map(|k| k as u32 & 1023);
        x | y << 10 | z << 20
    }
}

impl LayerHits {
    pub(crate) fn new(layers: Layers, stamp_ns: Option<i64>) -> Self {
        Self { layers, stamp_ns, hits: Vec::new() }
    }

    pub(crate) fn push(&mut self, hit: LayerHit) {
        self.hits.push(hit);
    }

    /// Appends hits of the same scan.
    pub(crate) fn append(&mut self, others: &mut Self) {
        self.hits.append(&mut others.hits);
    }

    /// The hits.
    pub fn iter(&self) -> impl Iterator<Item = &LayerHit> {
        self.hits.iter()
    }

    /// The hits, consecutive ones of the same voxel and class together.
    pub(crate) fn runs(&self) -> impl Iterator<Item = &[LayerHit]> {
        self.hits.chunk_by(|a, b| a.voxel == b.voxel && a.class == b.class)
    }

    /// Number of hits.
    pub fn len(&self) -> usize {
        self.hits.len()
    }

    /// Returns whether there is no hit.
    pub fn is_empty(&self) -> bool {
        self.hits.is_empty()
    }

    /// Bytes of memory on the heap.
    pub(crate) fn bytes(&self) -> usize {
        self.hits.capacity() * size_of::<LayerHit>()
    }
}
