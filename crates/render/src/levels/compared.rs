use super::cells::{Cell, Cells, Scale, axes, place};
use super::node_bytes::{self, Head};
use super::node_key::{MAX_LEVEL, NodeKey};
use super::node_store::NodeStore;
use super::tileset::TilesetNodes;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;
use std::path::Path;
use voxtile::space::{Aabb, Point, VoxelIndex};
use voxtile::{Error, Grid, Result};
use voxtile_compare::VoxelClass;

/// Voxels along the edge of a node, at any level.
const EDGE: i32 = 128;

/// Levels of the voxels of a comparison. The value of a voxel is the set of its classes, each a [bit](class_bit). A coarse
/// voxel has those of all voxels in it.
#[derive(Debug)]
pub struct ComparedLevels {
    grid: Grid,
    store: NodeStore,
    /// Version of each node: a hash of its bytes and of the versions of its children.
    nodes: FxHashMap<NodeKey, u64>,
    tops: Vec<NodeKey>,
}

/// Builder of [`ComparedLevels`].
#[derive(Debug)]
pub struct ComparedLevelsBuilder {
    levels: ComparedLevels,
    /// Voxels of the current node.
    current: Option<(NodeKey, Vec<Cell>)>,
}

impl ComparedLevelsBuilder {
    /// Creates a builder that writes nodes to an empty store.
    pub fn new(grid: Grid, store: NodeStore) -> Self {
        let levels = ComparedLevels { grid, store, nodes: FxHashMap::default(), tops: Vec::new() };
        Self { levels, current: None }
    }

    /// Adds a voxel. The voxels of a node of level 0, such as those of a block of
    /// [`for_each_voxel`](voxtile_compare::for_each_voxel), must be added one after another.
    ///
    /// # Errors
    ///
    /// Fails if the store cannot be written, or if the voxels of a node are not added one after another.
    pub fn add(&mut self, voxel: VoxelIndex, class: VoxelClass) -> Result<()> {
        let key = NodeKey { level: 0, index: voxel.map(|k| k.div_euclid(EDGE)) };
        if self.current.as_ref().is_none_or(|(current, _)| *current != key) {
            self.write_current()?;
            if self.levels.nodes.contains_key(&key) {
                let reason = "the voxels of a node must be added one after another";
                return Err(Error::argument("voxels", reason));
            }
        }
        let at = voxel.map(|k| i64::from(k.rem_euclid(EDGE)));
        let cell = Cell { place: place(at), value: 1 << class_bit(class), count: 0 };
        self.current.get_or_insert_with(|| (key, Vec::new())).1.push(cell);
        Ok(())
    }

    /// Builds the coarser levels.
    ///
    /// # Errors
    ///
    /// Fails if the store cannot be read or written.
    pub fn finish(mut self) -> Result<ComparedLevels> {
        self.write_current()?;
        let mut levels = self.levels;
        let mut level: Vec<NodeKey> = levels.nodes.keys().copied().collect();
        while !is_small(&level) && level.iter().all(|key| key.level < MAX_LEVEL) {
            let parents: BTreeSet<NodeKey> = level.iter().map(|key| key.parent()).collect();
            level = parents.into_iter().collect();
            let made: Result<Vec<_>> =
                level.par_iter().map(|&key| Ok((key, levels.write(key, levels.coarse(key)?)?))).collect();
            levels.nodes.extend(made?);
        }
        level.sort_unstable();
        levels.tops = level;
        Ok(levels)
    }

    fn write_current(&mut self) -> Result<()> {
        if let Some((key, cells)) = self.current.take() {
            let version = self.levels.write(key, united(cells))?;
            self.levels.nodes.insert(key, version);
        }
        Ok(())
    }
}

impl ComparedLevels {
    /// Returns the store of the nodes, for [`tileset`](super::tileset()).
    pub fn store(&self) -> &NodeStore {
        &self.store
    }

    /// Returns the compressed bytes of a node; `None` if there is no such node.
    ///
    /// # Errors
    ///
    /// Fails if the store cannot be read.
    pub fn node(&self, key: NodeKey) -> Result<Option<Vec<u8>>> {
        match self.nodes.get(&key) {
            Some(version) => self.store.get(key, *version),
            None => Ok(None),
        }
    }

    /// Returns the voxels of a node from its children.
    fn coarse(&self, key: NodeKey) -> Result<Cells> {
        let mut cells = Vec::new();
        for child in key.children() {
            let Some(bytes) = self.node(child)? else { continue };
            let finer = node_bytes::decode(&bytes)
                .map_err(|error| Error::io(Path::new("levels"), "decode", error))?;
            let corner: [i64; 3] =
                std::array::from_fn(|k| i64::from(child.index[k] & 1) * i64::from(EDGE / 2));
            cells.extend(finer.cells.into_iter().map(|cell| {
                let at = axes(cell.place);
                Cell { place: place(std::array::from_fn(|k| corner[k] + at[k] / 2)), ..cell }
            }));
        }
        Ok(united(cells))
    }

