use super::bucket::{Bucket, missing_object};
use super::manifest::{Files, Manifest, StoredFile, page_from_bytes};
use super::object_name::ObjectName;
use lru::LruCache;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};
use voxtile::space::TileIndex;
use voxtile::store::tile_of_folder;

/// Files of a map in a bucket, by path. The most recently used pages of tiles are cached.
#[derive(Debug)]
pub(super) struct FileList {
    bucket: Bucket,
    files: Files,
    page_names: BTreeMap<String, ObjectName>,
    pages: Mutex<LruCache<String, Arc<Files>>>,
}

/// Maximum number of cached pages, of a few hundred kilobytes each.
const MAX_PAGES: NonZeroUsize = NonZeroUsize::new(64).unwrap();

impl FileList {
    pub(super) fn new(bucket: Bucket, manifest: Manifest) -> Self {
        let Manifest { files, pages, .. } = manifest;
        Self { bucket, files, page_names: pages, pages: Mutex::new(LruCache::new(MAX_PAGES)) }
    }

    /// Returns a file; `None` if the map has no file with this path.
    pub(super) fn file(&self, path: &str) -> io::Result<Option<StoredFile>> {
        match path.split_once('/').and_then(|(folder, _)| tile_of_folder(folder)) {
            Some(tile) => Ok(self.page_of(tile)?.and_then(|page| page.get(path).cloned())),
            None => Ok(self.files.get(path).cloned()),
        }
    }

    /// Returns the names in a folder; "" is the folder of the map. The result is empty for a folder that does not
    /// exist.
    pub(super) fn names_in(&self, folder: &str) -> io::Result<BTreeSet<String>> {
        let below = |files: &Files| -> Vec<String> {
            let paths = files.keys().filter_map(|path| match folder {
                "" => Some(path.as_str()),
                _ => path.strip_prefix(folder)?.strip_prefix('/'),
            });
            paths.map(|rest| rest.split('/').next().unwrap_or(rest).to_owned()).collect()
        };
        let mut names = BTreeSet::from_iter(below(&self.files));
        match tile_of_folder(folder) {
            Some(tile) => names.extend(self.page_of(tile)?.iter().flat_map(|page| below(page))),
            None if folder.is_empty() => {
                for name in self.page_names.keys() {
                    names.extend(self.page(name)?.iter().flat_map(|page| below(page)));
                }
            }
            None => {}
        }
        Ok(names)
    }

    /// Returns the names of all pages.
    pub(super) fn page_names(&self) -> impl Iterator<Item = &str> {
        self.page_names.keys().map(String::as_str)
    }

    /// Returns whether a page is stored as this object.
    pub(super) fn has_page(&self, name: &str, object: ObjectName) -> bool {
        self.page_names.get(name) == Some(&object)
    }

    /// Returns the files that belong to no tile.
    pub(super) fn own_files(&self) -> &Files {
        &self.files
    }

    /// Returns whether a path is of a file that belongs to no tile.
    pub(super) fn is_own(&self, path: &str) -> bool {
        self.files.contains_key(path)
    }

    fn page_of(&self, tile: TileIndex) -> io::Result<Option<Arc<Files>>> {
        self.page(&Manifest::page_of(tile))
    }

    /// Returns a page; `None` if the map has no page with this name.
    pub(super) fn page(&self, name: &str) -> io::Result<Option<Arc<Files>>> {
        let Some(object) = self.page_names.get(name) else { return Ok(None) };
        if let Some(page) = self.pages.lock().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(Some(page.clone()));
        }
        let content = self.bucket.fetch_list(*object).map_err(missing_object)?;
        let page = page_from_bytes(name, &content).map_err(|reason| {
            io::Error::new(io::ErrorKind::InvalidData, format!("object {}: {reason}", object.key()))
        })?;
        let page = Arc::new(page);
        let mut pages = self.pages.lock().unwrap_or_else(PoisonError::into_inner);
        pages.put(name.to_owned(), page.clone());
        Ok(Some(page))
    }
}
