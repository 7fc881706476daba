use crate::config::MapConfig;
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::persistence::{TileSaver, config_from, copy_tile, new_map_id, new_metadata};
use crate::space::TileIndex;
use crate::store::{CatalogEntry, Disk, MapPath, Metadata, ScanArchive, StagedMap, TileVersion, id_from_hex};
use crate::tile::Table;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Writer of a new map from the tables of its tiles, one at a time. Memory: one table, and about 200 bytes per tile.
///
/// Until [`MapWriter::finish`] the map is in `MAP.unfinished`, next to its final path, so no command opens an
/// incomplete map. Dropping the writer removes that folder. If the process is killed, the folder is removed by the next
/// attempt to create the map.
#[derive(Debug)]
pub struct MapWriter {
    map: StagedMap,
    saver: TileSaver,
    config: MapConfig,
    metadata: Metadata,
    scan_number: u64,
    last: Option<TileIndex>,
    /// Number of tiles written since the last commit.
    uncommitted: usize,
    written: WrittenMap,
}

/// Result of writing a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct WrittenMap {
    /// Number of tiles with an observed voxel.
    pub tiles: u64,
    /// Number of observed voxels.
    pub voxels: u64,
    /// Number of occupied voxels.
    pub occupied: u64,
    /// Bytes of the files of tables.
    pub table_bytes: u64,
    /// Bytes of the files of octrees.
    pub octree_bytes: u64,
}

impl WrittenMap {
    pub(super) fn add(&mut self, version: TileVersion) {
        self.tiles += 1;
        self.voxels += version.voxels;
        self.occupied += version.occupied;
        self.table_bytes += version.table.bytes;
        self.octree_bytes += version.octree.bytes;
    }
}

/// Number of tiles per commit. Commits of the unfinished map are not visible. They limit the number of files to sync at
/// the end, and start disk writes early.
const COMMIT_TILES: usize = 256;

impl MapWriter {
    /// Begins an empty map with a new id and without scans, in a folder that must be missing or empty.
    ///
    /// # Errors
    ///
    /// An invalid configuration, a folder with other content, another process that creates the same map, or an I/O
    /// error.
    pub fn create(folder: impl Into<MapPath>, config: &MapConfig) -> Result<Self> {
        let (disk, folder) = folder.into().into_parts();
        let folder = &*folder;
        let config = config.clone().validated()?;
        Self::create_as(disk, folder, new_metadata(&config, new_map_id(), &[]))
    }

    /// Begins a map with the parameters, id, number of scans and inputs in `metadata`. Tiles, bounds and flush numbers
    /// in `metadata` are ignored.
    ///
    /// # Errors
    ///
    /// As for [`MapWriter::create`], and metadata of the original format, which is incomplete.
    pub fn create_as(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata) -> Result<Self> {
        let mut metadata = metadata;
        if let Some(ext) = &mut metadata.ext {
            // `keep_scans_of` copies scans.
            ext.keeps_scans = false;
        }
        let config = config_from(&metadata, folder)?;
        let ext = metadata.ext.as_ref();
        let Some((map_id, ext)) = ext.and_then(|ext| Some((id_from_hex(&ext.map_id)?, ext))) else {
            let reason = "the original format lacks the id and the parameters of a new map";
            return Err(Error::argument("metadata", reason));
        };
        let scan_number = ext.scan_number;
        let map = StagedMap::begin(disk, folder, metadata.clone(), map_id)?;
        let (last, uncommitted, written) = Default::default();
        let saver = TileSaver::new(&config);
        Ok(Self { map, saver, config, metadata, scan_number, last, uncommitted, written })
    }

    /// The map's configuration.
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// Copies the list of scans of another map.
    ///
    /// # Errors
    ///
    /// A damaged or unreadable list.
    pub(super) fn take_scans_of(&mut self, map: &MapReader) -> Result<()> {
        let store = self.map.store();
        map.scans()?.into_iter().for_each(|scan| store.note_scan(scan));
        Ok(())
    }

