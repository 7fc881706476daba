use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::persistence::{TileSaver, config_from, copy_tile, new_map_id, new_metadata};
use crate::space::TileIndex;
use crate::store::{Disk, MapPath, Metadata, StagedMap, TileVersion, id_from_hex};
use crate::tile::Table;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Makes a new map from the tables of its tiles, one at a time: in memory are the table at hand and some 200 bytes a
/// tile.
///
/// Until [`MapWriter::finish`] the map lies beside its place, as `MAP.unfinished`, where no command takes it for the
/// one that was asked for. A process that is killed leaves that folder behind, and the next attempt to make the same
/// map removes it; so does a writer that is dropped.
#[derive(Debug)]
pub struct MapWriter {
    map: StagedMap,
    saver: TileSaver,
    config: MapConfig,
    metadata: Metadata,
    scan_number: u64,
    last: Option<TileIndex>,
    /// Tiles put since the last commit.
    uncommitted: usize,
    written: WrittenMap,
}

/// What a [`MapWriter`] wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct WrittenMap {
    /// Tiles with an observed voxel.
    pub tiles: u64,
    /// Observed voxels.
    pub voxels: u64,
    /// Occupied voxels.
    pub occupied: u64,
    /// Bytes of the tables' files.
    pub table_bytes: u64,
    /// Bytes of the octrees' files.
    pub octree_bytes: u64,
}

impl WrittenMap {
    /// Adds a tile.
    pub(super) fn add(&mut self, version: TileVersion) {
        self.tiles += 1;
        self.voxels += version.voxels;
        self.occupied += version.occupied;
        self.table_bytes += version.table.bytes;
        self.octree_bytes += version.octree.bytes;
    }
}

/// Tiles that are made durable together. A commit of the unfinished map means nothing to anybody; it keeps the list of
/// files to sync short, and the disk at work from the beginning.
const COMMIT_TILES: usize = 256;

impl MapWriter {
    /// Begins an empty map with an id of its own, without scans, in a folder that does not exist yet or is empty.
    ///
    /// # Errors
    ///
    /// A wrong configuration, a folder with other content, another process that makes the same map, a disk that
    /// refuses.
    pub fn create(folder: impl Into<MapPath>, config: &MapConfig) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let config = config.clone().validated()?;
        Self::create_as(disk, folder, new_metadata(&config, new_map_id(), &[]))
    }

    /// Begins a map that says of itself what `metadata` says: parameters, id, number of scans, input. Tiles, bounds and
    /// number of flushes are its own.
    ///
    /// # Errors
    ///
    /// As for [`MapWriter::create`], and metadata of the original format, which does not say it all.
    pub fn create_as(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata) -> Result<Self> {
        let mut metadata = metadata;
        if let Some(ext) = &mut metadata.ext {
            // Of the map that it is made of, whose scans are not copied.
            ext.keeps_scans = false;
        }
        let config = config_from(&metadata, folder)?;
        let ext = metadata.ext.as_ref();
        let Some((map_id, ext)) = ext.and_then(|ext| Some((id_from_hex(&ext.map_id)?, ext))) else {
            let reason = "without an id and parameters of voxtile's own no map can be made";
            return Err(Error::argument("metadata", reason));
        };
        let scan_number = ext.scan_number;
        let map = StagedMap::begin(disk, folder, metadata.clone(), map_id)?;
        let (last, uncommitted, written) = Default::default();
        let saver = TileSaver::new(&config);
        Ok(Self { map, saver, config, metadata, scan_number, last, uncommitted, written })
    }

    /// How the map is made.
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// Records the scans that the map is said to consist of.
    ///
    /// # Errors
    ///
    /// A list that is damaged or cannot be read.
    pub(super) fn take_scans_of(&mut self, map: &MapReader) -> Result<()> {
        let store = self.map.store();
        map.scans()?.into_iter().for_each(|scan| store.note_scan(scan));
        Ok(())
    }

    /// Adds a tile. One without voxels is left out, for a map has none.
    ///
    /// # Errors
    ///
    /// A tile that does not come after the one before it, by x, then y, then z; a disk that refuses: the map cannot be
    /// finished then.
    pub fn put(&mut self, tile: TileIndex, table: &Table) -> Result<()> {
        self.put_as_of(tile, table, self.scan_number)
    }

    /// The same for a tile whose file is to say that it was written after another scan than the map's last.
    ///
    /// # Errors
    ///
    /// As for [`MapWriter::put`].
    pub fn put_as_of(&mut self, tile: TileIndex, table: &Table, scan_number: u64) -> Result<()> {
        self.check_order(tile)?;
        if table.is_empty() {
            return Ok(());
        }
        let store = self.map.store();
        let version = self.saver.write(&store.writer()?, tile, table, scan_number)?;
        store.tiles_mut().note_next(tile, version);
        self.added(tile, version)
    }

    /// The same for a tile of another map of the same parameters and storage, which nobody writes to: its bytes are
    /// compared with that map's log, and no voxel is looked at.
    pub(super) fn copy_as_of(&mut self, tile: TileIndex, map: &MapReader, scan_number: u64) -> Result<()> {
        self.check_order(tile)?;
        let store = self.map.store();
        let version = copy_tile(map.store(), &store.writer()?, tile, scan_number)?;
        store.tiles_mut().note_next(tile, version);
        self.added(tile, version)
    }

    /// Adds the tiles of other maps of the same id, parameters and storage by other names for their files
    /// ([`LinkedTiles`](crate::store::LinkedTiles)), to a map without tiles.
    ///
    /// # Errors
    ///
    /// A map that cannot be opened, a tile that is in two of them, a damaged one, a disk that refuses.
    pub(super) fn link_all(
        &mut self,
        maps: impl Iterator<Item = Result<MapReader>>,
        mut progress: impl FnMut(),
    ) -> Result<()> {
        let mut linked = self.map.store().link_tiles();
        for map in maps {
            let map = map?;
            for tile in map.tile_indices() {
                if linked.contains(tile) {
                    let reason =
                        format!("it has {tile}, and another piece has it, too; make pieces of other regions");
                    return Err(Error::argument(map.folder().display().to_string(), reason));
                }
                self.written.add(linked.link(map.store(), tile)?);
                progress();
            }
        }
        linked.commit(self.metadata.clone())
    }

    fn check_order(&self, tile: TileIndex) -> Result<()> {
        match self.last.filter(|&last| last >= tile) {
            Some(last) => Err(Error::argument("tile", format!("{tile} does not come after {last}"))),
            None => Ok(()),
        }
    }

    fn added(&mut self, last: TileIndex, version: TileVersion) -> Result<()> {
        self.last = Some(last);
        self.written.add(version);
        self.uncommitted += 1;
        if self.uncommitted == COMMIT_TILES { self.commit() } else { Ok(()) }
    }

    /// Makes the map whole and gives it its name.
    ///
    /// # Errors
    ///
    /// A disk that refuses: there is no map then, unless it was the name of the finished one that could not be made
    /// durable.
    pub fn finish(mut self) -> Result<WrittenMap> {
        self.commit()?;
        // What a commit may leave to the next opening of the map is not left here: nobody else is to see it.
        self.map.store().checkpoint()?;
        self.map.finish()?;
        Ok(self.written)
    }

    fn commit(&mut self) -> Result<()> {
        self.uncommitted = 0;
        self.map.store().commit(self.metadata.clone(), self.scan_number)
    }
}
