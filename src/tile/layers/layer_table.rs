use super::hit_run::HitRun;
use super::layered_brick::LayeredBrick;
use super::row::Row;
use super::voxel_layers::{ClassVotes, VoxelLayers};
use crate::config::Layers;
use crate::scan::LayerHits;
use crate::space::{BrickCode, BrickMask, MortonCode, VoxelIndex, VoxelKey, place_of_voxel};
use rustc_hash::FxHashMap;

/// Layers of the hit voxels of a tile.
#[derive(Clone, Debug, Default)]
pub struct LayerTable {
    layers: Layers,
    /// Number of each brick.
    numbers: FxHashMap<BrickCode, u32>,
    /// In the order of their first hit.
    bricks: Vec<(BrickCode, LayeredBrick)>,
    /// Bytes of memory on the heap of the bricks' content.
    content_bytes: usize,
}

impl LayerTable {
    /// Creates a table without hit voxels.
    pub fn new(layers: Layers) -> Self {
        Self { layers, ..Self::default() }
    }

    /// The layers that the table stores.
    pub fn layers(&self) -> Layers {
        self.layers
    }

    /// Returns whether no voxel was hit.
    pub fn is_empty(&self) -> bool {
        self.bricks.is_empty()
    }

    /// Number of hit voxels.
    pub fn len(&self) -> usize {
        let voxels = |mask: BrickMask| mask.iter().map(|word| word.count_ones() as usize).sum::<usize>();
        self.bricks.iter().map(|(_, brick)| voxels(brick.mask())).sum()
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        // The map of numbers stores one byte of metadata per slot.
        self.numbers.capacity() * (size_of::<(BrickCode, u32)>() + 1)
            + self.bricks.capacity() * size_of::<(BrickCode, LayeredBrick)>()
            + self.content_bytes
    }

    /// The layers of a voxel; `None` if no point hit it.
    pub fn get(&self, voxel: MortonCode) -> Option<VoxelLayers> {
        self.brick(voxel.brick())?.get(voxel.place_in_brick(), &self.layers)
    }

    /// Time stamp of the last hit in nanoseconds; `None` if no hit has a time.
    pub(crate) fn last_ns(&self) -> Option<i64> {
        let mut newest = None;
        self.for_each_row(|row, base_ns, _| {
            newest = newest.max(row.time(base_ns).map(|time| time.last_ns));
        });
        newest.filter(|_| self.layers.time)
    }

    /// Adds the points of a scan; `first` is the tile's lowest voxel.
    pub fn add(&mut self, first: VoxelIndex, hits: &LayerHits) {
        let first = VoxelKey::from_index(first).0;
        let layers = self.layers;
        // Neighboring points mostly hit the same brick.
        let (mut last, mut number, mut bytes_before) = (None, 0, 0);
        for run in hits.runs() {
            let Some(hit) = run.first() else { continue };
            let offset = hit.voxel_offset();
            let key: [u16; 3] = std::array::from_fn(|k| first[k].wrapping_add(offset[k] as u16));
            let corner = key.map(|k| k / 8);
            if last != Some(corner) {
                if last.is_some() {
                    self.note_grown(number, bytes_before);
                }
                last = Some(corner);
                number = self.number_of(VoxelKey(key).morton().brick());
                bytes_before = self.bricks[number].1.heap_bytes();
            }
            let place = place_of_voxel(key.map(i32::from));
            let run = HitRun::of(run, &layers);
            self.bricks[number].1.add(place, &run, hits.stamp_ns, &layers);
        }
        if last.is_some() {
            self.note_grown(number, bytes_before);
        }
    }

    fn note_grown(&mut self, number: usize, bytes_before: usize) {
        self.content_bytes += self.bricks[number].1.heap_bytes();
        self.content_bytes -= bytes_before;
    }

    /// Replaces the layers of a voxel.
    pub fn put(&mut self, voxel: MortonCode, made: &VoxelLayers) {
        let number = self.number_of(voxel.brick());
        let brick = &mut self.bricks[number].1;
        let before = brick.heap_bytes();
        brick.put(voxel.place_in_brick(), made, &self.layers);
        self.content_bytes += brick.heap_bytes();
        self.content_bytes -= before;
    }

    /// Visits the hit voxels in Morton order.
    pub fn for_each(&self, mut visit: impl FnMut(MortonCode, VoxelLayers)) {
        for (code, brick) in self.in_order() {
            brick.for_each(&self.layers, |place, made| visit(code.voxel(place), made));
        }
    }

    /// Visits the rows of the hit voxels in Morton order, each in its one form, with the base of its times and the votes
    /// for other classes than the main one.
    pub(crate) fn for_each_row(&self, mut visit: impl FnMut(&Row, i64, &[ClassVotes])) {
        self.in_order().for_each(|(_, brick)| brick.for_each_row(&self.layers, &mut visit));
    }

    /// The bricks with hit voxels in Morton order, with the masks of these.
    pub(crate) fn masks(&self) -> impl Iterator<Item = (BrickCode, BrickMask)> {
        self.in_order().map(|(code, brick)| (code, brick.mask()))
    }

    /// Returns the layers of the voxels that `keeps` selects.
    pub(crate) fn filtered(&self, keeps: impl Fn(MortonCode) -> bool) -> Self {
        let mut kept = Self::new(self.layers);
        self.for_each(|code, made| {
            if keeps(code) {
                kept.put(code, &made);
            }
        });
        kept
    }

    /// Adds the sums of another table.
    pub(crate) fn merge(&mut self, other: &Self) {
        other.for_each(|code, made| {
            let mut sum = self.get(code).unwrap_or_default();
            sum.add(&made);
            self.put(code, &sum);
        });
    }

    /// Returns the number of voxels that only one of the tables has, or with other sums.
    pub(crate) fn differences(&self, other: &Self) -> u64 {
        let mut count = 0;
        self.for_each(|voxel, made| count += u64::from(other.get(voxel).as_ref() != Some(&made)));
        other.for_each(|voxel, _| count += u64::from(self.get(voxel).is_none()));
        count
    }

    /// Returns whether both have the same layers of the same voxels.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let mut is_same = self.layers == other.layers && self.masks().eq(other.masks());
        if is_same {
            self.for_each(|voxel, made| is_same &= other.get(voxel).as_ref() == Some(&made));
        }
        is_same
    }

    fn in_order(&self) -> impl Iterator<Item = (BrickCode, &LayeredBrick)> {
        let mut bricks: Vec<_> = self.bricks.iter().map(|(code, brick)| (*code, brick)).collect();
        bricks.sort_unstable_by_key(|(code, _)| *code);
        bricks.into_iter()
    }

    fn brick(&self, code: BrickCode) -> Option<&LayeredBrick> {
        Some(&self.bricks[*self.numbers.get(&code)? as usize].1)
    }

    fn number_of(&mut self, code: BrickCode) -> usize {
        let next = self.bricks.len() as u32;
        let number = *self.numbers.entry(code).or_insert(next);
        if number == next {
            if self.bricks.len() == self.bricks.capacity() {
                // Less slack than the default growth of a vector.
                self.bricks.reserve_exact((self.bricks.len() / 4).max(4));
            }
            self.bricks.push((code, LayeredBrick::default()));
        }
        number as usize
    }
}
