use super::cells::{Cell, Cells, Kind, Scale};
use super::levels_of_map::Levels;
use super::node_bytes::{self, Head};
use super::node_key::NodeKey;
use super::node_store::NodeStore;
use super::tileset::{LevelsOf, TilesetNodes};
use std::collections::BTreeSet;
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point};
use voxtile::{Error, Result};

/// Difference of two states of a map, node by node: voxels that appeared (1), vanished (2), or are occupied in both
/// (3).
pub struct Difference<'a, V> {
    before: LevelsOf<'a, V>,
    after: LevelsOf<'a, V>,
}

impl<'a, V: MapView> Difference<'a, V> {
    /// Creates the difference of two states. Each state is given by its levels and its map, from which tiles are read.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if resolution or tile size differ.
    pub fn new(before: (&'a Levels, &'a V), after: (&'a Levels, &'a V)) -> Result<Self> {
        if before.1.config().grid != after.1.config().grid {
            return Err(Error::argument("difference", "the maps differ in resolution or tile size"));
        }
        let of = |(levels, map)| LevelsOf { levels, map };
        Ok(Self { before: of(before), after: of(after) })
    }

    /// Returns the bytes of a node as [`Levels::node`] does; `None` if neither state has it.
    ///
    /// # Errors
    ///
    /// Fails if a tile or the store cannot be read.
    pub fn node(&self, store: &NodeStore, key: NodeKey) -> Result<Option<Vec<u8>>> {
        if self.version_of(key).is_none() {
            return Ok(None);
        }
        let level = key.level.max(self.tile_level());
        let above = NodeKey { level, index: key.index.map(|k| k >> (level - key.level)) };
        let [before, after] = [&self.before, &self.after].map(|state| {
            let is_there = state.levels.get(above).is_some_and(|node| node.is_occupied);
            if is_there { state.levels.cells(state.map, store, key) } else { Ok(Cells::default()) }
        });
        let cells = compared(&before?, &after?);
        let head = Head {
            kind: 3,
            scale: Scale { least: 0.0, most: 255.0 },
            ..self.after.levels.head(key, Kind::Occupied)
        };
        Ok(Some(node_bytes::encode(&head, &cells)))
    }
}

/// Merges the voxels of both states, sorted.
fn compared(before: &Cells, after: &Cells) -> Cells {
    let (mut old, mut new) = (before.cells.iter().peekable(), after.cells.iter().peekable());
    let mut cells = Vec::new();
    loop {
        let (cell, value) = match (old.peek(), new.peek()) {
            (None, None) => break,
            (Some(a), Some(b)) if a.place == b.place => {
                old.next();
                (new.next(), 3)
            }
            (Some(a), Some(b)) if a.place < b.place => (old.next(), 2),
            (Some(_), None) => (old.next(), 2),
            _ => (new.next(), 1),
        };
        cells.extend(cell.map(|cell| Cell { value, ..*cell }));
    }
    Cells { cells, last_scan: before.last_scan.max(after.last_scan) }
}

impl<V: MapView> TilesetNodes for Difference<'_, V> {
    fn tops(&self) -> Vec<NodeKey> {
        // The coarsest nodes of the two states may have different levels. Return all at the coarser level.
        let (before, after) = (self.before.tops(), self.after.tops());
        let level = before.iter().chain(&after).map(|key| key.level).max().unwrap_or(0);
        let lifted = before.into_iter().chain(after).map(|mut key| {
            while key.level < level {
                key = key.parent();
            }
            key
        });
        lifted.collect::<BTreeSet<_>>().into_iter().collect()
    }

    fn version(&self, key: NodeKey) -> Option<u64> {
        match (self.before.version(key), self.after.version(key)) {
            (None, None) => None,
            (before, after) => Some(before.unwrap_or(1).rotate_left(1) ^ after.unwrap_or(2)),
        }
    }

    fn is_occupied(&self, key: NodeKey) -> bool {
        self.before.is_occupied(key) || self.after.is_occupied(key)
    }

    fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb {
        let has = |state: &LevelsOf<'_, V>| state.version(key).is_some();
        match (has(&self.before), has(&self.after)) {
            (true, false) => self.before.bounds_m(store, key),
            (false, true) => self.after.bounds_m(store, key),
            _ => {
                let (a, b) = (self.before.bounds_m(store, key), self.after.bounds_m(store, key));
                Aabb {
                    min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
                    max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
                }
            }
        }
    }

    fn corner_m(&self, key: NodeKey) -> Point {
        self.after.corner_m(key)
    }

    fn voxel_edge_m(&self, level: u8) -> f64 {
        self.after.voxel_edge_m(level)
    }

    fn tile_level(&self) -> u8 {
        self.after.tile_level()
    }

    fn within_tile(&self, store: &NodeStore, key: NodeKey) -> Result<BTreeSet<NodeKey>> {
        let mut blocks = self.before.within_tile(store, key)?;
        blocks.append(&mut self.after.within_tile(store, key)?);
        Ok(blocks)
    }
}
