use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::tile::Tile;
use crate::tile::format::{CompactEffort, CompactWriter};
use lru::LruCache;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Tiles that nobody uses at the moment, in the compact form, in the order in which they were put here: between the tiles
/// in memory and those on disk.
#[derive(Debug)]
pub(super) struct ColdTiles {
    tiles: LruCache<TileIndex, ColdTile>,
    /// Made with the first tile, and kept: it takes longer to make than a small tile to pack.
    writer: Option<CompactWriter>,
    bytes: usize,
    /// The tiles that are not on disk as they are, nor on their way there, by when they were put here: looking for one from
    /// the oldest tile on would pass all that are on disk already, again and again.
    to_leave: BTreeMap<u64, TileIndex>,
    dirty: usize,
    /// How many tiles were ever put here.
    puts: u64,
}

/// A tile in the compact form.
#[derive(Clone, Debug)]
pub(super) struct ColdTile {
    pub(super) compact: Arc<[u8]>,
    pub(super) voxels: u64,
    /// Occupied voxels, where the tile will go to disk as it is.
    pub(super) occupied: Option<u64>,
    /// What the tile's table takes in memory, as it last was there.
    pub(super) table_bytes: usize,
    pub(super) is_dirty: bool,
    /// Whether it is on its way to disk.
    pub(super) is_leaving: bool,
    /// How many were put here before it.
    number: u64,
}

/// What a tile takes beside its bytes.
const SLOT_BYTES: usize = size_of::<(TileIndex, ColdTile)>() + 128;

impl Default for ColdTiles {
    fn default() -> Self {
        let (tiles, to_leave) = (LruCache::unbounded(), BTreeMap::new());
        Self { tiles, writer: None, bytes: 0, to_leave, dirty: 0, puts: 0 }
    }
}

impl ColdTiles {
    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Number of tiles that are not on disk as they are.
    pub(super) fn dirty(&self) -> usize {
        self.dirty
    }

    pub(super) fn contains(&self, index: TileIndex) -> bool {
        self.tiles.contains(&index)
    }

    pub(super) fn get(&self, index: TileIndex) -> Option<&ColdTile> {
        self.tiles.peek(&index)
    }

    /// The tiles, the one put here last first.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = (TileIndex, &ColdTile)> {
        self.tiles.iter().map(|(&index, tile)| (index, tile))
    }

    /// Puts a tile here in the compact form. If it is to go to disk as it is, the voxels are counted that are occupied, from
    /// these log-odds.
    ///
    /// # Errors
    ///
    /// Those of the packer, which has none but a lack of memory.
    pub(super) fn pack(&mut self, tile: &Tile, occupied_from: Option<f64>) -> Result<()> {
        let failed = |error| Error::io("memory".as_ref(), "pack a tile in", error);
        let writer = match &mut self.writer {
            Some(writer) => writer,
            none => none.insert(CompactWriter::new(CompactEffort::Fast).map_err(failed)?),
        };
        let (table, mut compact) = (tile.table(), Vec::new());
        writer.write(table, &mut compact).map_err(failed)?;
        let (voxels, table_bytes) = (table.len() as u64, table.bytes());
        let occupied = occupied_from.map(|log_odds| table.count_from(log_odds) as u64);
        let (compact, is_dirty) = (compact.into(), tile.is_dirty());
        let (is_leaving, number) = (false, self.puts);
        let cold = ColdTile { compact, voxels, occupied, table_bytes, is_dirty, is_leaving, number };
        self.put(tile.index(), cold);
        Ok(())
    }

    fn put(&mut self, index: TileIndex, tile: ColdTile) {
        self.remove(index);
        self.puts += 1;
        self.bytes += tile.bytes();
        if tile.is_dirty {
            self.dirty += 1;
            self.to_leave.insert(tile.number, index);
        }
        self.tiles.put(index, tile);
    }

    pub(super) fn remove(&mut self, index: TileIndex) -> Option<ColdTile> {
        let removed = self.tiles.pop(&index)?;
        self.bytes -= removed.bytes();
        self.dirty -= usize::from(removed.is_dirty);
        self.to_leave.remove(&removed.number);
        Some(removed)
    }

    /// The tiles that are not on disk as they are, in no particular order.
    pub(super) fn dirty_tiles(&self) -> Vec<TileIndex> {
        self.iter().filter(|(_, tile)| tile.is_dirty).map(|(index, _)| index).collect()
    }

    /// The tile that was put here the longest ago.
    pub(super) fn oldest(&self) -> Option<TileIndex> {
        self.iter().next_back().map(|(index, _)| index)
    }

    /// The oldest tile that is not on disk as it is, nor on its way there.
    pub(super) fn next_to_leave(&self) -> Option<TileIndex> {
        self.to_leave.first_key_value().map(|(_, index)| *index)
    }

    /// Notes that a tile is on its way to disk.
    pub(super) fn leaves(&mut self, index: TileIndex) {
        if let Some(tile) = self.tiles.peek_mut(&index) {
            tile.is_leaving = true;
            self.to_leave.remove(&tile.number);
        }
    }

    /// Notes that the way of a tile to disk has ended. Returns whether what is here still is what was sent.
    pub(super) fn has_left(&mut self, index: TileIndex, compact: &Arc<[u8]>, is_on_disk: bool) -> bool {
        let sent = self.tiles.peek_mut(&index).filter(|tile| Arc::ptr_eq(&tile.compact, compact));
        let Some(tile) = sent else { return false };
        tile.is_leaving = false;
        if tile.is_dirty && is_on_disk {
            tile.is_dirty = false;
            self.dirty -= 1;
        } else if tile.is_dirty {
            self.to_leave.insert(tile.number, index);
        }
        true
    }

    /// Notes that no tile is on its way to disk.
    pub(super) fn none_leaves(&mut self) {
        for (index, tile) in self.tiles.iter_mut().filter(|(_, tile)| tile.is_leaving) {
            tile.is_leaving = false;
            if tile.is_dirty {
                self.to_leave.insert(tile.number, *index);
            }
        }
    }
}

impl ColdTile {
    /// Bytes of memory that it takes to go to disk, beside its own.
    pub(super) fn bytes_to_save(&self) -> usize {
        if self.occupied.is_some() { 0 } else { self.table_bytes }
    }

    fn bytes(&self) -> usize {
        SLOT_BYTES + self.compact.len()
    }
}
