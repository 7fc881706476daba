use super::buffered_updates::{BufferedUpdates, Spilled};
use super::tile_disk::TileDisk;
use crate::error::Result;
use crate::mapper::statistics::MapStatistics;
use crate::scan::{PackedUpdates, TileUpdates};
use crate::sensor::SensorModel;
use crate::space::{TileIndex, TileTable};
use crate::tile::Tile;

/// Updates of tiles that are not resident, until these come in: in memory, spilled to files where memory is short, and
/// those of the scan that is being inserted staged in files until it is accepted.
#[derive(Debug, Default)]
pub(super) struct WriteBuffer {
    buffered: BufferedUpdates,
    /// The spill files with the parts of the scan that is being inserted. They count once it is accepted.
    staged: TileTable<Spilled>,
}

impl WriteBuffer {
    /// Bytes of memory that a tile with a spill file takes, about.
    pub(super) const BYTES_OF_FILE: usize = BufferedUpdates::BYTES_OF_FILE;

    /// Adds updates of a tile, in memory.
    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        self.buffered.push(tile, updates);
    }

    /// Whether a tile has updates here.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.buffered.contains(tile)
    }

    /// The tiles with updates here, in no particular order.
    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.buffered.tiles()
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.buffered.bytes()
    }

    /// Number of tiles with a spill file.
    pub(super) fn spill_files(&self) -> usize {
        self.buffered.files()
    }

    /// Bytes of a tile's updates, in memory and in its spill file.
    pub(super) fn bytes_of(&self, tile: TileIndex) -> u64 {
        let in_memory = self.buffered.in_memory(tile).map_or(0, |updates| updates.as_bytes().len());
        self.buffered.spilled(tile).file.bytes + in_memory as u64
    }

    /// See [`BufferedUpdates::heaviest`].
    pub(super) fn heaviest(&self, bytes: usize) -> Vec<TileIndex> {
        self.buffered.heaviest(bytes)
    }

    /// See [`BufferedUpdates::longest_files`].
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        self.buffered.longest_files(bytes, count)
    }

    /// Applies a tile's updates to it. They stay here until [`WriteBuffer::forget`].
    ///
    /// # Errors
    ///
    /// A spill file that cannot be read.
    pub(super) fn apply_to(&self, tile: &mut Tile, model: &SensorModel, disk: &mut TileDisk) -> Result<()> {
        let index = tile.index();
        let Spilled { file, .. } = self.buffered.spilled(index);
        if file.bytes > 0 {
            disk.read_spill(index, file, |updates| tile.apply(model, &updates))?;
        }
        let in_memory = self.buffered.in_memory(index).into_iter().flat_map(PackedUpdates::iter);
        in_memory.for_each(|updates| tile.apply(model, &updates));
        Ok(())
    }

    /// Forgets a tile's updates: they were applied, or nobody wants them any more.
    pub(super) fn forget(&mut self, index: TileIndex, disk: &TileDisk) {
        if self.buffered.remove(index).file.bytes > 0 {
            disk.remove_spill(index);
        }
    }

    /// Moves a tile's updates from memory to the end of its spill file.
    ///
    /// # Errors
    ///
    /// A disk that refuses; the updates stay in memory.
    pub(super) fn spill(&mut self, index: TileIndex, disk: &mut TileDisk) -> Result<()> {
        if let Some(updates) = self.buffered.in_memory(index).filter(|updates| !updates.is_empty()) {
            let spilled = append(index, self.buffered.spilled(index), updates, disk)?;
            self.buffered.note_spilled(index, spilled);
        }
        Ok(())
    }

    /// Puts a part of a scan that is not accepted yet into a tile's spill file, behind the tile's other updates.
    ///
    /// # Errors
    ///
    /// A disk that refuses; what was staged before stays.
    pub(super) fn stage(
        &mut self,
        index: TileIndex,
        updates: &PackedUpdates,
        disk: &mut TileDisk,
    ) -> Result<()> {
        self.spill(index, disk)?;
        let before = self.staged.get(index).unwrap_or_else(|| self.buffered.spilled(index));
        let spilled = append(index, before, updates, disk)?;
        self.staged.insert(index, spilled);
        Ok(())
    }

    /// Whether parts of the scan that is being inserted are staged for a tile.
    pub(super) fn is_staged(&self, tile: TileIndex) -> bool {
        self.staged.contains(tile)
    }

    /// The tiles with staged parts, in order.
    pub(super) fn staged_tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.staged.tiles()
    }

    /// Makes the staged parts count: their scan is accepted.
    pub(super) fn accept_staged(&mut self) {
        for (index, spilled) in std::mem::take(&mut self.staged).iter() {
            self.buffered.note_spilled(index, spilled);
        }
    }

    /// Takes the staged parts back out of the files: their scan was not accepted, and the next flush may need the
    /// space.
    pub(super) fn discard_staged(&mut self, disk: &TileDisk) {
        for index in std::mem::take(&mut self.staged).tiles() {
            disk.cut_spill(index, self.buffered.spilled(index).file);
        }
    }

    /// Adds the buffer's part of the statistics.
    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        statistics.pending_tiles = self.buffered.len() as u64;
        statistics.pending_updates = self.buffered.updates();
        statistics.pending_bytes = self.buffered.bytes() as u64;
        statistics.pending_file_bytes = self.buffered.file_bytes();
    }
}

fn append(
    index: TileIndex,
    before: Spilled,
    updates: &PackedUpdates,
    disk: &mut TileDisk,
) -> Result<Spilled> {
    let file = disk.spill(index, before.file, updates)?;
    Ok(Spilled { file, updates: before.updates + updates.len() as u64 })
}
