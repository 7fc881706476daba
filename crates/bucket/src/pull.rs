use super::bucket::Bucket;
use super::file_list::FileList;
use super::known_states::{BUCKET_STATES, BUCKET_STATES_NEXT, KnownStates};
use super::manifest::{Manifest, PART_BYTES, StoredFile};
use super::object_name::ObjectName;
use super::part_cache::PartCache;
use super::part_reader::PartReader;
use serde::Serialize;
use std::collections::{BTreeSet, VecDeque};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::store::{
    Disk, DiskRead, EntryKind, FileChecksum, FsDisk, KEPT_SCANS, Layout, MapPath, SNAPSHOTS, TileFile,
    TileStore, WriterLock, hex, staging_folder, tile_of_folder,
};
use voxtile::{Error, Result};

/// Counts of a pull.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pulled {
    /// Number of the flush that was pulled.
    pub flush_number: u64,
    /// Number of tiles in the map.
    pub tiles: u64,
    /// Number of files in the map.
    pub files: u64,
    /// Number of fetched files; the others existed already.
    pub files_fetched: u64,
    /// Bytes of the fetched files.
    pub bytes_fetched: u64,
    /// Bytes of all files.
    pub bytes: u64,
}

/// Maximum number of files whose first part is requested before they are written.
const MAX_IN_FLIGHT: usize = 8;

/// Maximum size of their parts, of the file that is begun, and of the next part of the file that is written.
const BYTES_IN_FLIGHT: u64 = (MAX_IN_FLIGHT as u64 + 2) * PART_BYTES;

/// Downloads a map from a bucket into a folder. The map is assembled in `MAP.unfinished` and renamed at the end. A
/// later pull reuses the files of an interrupted one. `progress` receives the bytes done and the bytes of all files.
///
/// With `replaces`, the folder may contain an earlier state of the map. Unchanged files are taken from it, and the two
/// folders are exchanged at the end, atomically if the file system supports it. The earlier state must not have changed
/// since it was pushed or pulled.
///
/// # Errors
///
/// [`Error::NoMap`] if the bucket has no map; [`Error::Mismatch`] if the folder has another map, or a state of this map
/// that was in no bucket; [`Error::AlreadyExists`] if the folder has other content, or if a state of this map is not to
/// be replaced; an object that is missing or damaged, which the error names; an error of the disk.
pub fn pull(
    bucket: &Bucket,
    folder: impl AsRef<Path>,
    replaces: bool,
    progress: impl FnMut(u64, u64),
) -> Result<Pulled> {
    let folder = folder.as_ref();
    let found = bucket.manifest()?.ok_or_else(|| Error::NoMap { path: bucket.path().to_owned() })?;
    let manifest = found.manifest;
    let (disk, unfinished) = (FsDisk, staging_folder(folder)?);
    let earlier = Earlier::find(&disk, bucket, folder, &manifest, replaces)?;
    begin_folder(&disk, &unfinished)?;
    let lock = WriterLock::take(&disk, &Layout::new(&unfinished))?;
    check_only_map_files(&disk, &unfinished)?;
    let pulled = Pulled { flush_number: manifest.flush_number, tiles: manifest.tiles, ..Pulled::default() };
    let all_bytes = manifest.bytes;
    let known = known_states_with(bucket, &manifest, earlier.as_ref())?;
    let list = FileList::new(bucket.clone(), manifest);
    let mut pull = Pull {
        bucket,
        disk,
        folder: &unfinished,
        earlier,
        parts: Arc::new(PartCache::new(bucket.clone(), BYTES_IN_FLIGHT)),
        in_flight: VecDeque::new(),
        pulled,
        progress,
        all_bytes,
    };
    pull.fetch_all(&list)?;
    let Pull { pulled, earlier, .. } = pull;
    known.write(&disk, &unfinished)?;
    swap_in(&disk, &unfinished, folder, earlier.is_some())?;
    drop(lock);
    Ok(pulled)
}