    fn write(&self, key: NodeKey, cells: Cells) -> Result<u64> {
        let bytes = node_bytes::encode(&self.head(key), &cells);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&bytes);
        // Files of several levels contain the versions of children.
        for child in key.children() {
            hasher.update(&self.nodes.get(&child).copied().unwrap_or_default().to_le_bytes());
        }
        let version =
            hasher.finalize().as_bytes()[..8].iter().fold(0, |number, byte| number << 8 | u64::from(*byte));
        let bounds = cells.bounds().unwrap_or_default();
        self.store.put(key, version, &bytes, bounds, cells.cells.len() as u32)?;
        Ok(version)
    }

    fn head(&self, key: NodeKey) -> Head {
        Head {
            corner_m: self.corner_m(key),
            voxel_edge_m: self.voxel_edge_m(key.level),
            edge: i64::from(EDGE),
            kind: 4,
            scale: Scale { least: 0.0, most: 255.0 },
            threshold: 0.0,
        }
    }
}

/// Bit of a class in [`ComparedLevels`], by its position in [`VoxelClass::ALL`]. Hidden voxels of both maps have the last.
pub fn class_bit(class: VoxelClass) -> u8 {
    (class as u8).min(VoxelClass::HiddenBefore as u8)
}

/// Sorts cells and merges those of one position, with the classes of all of them.
fn united(mut cells: Vec<Cell>) -> Cells {
    cells.sort_unstable_by_key(|cell| cell.place);
    cells.dedup_by(|later, kept| {
        let is_same = later.place == kept.place;
        if is_same {
            kept.value |= later.value;
        }
        is_same
    });
    Cells { cells, last_scan: 0 }
}

/// Returns whether a level has at most two nodes along each axis.
fn is_small(level: &[NodeKey]) -> bool {
    (0..3).all(|k| {
        let places = || level.iter().map(|key| i64::from(key.index[k]));
        places().max().zip(places().min()).is_none_or(|(most, least)| most - least <= 1)
    })
}

impl TilesetNodes for ComparedLevels {
    fn tops(&self) -> Vec<NodeKey> {
        self.tops.clone()
    }

    fn version(&self, key: NodeKey) -> Option<u64> {
        self.nodes.get(&key).copied()
    }

    fn is_occupied(&self, key: NodeKey) -> bool {
        self.nodes.contains_key(&key)
    }

    fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb {
        let stored = self.nodes.get(&key).and_then(|version| store.find(key, *version));
        let bounds = stored.map_or([[0; 3], [(EDGE - 1) as u8; 3]], |stored| stored.bounds);
        let [min, max] = node_bytes::bounds_m(&self.head(key), bounds);
        Aabb { min, max }
    }

    fn corner_m(&self, key: NodeKey) -> Point {
        let edge_m = f64::from(EDGE) * self.voxel_edge_m(key.level);
        key.index.map(|k| f64::from(k) * edge_m)
    }

    fn voxel_edge_m(&self, level: u8) -> f64 {
        self.grid.resolution_m() * (1_u64 << level) as f64
    }

    fn tile_level(&self) -> u8 {
        0
    }

    fn within_tile(&self, _store: &NodeStore, _key: NodeKey) -> Result<BTreeSet<NodeKey>> {
        Ok(BTreeSet::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_voxels_have_the_classes_of_all_voxels_in_them() {
        let store = NodeStore::open(std::io::Cursor::new(Vec::new()), "nodes").unwrap();
        let mut builder = ComparedLevelsBuilder::new(Grid::new(0.5, 8.0).unwrap(), store);
        // Three blocks along x, from -128 on.
        let voxels = [
            ([-128, 0, 0], VoxelClass::Appeared),
            ([-1, 0, 0], VoxelClass::Unchanged),
            ([0, 0, 0], VoxelClass::Vanished),
            ([1, 1, 1], VoxelClass::Appeared),
            ([255, 0, 0], VoxelClass::UncertainVanished),
        ];
        for (voxel, class) in voxels {
            builder.add(voxel, class).unwrap();
        }
        assert!(builder.add([0, 0, 0], VoxelClass::Appeared).is_err());
        let levels = builder.finish().unwrap();
        let of = |level, x: i32| {
            let bytes = levels.node(NodeKey { level, index: [x, 0, 0] }).unwrap();
            let cells = node_bytes::decode(&bytes.unwrap()).unwrap().cells;
            cells.iter().map(|cell| (axes(cell.place), cell.value)).collect::<Vec<_>>()
        };
        assert_eq!(of(0, 0), [([0, 0, 0], 0b100), ([1, 1, 1], 0b10)]);
        assert_eq!(of(1, 0), [([0, 0, 0], 0b110), ([127, 0, 0], 0b100_0000)]);
        assert_eq!(of(1, -1), [([64, 0, 0], 0b10), ([127, 0, 0], 0b1)]);
        assert_eq!(levels.tops(), [-1, 0].map(|x| NodeKey { level: 1, index: [x, 0, 0] }));
        let top = levels.bounds_m(levels.store(), levels.tops()[1]);
        assert_eq!((top.min, top.max), ([0.0; 3], [128.0, 1.0, 1.0]));
        let empty = NodeStore::open(std::io::Cursor::new(Vec::new()), "nodes").unwrap();
        let empty = ComparedLevelsBuilder::new(Grid::new(0.5, 8.0).unwrap(), empty).finish().unwrap();
        assert!(empty.tops().is_empty());
    }
}
