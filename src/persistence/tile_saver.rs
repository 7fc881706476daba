//! Writes tiles to their files, which `load.rs` reads.

use super::compact_tile::CompactTile;
use super::packer::Packer;
use super::parameters::map_parameters;
use crate::config::{MapConfig, Storage};
use crate::error::Result;
use crate::space::{Grid, TileIndex};
use crate::store::{FileChecksum, TileFile, TileStore, TileVersion, TileWriter};
use crate::tile::format::{Trailer, write_compact_file, write_table};
use crate::tile::{Table, Tile};

/// Writer of tiles' files. Its buffers are reused.
#[derive(Debug)]
pub(crate) struct TileSaver {
    resolution_m: f64,
    /// Log-odds from which a voxel counts as occupied.
    threshold: f64,
    parameters: String,
    packer: Packer,
}

impl TileSaver {
    pub(crate) fn new(config: &MapConfig) -> Self {
        Self {
            resolution_m: config.grid.resolution_m(),
            threshold: config.occupied_log_odds(),
            parameters: map_parameters(config).to_text(),
            packer: Packer::default(),
        }
    }

    /// Writes the next version of a tile's files, and records it in the store.
    pub(crate) fn save(
        &mut self,
        store: &mut TileStore,
        tile: &Tile,
        scan_number: u64,
    ) -> Result<TileVersion> {
        let version = self.write(&store.writer()?, tile.index(), tile.table(), scan_number)?;
        store.tiles_mut().note_next(tile.index(), version);
        Ok(version)
    }

    /// Writes the next version of a tile's files. The caller must record it in the store.
    pub(crate) fn write(
        &mut self,
        writer: &TileWriter,
        index: TileIndex,
        table: &Table,
        scan_number: u64,
    ) -> Result<TileVersion> {
        match writer.storage() {
            Storage::OctoMap => {
                let layers = self.packer.pack_layers(table)?;
                self.write_octomap(writer, index, (table, &layers), scan_number)
            }
            Storage::Compact => {
                let (compact, layers) = (self.packer.pack(table)?, self.packer.pack_layers(table)?);
                let (voxels, occupied) = (table.len() as u64, table.count_from(self.threshold) as u64);
                self.write_encoded(writer, index, (&compact, &layers), [voxels, occupied], scan_number)
            }
        }
    }

    /// Like [`TileSaver::write`], for a tile in the compact form.
    pub(crate) fn write_compact(
        &self,
        writer: &TileWriter,
        grid: &Grid,
        index: TileIndex,
        tile: &CompactTile,
        scan_number: u64,
    ) -> Result<TileVersion> {
        match tile.occupied() {
            Some(occupied) => {
                self.write_encoded(writer, index, tile.parts(), [tile.voxels(), occupied], scan_number)
            }
            None => {
                let (_, layers) = tile.parts();
                self.write_octomap(writer, index, (&tile.decode(grid, index)?, layers), scan_number)
            }
        }
    }

    fn write_encoded(
        &self,
        writer: &TileWriter,
        index: TileIndex,
        (compact, layers): (&[u8], &[u8]),
        [voxels, occupied]: [u64; 2],
        scan_number: u64,
    ) -> Result<TileVersion> {
        let front = self.trailer(writer, index, scan_number, FileChecksum::default());
        let table = writer.write_next(index, TileFile::Table, |mut out| {
            write_compact_file(compact, layers, front, &mut out)
        })?;
        Ok(TileVersion { scan_number, table, octree: FileChecksum::default(), voxels, occupied })
    }

    /// Like [`TileSaver::write`], for a map with the original storage.
    fn write_octomap(
        &self,
        writer: &TileWriter,
        index: TileIndex,
        (table, layers): (&Table, &[u8]),
        scan_number: u64,
    ) -> Result<TileVersion> {
        let (voxels, occupied) = (table.len() as u64, table.count_from(self.threshold) as u64);
        let octree = writer.write_next(index, TileFile::Octree, |mut out| {
            table.write_bt(self.resolution_m, self.threshold as f32, &mut out)
        })?;
        let trailer = self.trailer(writer, index, scan_number, octree);
        let table = writer.write_next(index, TileFile::Table, |mut out| {
            write_table(table, layers, trailer, &mut out).map(drop)
        })?;
        Ok(TileVersion { scan_number, table, octree, voxels, occupied })
    }

    fn trailer(
        &self,
        writer: &TileWriter,
        tile: TileIndex,
        scan_number: u64,
        octree: FileChecksum,
    ) -> Trailer {
        let (map_id, parameters) = (writer.map_id(), self.parameters.clone());
        let (octree_crc, octree_bytes) = (octree.crc, octree.bytes);
        Trailer { map_id, tile, scan_number, table_crc: 0, octree_crc, octree_bytes, parameters }
    }
}
