use super::bucket::{Bucket, missing_object};
use super::file_list::FileList;
use super::manifest::{PART_BYTES, StoredFile};
use super::part_cache::PartCache;
use super::part_reader::PartReader;
use object_store::UpdateVersion;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::scratch::Scratch;
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, FsDisk, MapPath, ReaderWatch};
use voxtile::{Error, Result};

/// A map in a bucket as a disk. The map is read-only, and is that of the last push at the time it was opened. All other
/// paths are files of this machine, so that an operation can write a new map.
///
/// While a reader visits tiles, the next tiles are prefetched, several at a time.
#[derive(Debug)]
pub struct BucketDisk {
    bucket: Bucket,
    /// Prefix of every path.
    root: PathBuf,
    list: FileList,
    /// Version of the manifest.
    version: UpdateVersion,
    parts: Arc<PartCache>,
}

/// Number of files that a reader prefetches.
const FILES_AHEAD: usize = 16;

/// Maximum size of prefetched files, and of parts that several readers use, in bytes: the current and the next part of
/// points and of their marks.
const CACHED_BYTES: u64 = 4 * PART_BYTES;

impl BucketDisk {
    /// Opens the map in a bucket, and reads its manifest.
    ///
    /// # Errors
    ///
    /// [`Error::NoMap`] if there is no map; a store that refuses the request.
    pub fn open(bucket: Bucket) -> Result<Self> {
        let found = bucket.manifest()?.ok_or_else(|| Error::NoMap { path: bucket.path().to_owned() })?;
        Ok(Self {
            root: bucket.path().to_owned(),
            list: FileList::new(bucket.clone(), found.manifest),
            parts: Arc::new(PartCache::new(bucket.clone(), CACHED_BYTES)),
            bucket,
            version: found.version,
        })
    }

    /// Returns the map's path, for [`MapReader`](voxtile::MapReader) and other functions that take the path of a map.
    pub fn into_map_path(self) -> MapPath {
        let root = self.root.clone();
        MapPath::on(Arc::new(self), root)
    }

    /// Returns the path of a file inside the map, with `/` between names; `None` for a file of this machine.
    fn path_in_map(&self, path: &Path) -> Option<String> {
        let names = path.strip_prefix(&self.root).ok()?.iter();
        Some(names.map(|name| name.to_string_lossy()).collect::<Vec<_>>().join("/"))
    }

    /// Returns the disk of this machine to change a file.
    ///
    /// # Errors
    ///
    /// A path inside the map.
    fn writable(&self, path: &Path) -> io::Result<FsDisk> {
        match path.starts_with(&self.root) {
            false => Ok(FsDisk),
            true => {
                let reason =
                    "a map in a bucket is read-only; `voxtile pull` it, change it, `voxtile push` it";
                Err(io::Error::new(io::ErrorKind::ReadOnlyFilesystem, reason))
            }
        }
    }

    fn open_from(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let Some(name) = self.path_in_map(path) else { return FsDisk.open_at(path, offset) };
        let file: StoredFile = self.list.file(&name)?.ok_or(io::ErrorKind::NotFound)?;
        // The scans of a segment are opened one by one, and a catalog several times. A tile is read once.
        let keeps = self.list.is_own(&name);
        Ok(Box::new(PartReader::new(self.parts.clone(), file, offset, keeps)?))
    }
}

impl Disk for BucketDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.open_from(path, 0)
    }

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        self.open_from(path, offset)
    }

    fn read_at(&self, path: &Path, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        let Some(name) = self.path_in_map(path) else { return FsDisk.read_at(path, offset, bytes) };
        let file = self.list.file(&name)?.ok_or(io::ErrorKind::NotFound)?;
        let end = offset.saturating_add(bytes as u64).min(file.bytes);
        let (mut read, mut at) = (Vec::new(), offset);
        while at < end {
            let part = usize::try_from(at / PART_BYTES).ok().and_then(|number| file.parts.get(number));
            let part = *part.ok_or(io::ErrorKind::UnexpectedEof)?;
            let begin = at % PART_BYTES;
            let range = begin..(begin + (end - at)).min(PART_BYTES);
            let wanted = range.end - range.start;
            let content = self.bucket.fetch_bytes(part, range).wait().map_err(missing_object)?;
            if content.len() as u64 != wanted {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            read.extend_from_slice(&content);
            at += wanted;
        }
        Ok(read)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        match self.path_in_map(path) {
            Some(_) => self.open_from(path, 0),
            None => FsDisk.open_shared(path),
        }
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        let Some(name) = self.path_in_map(path) else { return FsDisk.kind(path) };
        if let Some(file) = self.list.file(&name)? {
            return Ok(Some(EntryKind::File(file.bytes)));
        }
        let is_folder = name.is_empty() || !self.list.names_in(&name)?.is_empty();
        Ok(is_folder.then_some(EntryKind::Folder))
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        let Some(name) = self.path_in_map(path) else { return FsDisk.list(path) };
        let names = self.list.names_in(&name)?;
        if names.is_empty() {
            return Err(io::ErrorKind::NotFound.into());
        }
        Ok(names.into_iter().collect())
    }

    fn newer(&self) -> io::Result<Option<Arc<dyn Disk>>> {
        // `Error::io` extracts an `Error::NoAnswer` from this error again.
        let newer = Self::open(self.bucket.clone()).map_err(io::Error::other)?;
        Ok((newer.version != self.version).then(|| Arc::new(newer) as Arc<dyn Disk>))
    }

    fn files_ahead(&self) -> usize {
        FILES_AHEAD
    }

    fn read_ahead(&self, path: &Path) {
        let Some(name) = self.path_in_map(path) else { return };
        let Ok(Some(file)) = self.list.file(&name) else { return };
        let &[part] = &file.parts[..] else { return };
        self.parts.request(part, file.bytes);
    }

    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        match self.path_in_map(path) {
            Some(_) => Ok(path.to_owned()),
            None => FsDisk.resolve(path),
        }
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        self.writable(path)?.watch(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        self.writable(path)?.create(path)
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        self.writable(path)?.append(path, offset)
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        self.writable(path)?.sync_file(path)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.writable(path)?.sync_folder(path)
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        // Only files of this machine are written.
        FsDisk.sync_all(files, folders)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.writable(from).and(self.writable(to))?.rename(from, to)
    }

    fn exchange(&self, first: &Path, second: &Path) -> io::Result<()> {
        self.writable(first).and(self.writable(second))?.exchange(first, second)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.writable(from).and(self.writable(to))?.link(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.writable(path)?.remove_file(path)
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.writable(path)?.create_folder(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.writable(path)?.remove_folder(path)
    }

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        self.writable(folder)?.scratch(folder)
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        self.writable(path)?.lock(path)
    }
}
