use crate::error::Result;
use crate::persistence::{CompactTile, Packer};
use crate::space::TileIndex;
use crate::tile::Tile;
use lru::LruCache;
use std::collections::BTreeMap;

/// Tiles in the compact form, which is compressed, oldest to newest: the tier between resident tiles and the disk.
#[derive(Debug)]
pub(super) struct CompactTiles {
    tiles: LruCache<TileIndex, Entry>,
    packer: Packer,
    bytes: usize,
    /// Dirty tiles that are not being saved, by [`Entry::number`]. A search in `tiles` would visit all clean tiles each
    /// time.
    to_save: BTreeMap<u64, TileIndex>,
    clean: BTreeMap<u64, TileIndex>,
    dirty: usize,
    /// Number of tiles inserted so far.
    puts: u64,
}

#[derive(Debug)]
struct Entry {
    tile: CompactTile,
    is_dirty: bool,
    is_saving: bool,
    /// Value of `puts` when the tile was inserted.
    number: u64,
}

/// Bytes of memory of a tile in addition to its encoding.
const SLOT_BYTES: usize = size_of::<(TileIndex, Entry)>() + 128;

impl Default for CompactTiles {
    fn default() -> Self {
        let (tiles, packer) = (LruCache::unbounded(), Packer::default());
        Self { tiles, packer, bytes: 0, to_save: BTreeMap::new(), clean: BTreeMap::new(), dirty: 0, puts: 0 }
    }
}

impl CompactTiles {
    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn dirty(&self) -> usize {
        self.dirty
    }

    pub(super) fn contains(&self, index: TileIndex) -> bool {
        self.tiles.contains(&index)
    }

    pub(super) fn get(&self, index: TileIndex) -> Option<&CompactTile> {
        self.tiles.peek(&index).map(|entry| &entry.tile)
    }

    pub(super) fn is_dirty(&self, index: TileIndex) -> bool {
        self.tiles.peek(&index).is_some_and(|entry| entry.is_dirty)
    }

    /// The tiles, newest first.
    pub(super) fn indices(&self) -> impl DoubleEndedIterator<Item = TileIndex> {
        self.tiles.iter().map(|(&index, _)| index)
    }

    /// Encodes a tile and inserts it as the newest. See [`CompactTile::encode`] for `occupied_from`.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted.
    pub(super) fn encode(&mut self, tile: &Tile, occupied_from: Option<f64>) -> Result<()> {
        let compact = CompactTile::encode(&mut self.packer, tile, occupied_from)?;
        self.put(tile.index(), compact, tile.is_dirty());
        Ok(())
    }

    /// Replaces the encoding of a tile that is here and not being saved, without changing its position in the order.
    /// Returns whether there was such a tile.
    ///
    /// # Errors
    ///
    /// Fails if memory is exhausted.
    pub(super) fn renew(&mut self, tile: &Tile, occupied_from: Option<f64>) -> Result<bool> {
        let index = tile.index();
        if !self.needs_save(index) {
            return Ok(false);
        }
        let compact = CompactTile::encode(&mut self.packer, tile, occupied_from)?;
        let Some(entry) = self.tiles.peek_mut(&index) else { return Ok(false) };
        self.bytes -= entry.bytes();
        entry.tile = compact;
        self.bytes += entry.bytes();
        Ok(true)
    }

    fn put(&mut self, index: TileIndex, tile: CompactTile, is_dirty: bool) {
        self.remove(index);
        let entry = Entry { tile, is_dirty, is_saving: false, number: self.puts };
        self.puts += 1;
        self.bytes += entry.bytes();
        if is_dirty {
            self.dirty += 1;
            self.to_save.insert(entry.number, index);
        } else {
            self.clean.insert(entry.number, index);
        }
        self.tiles.put(index, entry);
    }

    /// Removes a tile and returns whether it was present.
    pub(super) fn remove(&mut self, index: TileIndex) -> bool {
        let Some(removed) = self.tiles.pop(&index) else { return false };
        self.bytes -= removed.bytes();
        self.dirty -= usize::from(removed.is_dirty);
        self.to_save.remove(&removed.number);
        self.clean.remove(&removed.number);
        true
    }

    /// The dirty tiles that are not being saved, oldest first.
    pub(super) fn unsaved(&self) -> Vec<TileIndex> {
        self.to_save.values().copied().collect()
    }

    /// The dirty tiles that are being saved, in no particular order.
    pub(super) fn saving(&self) -> impl Iterator<Item = (TileIndex, CompactTile)> {
        let saving = self.tiles.iter().filter(|(_, entry)| entry.is_dirty && entry.is_saving);
        saving.map(|(&index, entry)| (index, entry.tile.clone()))
    }

    pub(super) fn oldest(&self) -> Option<TileIndex> {
        self.indices().next_back()
    }

    pub(super) fn oldest_clean(&self) -> Option<TileIndex> {
        self.clean.first_key_value().map(|(_, index)| *index)
    }

    /// The oldest dirty tile that is not being saved.
    pub(super) fn next_to_save(&self) -> Option<TileIndex> {
        self.to_save.first_key_value().map(|(_, index)| *index)
    }

    /// Returns whether a tile is dirty and not being saved.
    pub(super) fn needs_save(&self, index: TileIndex) -> bool {
        self.tiles.peek(&index).is_some_and(|entry| entry.is_dirty && !entry.is_saving)
    }

    /// Marks a tile as being saved and returns it.
    pub(super) fn begin_save(&mut self, index: TileIndex) -> Option<CompactTile> {
        let entry = self.tiles.peek_mut(&index)?;
        entry.is_saving = true;
        self.to_save.remove(&entry.number);
        Some(entry.tile.clone())
    }

    /// Marks a tile that is not being saved as clean.
    pub(super) fn note_on_disk(&mut self, index: TileIndex) {
        if let Some(entry) = self.tiles.peek_mut(&index).filter(|entry| entry.is_dirty && !entry.is_saving) {
            entry.is_dirty = false;
            self.dirty -= 1;
            self.to_save.remove(&entry.number);
            self.clean.insert(entry.number, index);
        }
    }

    /// Records the end of a save. Returns whether the tile here is still the saved version.
    pub(super) fn save_ended(&mut self, index: TileIndex, saved: &CompactTile, is_on_disk: bool) -> bool {
        let current = self.tiles.peek_mut(&index).filter(|entry| entry.tile.is_same(saved));
        let Some(entry) = current else { return false };
        entry.is_saving = false;
        if entry.is_dirty && is_on_disk {
            entry.is_dirty = false;
            self.dirty -= 1;
            self.clean.insert(entry.number, index);
        } else if entry.is_dirty {
            self.to_save.insert(entry.number, index);
        }
        true
    }

    pub(super) fn no_save_running(&mut self) {
        for (index, entry) in self.tiles.iter_mut().filter(|(_, entry)| entry.is_saving) {
            entry.is_saving = false;
            if entry.is_dirty {
                self.to_save.insert(entry.number, *index);
            }
        }
    }
}

impl Entry {
    fn bytes(&self) -> usize {
        SLOT_BYTES + self.tile.bytes().len()
    }
}
