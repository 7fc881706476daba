use crate::bits::{Bits, Run};
use crate::blocks::Cube;
use crate::sets::Sets;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::hash_map::Entry;
use voxtile::mapper::MapView;
use voxtile::{Result, VoxelIndex, VoxelLayers};

/// The connected parts of a set of voxels in a block: voxels are connected if they share a face, an edge or a corner.
pub(crate) struct Components {
    /// Cube in which the runs have positions.
    cube: Cube,
    runs: Vec<Run>,
    /// Part of each run.
    part_of_run: Vec<u32>,
    /// By their lowest voxel.
    pub(crate) parts: Vec<Sums>,
}

/// Sums over connected voxels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sums {
    pub(crate) voxels: u64,
    /// First voxel by z, then y, then x.
    pub(crate) lowest: VoxelIndex,
    pub(crate) min: VoxelIndex,
    pub(crate) max: VoxelIndex,
    /// Sums of the indices.
    pub(crate) total: [i128; 3],
    /// Faces between free and unknown voxels; 0 for changes.
    pub(crate) faces: u64,
    /// `None` without layers.
    pub(crate) layers: Option<Box<VoxelLayers>>,
}

/// Order of voxels by z, then y, then x.
pub(crate) fn order([x, y, z]: VoxelIndex) -> VoxelIndex {
    [z, y, x]
}

impl Sums {
    /// Adds other voxels.
    pub(crate) fn add(&mut self, other: &Self) {
        if self.voxels == 0 {
            *self = other.clone();
            return;
        }
        self.voxels += other.voxels;
        if order(other.lowest) < order(self.lowest) {
            self.lowest = other.lowest;
        }
        for k in 0..3 {
            self.min[k] = self.min[k].min(other.min[k]);
            self.max[k] = self.max[k].max(other.max[k]);
            self.total[k] += other.total[k];
        }
        self.faces += other.faces;
        if let Some(layers) = &other.layers {
            self.add_layers(layers);
        }
    }

    fn add_layers(&mut self, layers: &VoxelLayers) {
        self.layers.get_or_insert_default().add(layers);
    }

    fn of_run(run: &Run, at: impl Fn([usize; 3]) -> VoxelIndex) -> Self {
        let (y, z) = (usize::from(run.y), usize::from(run.z));
        let (first, last) = (at([usize::from(run.x), y, z]), at([usize::from(run.end) - 1, y, z]));
        let voxels = i128::from(run.end - run.x);
        Self {
            voxels: voxels as u64,
            lowest: first,
            min: first,
            max: last,
            total: [
                (i128::from(first[0]) + i128::from(last[0])) * voxels / 2,
                i128::from(first[1]) * voxels,
                i128::from(first[2]) * voxels,
            ],
            faces: 0,
            layers: None,
        }
    }
}

impl Components {
    pub(crate) fn of(bits: &Bits) -> Self {
        let (cube, runs) = (bits.cube(), bits.runs());
        let mut sets = Sets::default();
        // Index of the first run of each earlier row with runs.
        let mut rows: FxHashMap<(u16, u16), usize> = FxHashMap::default();
        for (number, run) in runs.iter().enumerate() {
            sets.push();
            rows.entry((run.y, run.z)).or_insert(number);
            let earlier = [(0, -1), (-1, -1), (-1, 0), (-1, 1)];
            for (dz, dy) in earlier {
                let (Some(y), Some(z)) = (run.y.checked_add_signed(dy), run.z.checked_add_signed(dz)) else {
                    continue;
                };
                let Some(&first) = rows.get(&(y, z)) else { continue };
                let near =
                    runs[first..].iter().zip(first..).take_while(|(other, _)| (other.y, other.z) == (y, z));
                for (_, other) in near.filter(|(other, _)| other.x <= run.end && run.x <= other.end) {
                    sets.unite(number as u32, other as u32);
                }
            }
        }
        let mut parts: Vec<Sums> = Vec::new();
        let mut number_of_root: FxHashMap<u32, u32> = FxHashMap::default();
        let mut part_of_run = Vec::with_capacity(runs.len());
        for (number, run) in runs.iter().enumerate() {
            let part = *number_of_root.entry(sets.root(number as u32)).or_insert_with(|| {
                parts.push(Sums::default());
                parts.len() as u32 - 1
            });
            parts[part as usize].add(&Sums::of_run(run, |place| cube.voxel_at(place)));
            part_of_run.push(part);
        }
        Self { cube, runs, part_of_run, parts }
    }

    /// The voxels with the numbers of their parts.
    pub(crate) fn voxels(&self) -> impl Iterator<Item = (VoxelIndex, u32)> {
        self.runs.iter().zip(&self.part_of_run).flat_map(move |(run, &part)| {
            let (y, z) = (usize::from(run.y), usize::from(run.z));
            (run.x..run.end).map(move |x| (self.cube.voxel_at([usize::from(x), y, z]), part))
        })
    }

    /// The voxels at the border of a block, with the numbers of their parts.
    pub(crate) fn border(&self, block: Cube) -> Vec<(VoxelIndex, u32)> {
        let is_at_border = |voxel: &VoxelIndex| {
            (0..3).any(|k| {
                let place = i64::from(voxel[k]) - block.min[k];
                place == 0 || place == block.edge as i64 - 1
            })
        };
        self.voxels().filter(|(voxel, _)| is_at_border(voxel)).collect()
    }

    /// Adds the number of set bits at each voxel to the faces of its part.
    pub(crate) fn count_faces(&mut self, faces: &[Bits]) {
        for (run, &part) in self.runs.iter().zip(&self.part_of_run) {
            for x in run.x..run.end {
                let place = [x, run.y, run.z].map(usize::from);
                let count = faces.iter().filter(|bits| bits.contains(place)).count();
                self.parts[part as usize].faces += count as u64;
            }
        }
    }

    /// Adds the layers of a map.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    pub(crate) fn add_layers(&mut self, map: &impl MapView) -> Result<()> {
        let grid = map.config().grid;
        let mut tiles = FxHashMap::default();
        let voxels: Vec<_> = self.voxels().collect();
        for (voxel, part) in voxels {
            let index = grid.tile_of_voxel(voxel);
            let tile = match tiles.entry(index) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => entry.insert(map.tile_uncached(index)?),
            };
            let layers = tile.as_ref().and_then(|tile| tile.layers_of(voxel));
            if let Some(layers) = layers {
                self.parts[part as usize].add_layers(&layers);
            }
        }
        Ok(())
    }
}