    /// Copies the scans that another map keeps, with their numbers, and the numbers of removed ones. Must be called before
    /// tiles are added.
    ///
    /// # Errors
    ///
    /// A damaged or unreadable scan, or an I/O error.
    pub(super) fn keep_scans_of(&mut self, map: &MapReader) -> Result<()> {
        let mut records = map.kept_records()?;
        self.keep_scans(|archive| {
            let mut entry = map.explained(records.next_entry())?;
            if let Some(CatalogEntry::Kept(scan)) = &mut entry {
                for place in scan.places_mut() {
                    *place = map.explained(archive.copy_from(&*map.disk(), map.store().layout(), *place))?;
                }
            }
            Ok(entry)
        })
    }

    /// Keeps scans from now on: those that `next` copies to the archive, and whose entries it returns, until it returns
    /// `None`. Must be called before tiles are added.
    ///
    /// # Errors
    ///
    /// Those of `next`, or an I/O error.
    pub(super) fn keep_scans(
        &mut self,
        mut next: impl FnMut(&mut ScanArchive) -> Result<Option<CatalogEntry>>,
    ) -> Result<()> {
        if let Some(ext) = &mut self.metadata.ext {
            ext.keeps_scans = true;
        }
        let archive = self.map.store().archive_mut();
        archive.begin();
        archive.begin_catalog()?;
        let mut last = 0;
        while let Some(entry) = next(archive)? {
            archive.put(&entry)?;
            last = entry.numbers().map_or(last, |(_, last)| last);
        }
        self.scan_number = self.scan_number.max(last);
        self.commit()
    }

    /// Adds a tile. A tile without voxels is ignored.
    ///
    /// # Errors
    ///
    /// A tile that does not follow the previous one, by x, then y, then z, or an I/O error. The map cannot be finished
    /// after an I/O error.
    pub fn put(&mut self, tile: TileIndex, table: &Table) -> Result<()> {
        self.put_as_of(tile, table, self.scan_number)
    }

    /// Like [`MapWriter::put`], with the scan number that is recorded in the tile's file.
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

    /// Like [`MapWriter::put_as_of`], for a tile of another map with the same parameters and storage, and without a
    /// writer. The copied bytes are compared with that map's log, but not decoded.
    pub(super) fn copy_as_of(&mut self, tile: TileIndex, map: &MapReader, scan_number: u64) -> Result<()> {
        self.check_order(tile)?;
        let store = self.map.store();
        let version = copy_tile(map.store(), &store.writer()?, tile, scan_number)?;
        store.tiles_mut().note_next(tile, version);
        self.added(tile, version)
    }

    /// Adds the tiles of other maps of the same id, parameters and storage by hard links
    /// ([`LinkedTiles`](crate::store::LinkedTiles)). This map must not have tiles.
    ///
    /// # Errors
    ///
    /// A map that cannot be opened, a tile in two of them, a damaged tile, or an I/O error.
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
                    let reason = format!(
                        "it contains {tile}, and so does another shard; create shards of disjoint regions"
                    );
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
            Some(last) => {
                Err(Error::argument("tile", format!("{tile} does not follow {last} in tile order")))
            }
            None => Ok(()),
        }
    }

    fn added(&mut self, last: TileIndex, version: TileVersion) -> Result<()> {
        self.last = Some(last);
        self.written.add(version);
        self.uncommitted += 1;
        if self.uncommitted == COMMIT_TILES { self.commit() } else { Ok(()) }
    }

    /// Completes the map and renames it to its final path.
    ///
    /// # Errors
    ///
    /// An I/O error. Then there is no map, unless only the last step failed: the sync of the folder that contains the
    /// map.
    pub fn finish(mut self) -> Result<WrittenMap> {
        self.commit()?;
        // Finish the commit now, so that the map has no remaining work when it becomes visible.
        self.map.store().checkpoint()?;
        self.map.finish()?;
        Ok(self.written)
    }

    fn commit(&mut self) -> Result<()> {
        self.uncommitted = 0;
        self.map.store().commit(self.metadata.clone(), self.scan_number)
    }
}