/// The earlier state of the map, which is replaced.
struct Earlier {
    store: TileStore,
    known: KnownStates,
    _lock: WriterLock,
}

impl Earlier {
    /// Finds the map in a folder; `None` if the folder is empty or does not exist.
    fn find(
        disk: &FsDisk,
        bucket: &Bucket,
        folder: &Path,
        manifest: &Manifest,
        replaces: bool,
    ) -> Result<Option<Self>> {
        let is_free = match disk.kind(folder).map_err(|error| Error::io(folder, "look at", error))? {
            None => true,
            Some(EntryKind::Folder) => list(disk, folder)?.is_empty(),
            Some(_) => false,
        };
        if is_free {
            return Ok(None);
        }
        let path = folder.to_owned();
        if !replaces {
            let hint = "choose a folder that does not exist yet, or replace an earlier state of the map with --replace";
            return Err(Error::AlreadyExists { path, hint });
        }
        let lock = WriterLock::take(disk, &Layout::new(folder))?;
        let (disk, _) = MapPath::from(folder).into_parts();
        let store = TileStore::open_read_only(disk, folder)?;
        let found = store.map_id().map(|id| hex(&id));
        if found != manifest.map_id {
            let [found, wanted] =
                [found, manifest.map_id.clone()].map(|id| id.unwrap_or_else(|| "none".to_owned()));
            return Err(Error::Mismatch { path, what: "the id", found, wanted });
        }
        if store.commits().flush_number > manifest.flush_number {
            let found = store.commits().flush_number.to_string();
            let wanted = format!(
                "at most {} (the last flush in the bucket); push this folder first",
                manifest.flush_number
            );
            return Err(Error::Mismatch { path, what: "flush", found, wanted });
        }
        let known = KnownStates::read(&**store.disk(), folder)?;
        check_was_in_bucket(bucket, &store, known.as_ref(), manifest)?;
        // Check this before the download.
        check_only_map_files(&FsDisk, folder)?;
        Ok(Some(Self { store, known: known.unwrap_or_default(), _lock: lock }))
    }

    /// Returns the path of a file that may be unchanged: a file of a tile that is unchanged according to the log, or a
    /// segment of kept scans, for which the log has no checksum. Writers append to catalogs, so they are not shared.
    fn unchanged_file(&self, path: &str, file: &StoredFile) -> Option<PathBuf> {
        let place = self.store.folder().join(path);
        let (folder, name) = path.split_once('/')?;
        if folder == KEPT_SCANS {
            return Layout::segment_of(name).map(|_| place);
        }
        let version = self.store.tiles().version(tile_of_folder(folder)?)?;
        let of_tile = self
            .store
            .layout()
            .files()
            .iter()
            .find(|of_tile: &&TileFile| of_tile.name(self.store.layout().storage()) == name)?;
        let FileChecksum { bytes, crc } = version.of(*of_tile);
        let is_same =
            (file.bytes, file.crc32, file.scan_number) == (bytes, Some(crc), Some(version.scan_number));
        is_same.then_some(place)
    }
}

/// Checks that the folder's state was in a bucket: otherwise it may be the only copy. Without a file of known states,
/// as in earlier versions, the state is accepted.
fn check_was_in_bucket(
    bucket: &Bucket,
    store: &TileStore,
    known: Option<&KnownStates>,
    manifest: &Manifest,
) -> Result<()> {
    let flush_number = store.commits().flush_number;
    let Some(known) = known else { return Ok(()) };
    if known.was_in_bucket(flush_number) || known.contains(name_of(bucket, manifest)?) {
        return Ok(());
    }
    let path = store.folder().to_owned();
    let wanted = format!(
        "one that was in a bucket: the bucket's flush {} lacks later changes of this folder. Push the folder; if \
         the push is refused, pull into a new folder and `voxtile merge` both",
        manifest.flush_number
    );
    Err(Error::Mismatch { path, what: "flush", found: flush_number.to_string(), wanted })
}

