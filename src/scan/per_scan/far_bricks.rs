use crate::scan::pages::MarkedBrick;
use crate::space::{BRICK_EDGE, VoxelIndex, hash_table_bytes, place_of_voxel};
use rustc_hash::FxHashMap;

/// Marks outside the window, by brick: a page would be too large for the few voxels of a stray ray.
#[derive(Clone, Debug, Default)]
pub(crate) struct FarBricks {
    bricks: FxHashMap<VoxelIndex, MarkedBrick>,
    /// Brick of the current ray; not in `bricks` yet.
    latest: Option<MarkedBrick>,
}

impl FarBricks {
    /// Records a ray that passes a voxel.
    #[inline]
    pub(crate) fn pass(&mut self, voxel: VoxelIndex) {
        let (word, bit) = bit_of(voxel);
        self.brick(voxel).passed[word] |= bit;
    }

    /// Records a ray that ends in a voxel.
    pub(crate) fn hit(&mut self, voxel: VoxelIndex) {
        let (word, bit) = bit_of(voxel);
        self.brick(voxel).hits[word] |= bit;
    }

    #[inline]
    fn brick(&mut self, voxel: VoxelIndex) -> &mut MarkedBrick {
        let index = voxel.map(|k| k.div_euclid(BRICK_EDGE));
        if self.latest.is_none_or(|latest| latest.index != index) {
            self.put_latest_in();
        }
        self.latest.get_or_insert(MarkedBrick { index, hits: [0; 8], passed: [0; 8] })
    }

    /// Completes the bricks for [`FarBricks::get`].
    pub(crate) fn put_latest_in(&mut self) {
        if let Some(latest) = self.latest.take() {
            self.absorb_brick(&latest);
        }
    }

    fn absorb_brick(&mut self, other: &MarkedBrick) {
        let empty = MarkedBrick { hits: [0; 8], passed: [0; 8], ..*other };
        let mine = self.bricks.entry(other.index).or_insert(empty);
        for word in 0..8 {
            mine.hits[word] |= other.hits[word];
            mine.passed[word] |= other.passed[word];
        }
    }

    pub(crate) fn absorb(&mut self, others: &Self) {
        others.iter().for_each(|other| self.absorb_brick(other));
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &MarkedBrick> {
        self.bricks.values().chain(&self.latest)
    }

    /// The marks of a brick, if it has any.
    pub(crate) fn get(&self, brick: VoxelIndex) -> Option<&MarkedBrick> {
        self.bricks.get(&brick)
    }

    /// Removes and returns the bricks, each once.
    pub(crate) fn take(&mut self) -> Vec<MarkedBrick> {
        self.put_latest_in();
        std::mem::take(&mut self.bricks).into_values().collect()
    }

    pub(crate) fn clear(&mut self) {
        self.bricks.clear();
        self.latest = None;
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// Number of bricks; the last ray's brick may count twice.
    pub(crate) fn len(&self) -> usize {
        self.bricks.len() + usize::from(self.latest.is_some())
    }

    pub(crate) fn bytes(&self) -> usize {
        hash_table_bytes::<(VoxelIndex, MarkedBrick)>(self.bricks.capacity())
    }
}

fn bit_of(voxel: VoxelIndex) -> (usize, u64) {
    let place = place_of_voxel(voxel);
    (place / 64, 1 << (place % 64))
}
