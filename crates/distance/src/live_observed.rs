use crate::bits::Bits;
use crate::extent::Extent;
use crate::observed::Observed;
use crate::options::{DistanceOptions, UnknownRule};
use crate::tiles_of_map::tiles_in;
use rustc_hash::FxHashMap;
use voxtile::mapper::MapView;
use voxtile::query::occupied_set::OccupiedSet;
use voxtile::space::BrickMask;
use voxtile::{Result, TileIndex, VoxelIndex};

/// The voxels of a box as of the last look at a map, and the rows that changed since the last computation.
#[derive(Debug)]
pub(crate) struct LiveObserved {
    pub(crate) observed: Observed,
    /// Bricks of a map of tiles that were seen in the box. A brick on a border of tiles exists in both.
    bricks: FxHashMap<(TileIndex, VoxelIndex), SeenBrick>,
    /// Number of the current look.
    look: u64,
    /// Rows whose obstacles changed, by z, then y.
    is_changed: Vec<bool>,
    /// Whether voxels became known or unknown without an effect on the distances of others.
    has_other_known: bool,
    /// Whether the voxels are those of a set, so that `bricks` is not valid.
    is_of_set: bool,
    /// Whether distances depend on which voxels are known.
    known_matters: bool,
}

#[derive(Clone, Copy, Debug)]
struct SeenBrick {
    known: BrickMask,
    occupied: BrickMask,
    look: u64,
}

impl LiveObserved {
    pub(crate) fn new(extent: Extent, options: &DistanceOptions) -> Self {
        Self {
            observed: Observed::new(extent, options),
            bricks: FxHashMap::default(),
            look: 0,
            is_changed: vec![false; extent.size[1] * extent.size[2]],
            has_other_known: false,
            is_of_set: false,
            known_matters: options.unknown == UnknownRule::Obstacle
                || options.unknown == UnknownRule::Unknown && options.is_signed,
        }
    }

    /// The rows whose obstacles changed since [`LiveObserved::forget_changes`], by z, then y.
    pub(crate) fn changed_rows(&self) -> &[bool] {
        &self.is_changed
    }

    /// Returns whether any voxel changed since [`LiveObserved::forget_changes`].
    pub(crate) fn has_changes(&self) -> bool {
        self.has_other_known || self.is_changed.contains(&true)
    }

    pub(crate) fn forget_changes(&mut self) {
        self.is_changed.fill(false);
        self.has_other_known = false;
    }

    /// Takes over the voxels of a map. After an error, some are those of earlier looks.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    pub(crate) fn look_at_map(&mut self, map: &impl MapView) -> Result<()> {
        self.look += 1;
        if std::mem::take(&mut self.is_of_set) {
            self.observed.clear();
            self.is_changed.fill(true);
        }
        let extent = self.observed.extent();
        let voxels = extent.voxels();
        for index in tiles_in(map, &extent) {
            let Some(tile) = map.tile(index)? else { continue };
            tile.for_each_brick_in(&voxels, map.config().occupied_log_odds(), |lowest, known, occupied| {
                self.see(index, lowest, known, occupied);
            });
        }
        self.forget_unseen();
        Ok(())
    }

    fn see(&mut self, tile: TileIndex, lowest: VoxelIndex, known: &BrickMask, occupied: &BrickMask) {
        let empty = SeenBrick { known: [0; 8], occupied: [0; 8], look: 0 };
        let seen = self.bricks.entry((tile, lowest)).or_insert(empty);
        let before =
            std::mem::replace(seen, SeenBrick { known: *known, occupied: *occupied, look: self.look });
        self.toggle(lowest, difference(&before.known, known), difference(&before.occupied, occupied));
    }

    /// Removes the voxels of bricks that were not part of the current look.
    fn forget_unseen(&mut self) {
        let look = self.look;
        let unseen: Vec<_> =
            self.bricks.iter().filter(|(_, brick)| brick.look != look).map(|(key, _)| *key).collect();
        for key in unseen {
            if let Some(brick) = self.bricks.remove(&key) {
                self.toggle(key.1, Some(brick.known), Some(brick.occupied));
            }
        }
    }

    fn toggle(&mut self, lowest: VoxelIndex, known: Option<BrickMask>, occupied: Option<BrickMask>) {
        let y_edge = self.observed.extent().size[1];
        let is_changed = &mut self.is_changed;
        let mut note = |y: usize, z: usize| is_changed[z * y_edge + y] = true;
        if let Some(occupied) = occupied {
            self.observed.occupied.toggle_brick(lowest, &occupied, &mut note);
        }
        if let (Some(known), Some(bits)) = (known, &mut self.observed.known) {
            if self.known_matters {
                bits.toggle_brick(lowest, &known, note);
            } else {
                bits.toggle_brick(lowest, &known, |_, _| self.has_other_known = true);
            }
        }
    }

    /// Takes over the voxels of a set; all others are unknown.
    pub(crate) fn look_at_set(&mut self, set: &impl OccupiedSet) {
        let extent = self.observed.extent();
        let mut occupied = Bits::new(extent);
        set.visit_in(&extent.voxels(), &mut |voxel| {
            occupied.toggle(voxel);
            true
        });
        for z in 0..extent.size[2] {
            for y in 0..extent.size[1] {
                let row = occupied.row(y, z);
                let is_known = |known: &Bits| known.row(y, z) == row;
                self.is_changed[z * extent.size[1] + y] |= row != self.observed.occupied.row(y, z)
                    || !self.observed.known.as_ref().is_none_or(is_known);
            }
        }
        if let Some(known) = &mut self.observed.known {
            known.clone_from(&occupied);
        }
        self.observed.occupied = occupied;
        self.bricks.clear();
        self.is_of_set = true;
    }
}

fn difference(before: &BrickMask, after: &BrickMask) -> Option<BrickMask> {
    (before != after).then(|| std::array::from_fn(|word| before[word] ^ after[word]))
}