/// Returns the known states of the folder, including the state that is pulled.
fn known_states_with(bucket: &Bucket, manifest: &Manifest, earlier: Option<&Earlier>) -> Result<KnownStates> {
    let mut known = earlier.map(|earlier| earlier.known.clone()).unwrap_or_default();
    known.add(manifest, name_of(bucket, manifest)?, true);
    Ok(known)
}

fn name_of(bucket: &Bucket, manifest: &Manifest) -> Result<ObjectName> {
    manifest.computed_checksum().map_err(|error| Error::io(bucket.path(), "read", error.into()))
}

/// A pull in progress.
struct Pull<'a, P> {
    bucket: &'a Bucket,
    disk: FsDisk,
    folder: &'a Path,
    earlier: Option<Earlier>,
    parts: Arc<PartCache>,
    in_flight: VecDeque<FileInFlight>,
    pulled: Pulled,
    progress: P,
    all_bytes: u64,
}

/// A file to write.
struct FileInFlight {
    place: PathBuf,
    file: StoredFile,
    /// Number of parts that are written already.
    written: usize,
}

impl<P: FnMut(u64, u64)> Pull<'_, P> {
    /// Fetches all files, page by page. The files that list the others are last.
    fn fetch_all(&mut self, list: &FileList) -> Result<()> {
        let failed = |error| Error::io(self.bucket.path(), "read", error);
        let mut folders = BTreeSet::new();
        for name in list.page_names() {
            let page = list.page(name).map_err(failed)?;
            let files = page.iter().flat_map(|page| page.iter());
            folders.extend(self.fetch_files(files)?);
        }
        folders.extend(self.fetch_files(list.own_files().iter())?);
        for folder in SUBFOLDERS.map(str::to_owned).into_iter().chain(list_folders(&self.disk, self.folder)?)
        {
            let path = self.folder.join(&folder);
            if !folders.contains(&folder) && self.kind(&path)? == Some(EntryKind::Folder) {
                remove_folder(&self.disk, &path)?;
            }
        }
        self.disk.sync_folder(self.folder).map_err(|error| Error::io(self.folder, "sync", error))
    }

    /// Fetches files durably. Returns their folders.
    fn fetch_files<'b>(
        &mut self,
        files: impl Iterator<Item = (&'b String, &'b StoredFile)>,
    ) -> Result<BTreeSet<String>> {
        let (mut folders, mut paths) = (BTreeSet::new(), BTreeSet::new());
        for (path, file) in files {
            if let Some((folder, _)) = path.split_once('/')
                && folders.insert(folder.to_owned())
            {
                self.make_folder(&self.folder.join(folder))?;
            }
            let place = self.folder.join(path);
            self.begin_file(path, &place, file)?;
            paths.insert(place);
            while self.in_flight.len() > MAX_IN_FLIGHT {
                self.finish_file()?;
            }
        }
        while !self.in_flight.is_empty() {
            self.finish_file()?;
        }
        for folder in &folders {
            // Remove files from an interrupted pull of another push.
            let folder = self.folder.join(folder);
            for name in list(&self.disk, &folder)? {
                let path = folder.join(name);
                if !paths.contains(&path) {
                    self.disk.remove_file(&path).map_err(|error| Error::io(&path, "remove", error))?;
                }
            }
        }
        let files: Vec<_> = paths.into_iter().collect();
        let places: Vec<_> = folders.iter().map(|folder| self.folder.join(folder)).collect();
        let [synced_files, synced_folders] = self.disk.sync_all(&files, &places);
        let synced = files.iter().zip(synced_files).chain(places.iter().zip(synced_folders));
        for (path, outcome) in synced {
            outcome.map_err(|error| Error::io(path, "sync", error))?;
        }
        Ok(folders)
    }

    /// Reuses an existing file, or requests its first part.
    fn begin_file(&mut self, path: &str, place: &Path, file: &StoredFile) -> Result<()> {
        self.pulled.files += 1;
        self.pulled.bytes += file.bytes;
        (self.progress)(self.pulled.bytes, self.all_bytes);
        if self.has_content(place, file)? {
            return Ok(());
        }
        let mut written = 0;
        if let Some(earlier) = self.earlier.as_ref().and_then(|earlier| earlier.unchanged_file(path, file)) {
            let _ = self.disk.remove_file(place);
            // The log does not show whether the file was damaged later.
            let is_whole = self.has_content(&earlier, file).unwrap_or(false);
            if is_whole
                && self.disk.link(&earlier, place).is_ok()
                && self.kind(place)? == Some(EntryKind::File(file.bytes))
            {
                return Ok(());
            }
            written = self.copy_leading_parts(&earlier, place, file)?;
        }
        if let Some(first) = file.parts.get(written) {
            self.parts.request(*first, file.bytes_of_part(written));
        }
        self.in_flight.push_back(FileInFlight { place: place.to_owned(), file: file.clone(), written });
        Ok(())
    }

    /// Writes the file that was requested first.
    fn finish_file(&mut self) -> Result<()> {
        let Some(FileInFlight { place, file, written }) = self.in_flight.pop_front() else { return Ok(()) };
        let offset = written as u64 * PART_BYTES;
        self.pulled.files_fetched += 1;
        self.pulled.bytes_fetched += file.bytes - offset;
        let failed = |error| Error::io(&place, "fetch", error);
        let mut input = PartReader::new(self.parts.clone(), file, offset, false).map_err(failed)?;
        let out = if written > 0 { self.disk.append(&place, offset) } else { self.disk.create(&place) };
        let mut out = out.map_err(failed)?;
        io::copy(&mut input, &mut out).and_then(|_| out.flush()).map_err(failed)
    }

    /// Copies the leading parts of a file from its earlier state, as far as they are whole and equal: a segment of kept
    /// scans grows at its end. Returns their number.
    fn copy_leading_parts(&self, earlier: &Path, place: &Path, file: &StoredFile) -> Result<usize> {
        let Some(EntryKind::File(bytes)) = self.kind(earlier)? else { return Ok(0) };
        let whole = (bytes / PART_BYTES) as usize;
        let Ok(mut input) = self.disk.open(earlier) else { return Ok(0) };
        let mut out = None;
        for (written, name) in file.parts.iter().take(whole).enumerate() {
            let mut part = Vec::new();
            let read = input.by_ref().take(PART_BYTES).read_to_end(&mut part);
            if read.is_err() || ObjectName::of(&part) != *name {
                return Ok(written);
            }
            let out = match &mut out {
                Some(out) => out,
                None => {
                    out.insert(self.disk.create(place).map_err(|error| Error::io(place, "create", error))?)
                }
            };
            out.write_all(&part)
                .and_then(|()| out.flush())
                .map_err(|error| Error::io(place, "write", error))?;
        }
        Ok(whole.min(file.parts.len()))
    }

    /// Returns whether a file exists with the right content, as fetched by an interrupted pull.
    fn has_content(&self, place: &Path, file: &StoredFile) -> Result<bool> {
        if self.kind(place)? != Some(EntryKind::File(file.bytes)) {
            return Ok(false);
        }
        let failed = |error| Error::io(place, "read", error);
        let mut input: Box<dyn DiskRead> = self.disk.open(place).map_err(failed)?;
        for name in &file.parts {
            let mut part = Vec::new();
            input.by_ref().take(PART_BYTES).read_to_end(&mut part).map_err(failed)?;
            if ObjectName::of(&part) != *name {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn make_folder(&self, path: &Path) -> Result<()> {
        match self.kind(path)? {
            Some(EntryKind::Folder) => Ok(()),
            _ => self.disk.create_folder(path).map_err(|error| Error::io(path, "create", error)),
        }
    }

    fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind(path).map_err(|error| Error::io(path, "look at", error))
    }
}

/// Folders of a map, except for those of tiles.
const SUBFOLDERS: [&str; 2] = [KEPT_SCANS, SNAPSHOTS];

/// Creates the folder in which the map is assembled.
fn begin_folder(disk: &FsDisk, unfinished: &Path) -> Result<()> {
    match disk.kind(unfinished).map_err(|error| Error::io(unfinished, "look at", error))? {
        Some(EntryKind::Folder) => check_only_map_files(disk, unfinished),
        _ => disk.create_folder(unfinished).map_err(|error| Error::io(unfinished, "create", error)),
    }
}

/// Checks that a folder has only files and folders of a map: no other files are replaced or removed.
fn check_only_map_files(disk: &FsDisk, folder: &Path) -> Result<()> {
    for name in list(disk, folder)? {
        let path = folder.join(&name);
        let kind = disk.kind(&path).map_err(|error| Error::io(&path, "look at", error))?;
        let is_folder_of_map = SUBFOLDERS.contains(&&*name) || tile_of_folder(&name).is_some();
        let is_of_map = match kind {
            Some(EntryKind::File(_)) => OWN_FILES.contains(&&*name),
            Some(EntryKind::Folder) => is_folder_of_map,
            _ => false,
        };
        if !is_of_map {
            let hint = "it is not part of a map; move it away";
            return Err(Error::AlreadyExists { path, hint });
        }
    }
    Ok(())
}

const OWN_FILES: [&str; 8] = [
    "metadata.json",
    "metadata.json.next",
    "commits.log",
    "commits.log.next",
    "scans.bin",
    "writer.lock",
    BUCKET_STATES,
    BUCKET_STATES_NEXT,
];

/// Gives the pulled map its name, durably.
fn swap_in(disk: &FsDisk, unfinished: &Path, folder: &Path, replaces: bool) -> Result<()> {
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let rename =
        |from: &Path, to: &Path| disk.rename(from, to).map_err(|error| Error::io(from, "rename", error));
    let sync = || disk.sync_folder(parent).map_err(|error| Error::io(parent, "sync", error));
    if !replaces {
        if disk.kind(folder).map_err(|error| Error::io(folder, "look at", error))?.is_some() {
            disk.remove_folder(folder).map_err(|error| Error::io(folder, "replace", error))?;
        }
        rename(unfinished, folder)?;
        return sync();
    }
    check_only_map_files(disk, folder)?;
    let replaced = match disk.exchange(unfinished, folder) {
        Ok(()) => unfinished.to_owned(),
        Err(error)
            if error.kind() == io::ErrorKind::Unsupported || error.kind() == io::ErrorKind::InvalidInput =>
        {
            let replaced = folder.with_added_extension("replaced");
            rename(folder, &replaced)?;
            rename(unfinished, folder)?;
            replaced
        }
        Err(error) => return Err(Error::io(folder, "replace", error)),
    };
    sync()?;
    for name in list_folders(disk, &replaced)? {
        remove_folder(disk, &replaced.join(name))?;
    }
    remove_folder(disk, &replaced)
}

fn list(disk: &FsDisk, folder: &Path) -> Result<Vec<String>> {
    disk.list(folder).map_err(|error| Error::io(folder, "list", error))
}

/// Returns the names of the folders in a map.
fn list_folders(disk: &FsDisk, folder: &Path) -> Result<Vec<String>> {
    let mut names = list(disk, folder)?;
    names.retain(|name| SUBFOLDERS.contains(&&**name) || tile_of_folder(name).is_some());
    Ok(names)
}

/// Removes a folder and its files.
fn remove_folder(disk: &FsDisk, folder: &Path) -> Result<()> {
    for name in list(disk, folder)? {
        let path = folder.join(name);
        disk.remove_file(&path).map_err(|error| Error::io(&path, "remove", error))?;
    }
    disk.remove_folder(folder).map_err(|error| Error::io(folder, "remove", error))
}
