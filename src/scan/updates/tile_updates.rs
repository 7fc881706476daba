use super::layer_hits::LayerHits;
use super::tile_runs::TileRuns;
use crate::scan::{PackedUpdates, ScanReport};
use crate::sensor::Observation;
use crate::space::{BrickCode, BrickMask, TileIndex, VoxelIndex, is_in_mask, places};

/// All updates of one accepted call, grouped by tile in Morton order of the tiles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanUpdates {
    /// Updates of each tile.
    pub tiles: Vec<(TileIndex, TileUpdates)>,
    /// Counts of the points and updates.
    pub report: ScanReport,
}

impl ScanUpdates {
    /// Bytes of memory that the updates occupy.
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(|(_, updates)| updates.bytes()).sum()
    }
}

/// Updates of one call for one tile, in a form that can be stored and applied later.
#[derive(Clone, Debug, PartialEq)]
pub enum TileUpdates {
    /// At most one update per voxel: masks per brick, in Morton order.
    Masks(Vec<BrickUpdate>),
    /// Any number of updates per voxel, those of a voxel in order: runs per brick, in Morton order.
    Runs(TileRuns),
    /// Any number of updates per voxel, all in order.
    Ordered(OrderedUpdates),
    /// Any of these, packed.
    Packed(PackedUpdates),
    /// Points that hit voxels, for the layers; no updates of evidence.
    Layers(LayerHits),
    /// Updates of evidence, and the points of the same scan that hit voxels.
    WithLayers(Box<TileUpdates>, LayerHits),
}

/// Voxels of one brick that one scan updates, each once.
#[derive(Clone, Debug, PartialEq)]
pub struct BrickUpdate {
    /// Code of the brick.
    pub brick: BrickCode,
    /// Voxels that were hit.
    pub hits: BrickMask,
    /// Voxels that were passed and not hit.
    pub misses: BrickMask,
    /// Weak misses, a subset of `misses`: they do not change a known voxel.
    pub weak: BrickMask,
    /// The largest intensity of each hit voxel, in the order of the mask; empty for sensor models that need none.
    pub intensities: Box<[f32]>,
}

/// Updates of voxels of one tile, all in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OrderedUpdates {
    /// Voxel relative to the tile's lowest, 10 bits per axis from x at bit 0; bit 31 is set for a hit.
    voxels: Vec<u32>,
    /// Intensity of each hit, in order; empty for sensor models that need none.
    intensities: Vec<f32>,
}

const HIT: u32 = 1 << 31;

impl OrderedUpdates {
    /// Appends an update. `offset` is the voxel relative to the tile's lowest, below 1024 along each axis.
    pub(crate) fn push(&mut self, offset: VoxelIndex, observation: Observation, keep_intensity: bool) {
        let [x, y, z] = offset.map(|k| k as u32 & 1023);
        let voxel = x | y << 10 | z << 20;
        match observation {
            Observation::Miss => self.voxels.push(voxel),
            Observation::Hit(intensity) => {
                self.voxels.push(voxel | HIT);
                if keep_intensity {
                    self.intensities.push(intensity);
                }
            }
        }
    }

    /// The packed voxels and the intensities, as for [`OrderedUpdates::from_parts`].
    pub(crate) fn parts(&self) -> (&[u32], &[f32]) {
        (&self.voxels, &self.intensities)
    }

    pub(crate) fn from_parts(voxels: Vec<u32>, intensities: Vec<f32>) -> Self {
        Self { voxels, intensities }
    }

    /// The updates in order: the voxel relative to the tile's lowest, and the observation.
    pub fn iter(&self) -> impl Iterator<Item = (VoxelIndex, Observation)> {
        let mut intensities = self.intensities.iter();
        self.voxels.iter().map(move |packed| {
            let offset = [packed & 1023, packed >> 10 & 1023, packed >> 20 & 1023].map(|k| k as i32);
            let observation = if packed & HIT == 0 {
                Observation::Miss
            } else {
                Observation::Hit(intensities.next().copied().unwrap_or_default())
            };
            (offset, observation)
        })
    }

    pub(crate) fn hits_and_misses(&self) -> (u64, u64) {
        let hits = self.voxels.iter().filter(|packed| **packed & HIT != 0).count() as u64;
        (hits, self.voxels.len() as u64 - hits)
    }

    /// Number of updates.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Returns whether there is no update.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }
}

impl BrickUpdate {
    /// Mask of the updated voxels.
    pub fn touched(&self) -> BrickMask {
        std::array::from_fn(|word| self.hits[word] | self.misses[word])
    }

    /// Observation of each updated voxel, in Morton order.
    pub fn observations(&self) -> impl Iterator<Item = Observation> {
        let mut intensities = self.intensities.iter();
        places(self.touched()).map(move |place| {
            if is_in_mask(&self.hits, place) {
                Observation::Hit(intensities.next().copied().unwrap_or_default())
            } else {
                Observation::Miss
            }
        })
    }
}

impl TileUpdates {
    /// Number of updates.
    pub fn len(&self) -> usize {
        match self {
            Self::Masks(bricks) => bricks
                .iter()
                .flat_map(|brick| brick.hits.iter().chain(&brick.misses))
                .map(|word| word.count_ones() as usize)
                .sum(),
            Self::Runs(runs) => runs.len(),
            Self::Ordered(updates) => updates.len(),
            Self::Packed(updates) => updates.len(),
            Self::Layers(hits) => hits.len(),
            Self::WithLayers(updates, hits) => updates.len() + hits.len(),
        }
    }

    /// Adds the points of the same scan that hit voxels.
    pub(crate) fn with_layers(self, hits: LayerHits) -> Self {
        if hits.is_empty() { self } else { Self::WithLayers(Box::new(self), hits) }
    }

    /// Returns whether there is no update.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Masks(bricks) => bricks.iter().all(|brick| brick.touched() == [0; 8]),
            Self::Runs(runs) => runs.is_empty(),
            Self::Ordered(updates) => updates.is_empty(),
            Self::Packed(updates) => updates.len() == 0,
            Self::Layers(hits) => hits.is_empty(),
            Self::WithLayers(updates, hits) => updates.is_empty() && hits.is_empty(),
        }
    }

    /// Bytes of memory that the updates occupy.
    pub fn bytes(&self) -> usize {
        let heap = match self {
            Self::Masks(bricks) => {
                let intensities: usize = bricks.iter().map(|brick| size_of_val(&*brick.intensities)).sum();
                bricks.capacity() * size_of::<BrickUpdate>() + intensities
            }
            Self::Runs(runs) => runs.bytes(),
            Self::Ordered(updates) => (updates.voxels.capacity() + updates.intensities.capacity()) * 4,
            Self::Packed(updates) => updates.bytes(),
            Self::Layers(hits) => hits.bytes(),
            Self::WithLayers(updates, hits) => updates.bytes() + hits.bytes(),
        };
        size_of::<Self>() + heap
    }
}
