use super::bucket::Bucket;
use super::file_list::FileList;
use super::known_states::{BUCKET_STATES, BUCKET_STATES_NEXT, KnownStates};
use super::manifest::{Manifest, PART_BYTES, StoredFile};
use super::object_name::ObjectName;
use super::part_reader::PartReader;
use super::pending::Pending;
use bytes::Bytes;
use serde::Serialize;
use std::collections::{BTreeSet, VecDeque};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use voxtile::store::{
    Disk, DiskRead, EntryKind, FileChecksum, FsDisk, KEPT_SCANS, Layout, MapPath, SNAPSHOTS, TileFile,
    TileStore, WriterLock, hex, staging_folder, tile_of_folder,
};
use voxtile::{Error, Result};

/// What a pull did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pulled {
    /// Number of the flush that was pulled.
    pub flush_number: u64,
    /// Tiles of the map.
    pub tiles: u64,
    /// Files of the map.
    pub files: u64,
    /// Files that were fetched; the others were there.
    pub files_fetched: u64,
    /// Their bytes.
    pub bytes_fetched: u64,
    /// Bytes of all files.
    pub bytes: u64,
}

/// Files of which the first part is on its way, beside the one that is written.
const MAX_IN_FLIGHT: usize = 8;

/// Makes a map in a folder of the one in a bucket. It grows in `MAP.unfinished` and gets its name at the end; what an
/// interrupted pull has fetched is not fetched again. `progress` hears of bytes done and of all bytes.
///
/// With `replaces` there may be an earlier state of the map in the folder: files that are as they were are taken from
/// there, and in the end the two change places at once. It must not have been changed since it was pushed or pulled.
///
/// # Errors
///
/// [`Error::NoMap`] if there is none in the bucket; [`Error::Mismatch`] if the folder has another map, or a state of this
/// one that was in no bucket; [`Error::AlreadyExists`] if there is something in the folder, and no earlier state of this
/// map is to be replaced; an object that is missing or damaged, named; a disk that refuses.
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
    begin(&disk, &unfinished)?;
    let lock = WriterLock::take(&disk, &Layout::new(&unfinished))?;
    check_is_of_map(&disk, &unfinished)?;
    let pulled = Pulled { flush_number: manifest.flush_number, tiles: manifest.tiles, ..Pulled::default() };
    let all_bytes = manifest.bytes;
    let known = known_with(bucket, &manifest, earlier.as_ref())?;
    let list = FileList::new(bucket.clone(), manifest);
    let mut pull = Pull {
        bucket,
        disk,
        folder: &unfinished,
        earlier,
        in_flight: VecDeque::new(),
        pulled,
        progress,
        all_bytes,
    };
    pull.take_all(&list)?;
    let Pull { pulled, earlier, .. } = pull;
    known.write(&disk, &unfinished)?;
    take_place(&disk, &unfinished, folder, earlier.is_some())?;
    drop(lock);
    Ok(pulled)
}

/// The state of the map that is replaced.
struct Earlier {
    store: TileStore,
    known: KnownStates,
    _lock: WriterLock,
}

impl Earlier {
    /// The map in a folder; `None` if there is nothing.
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
            let hint = "choose a folder that does not exist yet; or replace an earlier state of the map with `replace`";
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
            let wanted = format!("at most {} as the bucket; push it", manifest.flush_number);
            return Err(Error::Mismatch { path, what: "flush", found, wanted });
        }
        let known = KnownStates::read(&**store.disk(), folder)?;
        check_was_there(bucket, &store, known.as_ref(), manifest)?;
        // Now, and not after everything was fetched.
        check_is_of_map(&FsDisk, folder)?;
        Ok(Some(Self { store, known: known.unwrap_or_default(), _lock: lock }))
    }

    /// Where a file is that is as it was, by what the log says.
    fn place_of(&self, path: &str, file: &StoredFile) -> Option<PathBuf> {
        let place = self.store.folder().join(path);
        let (folder, name) = path.split_once('/')?;
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

/// What a folder has and no bucket ever had is not replaced: it may be the only copy. Where nobody has noted what was
/// in a bucket, as earlier versions did not, the flush alone tells.
fn check_was_there(
    bucket: &Bucket,
    store: &TileStore,
    known: Option<&KnownStates>,
    manifest: &Manifest,
) -> Result<()> {
    let flush_number = store.commits().flush_number;
    let Some(known) = known else { return Ok(()) };
    if known.were_there(flush_number) || known.name(name_of(bucket, manifest)?) {
        return Ok(());
    }
    let path = store.folder().to_owned();
    let wanted = format!(
        "one that was in a bucket, and the bucket's {} lacks what was mapped since; push it, or where that is refused, \
         pull into a new folder and `voxtile merge` the two",
        manifest.flush_number
    );
    Err(Error::Mismatch { path, what: "flush", found: flush_number.to_string(), wanted })
}

/// What the folder builds on with this state in it.
fn known_with(bucket: &Bucket, manifest: &Manifest, earlier: Option<&Earlier>) -> Result<KnownStates> {
    let mut known = earlier.map(|earlier| earlier.known.clone()).unwrap_or_default();
    known.note(manifest, name_of(bucket, manifest)?, true);
    Ok(known)
}

fn name_of(bucket: &Bucket, manifest: &Manifest) -> Result<ObjectName> {
    manifest.computed_checksum().map_err(|error| Error::io(bucket.path(), "read", error.into()))
}

/// A pull that goes on.
struct Pull<'a, P> {
    bucket: &'a Bucket,
    disk: FsDisk,
    folder: &'a Path,
    earlier: Option<Earlier>,
    /// Files that are to be written, in order.
    in_flight: VecDeque<(PathBuf, StoredFile, Option<Pending<Bytes>>)>,
    pulled: Pulled,
    progress: P,
    all_bytes: u64,
}

impl<P: FnMut(u64, u64)> Pull<'_, P> {
    /// Takes all files, page by page, and those last that tell what there is.
    fn take_all(&mut self, list: &FileList) -> Result<()> {
        let failed = |error| Error::io(self.bucket.path(), "read", error);
        let mut folders = BTreeSet::new();
        for name in list.page_names() {
            let page = list.page(name).map_err(failed)?;
            let files = page.iter().flat_map(|page| page.iter());
            folders.extend(self.take_files(files)?);
        }
        folders.extend(self.take_files(list.own_files().iter())?);
        for folder in SUBFOLDERS.map(str::to_owned).into_iter().chain(list_folders(&self.disk, self.folder)?)
        {
            let path = self.folder.join(&folder);
            if !folders.contains(&folder) && self.kind(&path)? == Some(EntryKind::Folder) {
                remove_folder(&self.disk, &path)?;
            }
        }
        self.disk.sync_folder(self.folder).map_err(|error| Error::io(self.folder, "sync", error))
    }

    /// Takes files, durably; returns the folders that they are in.
    fn take_files<'b>(
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
                self.end_file()?;
            }
        }
        while !self.in_flight.is_empty() {
            self.end_file()?;
        }
        for folder in &folders {
            // Of a pull of another push.
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

    /// Takes a file that is there already, or asks for its first part.
    fn begin_file(&mut self, path: &str, place: &Path, file: &StoredFile) -> Result<()> {
        self.pulled.files += 1;
        self.pulled.bytes += file.bytes;
        (self.progress)(self.pulled.bytes, self.all_bytes);
        if self.is_there(place, file)? {
            return Ok(());
        }
        if let Some(earlier) = self.earlier.as_ref().and_then(|earlier| earlier.place_of(path, file)) {
            let _ = self.disk.remove_file(place);
            // What the log says of a file does not tell whether it was damaged since.
            let is_whole = self.is_there(&earlier, file).unwrap_or(false);
            if is_whole
                && self.disk.link(&earlier, place).is_ok()
                && self.kind(place)? == Some(EntryKind::File(file.bytes))
            {
                return Ok(());
            }
        }
        let first = file.parts.first().map(|first| self.bucket.fetch(*first, PART_BYTES));
        self.in_flight.push_back((place.to_owned(), file.clone(), first));
        Ok(())
    }

    /// Writes the file that was asked for first.
    fn end_file(&mut self) -> Result<()> {
        let Some((place, file, first)) = self.in_flight.pop_front() else { return Ok(()) };
        self.pulled.files_fetched += 1;
        self.pulled.bytes_fetched += file.bytes;
        let failed = |error| Error::io(&place, "fetch", error);
        let mut input = PartReader::new(self.bucket.clone(), file, 0, first).map_err(failed)?;
        let mut out = self.disk.create(&place).map_err(failed)?;
        io::copy(&mut input, &mut out).and_then(|_| out.flush()).map_err(failed)
    }

    /// Whether a file is there with the right content, as an interrupted pull has fetched it.
    fn is_there(&self, place: &Path, file: &StoredFile) -> Result<bool> {
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

/// Folders of a map beside those of tiles.
const SUBFOLDERS: [&str; 2] = [KEPT_SCANS, SNAPSHOTS];

/// Makes the folder in which the map grows.
fn begin(disk: &FsDisk, unfinished: &Path) -> Result<()> {
    match disk.kind(unfinished).map_err(|error| Error::io(unfinished, "look at", error))? {
        Some(EntryKind::Folder) => check_is_of_map(disk, unfinished),
        _ => disk.create_folder(unfinished).map_err(|error| Error::io(unfinished, "create", error)),
    }
}

/// Nothing is taken into a map, or removed, that is not of one.
fn check_is_of_map(disk: &FsDisk, folder: &Path) -> Result<()> {
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
            let hint = "it is in the way of a map that is to be made or replaced; move it away";
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

/// Gives the map that was pulled its name, durably.
fn take_place(disk: &FsDisk, unfinished: &Path, folder: &Path, replaces: bool) -> Result<()> {
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
    check_is_of_map(disk, folder)?;
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

/// The names of the folders in a map.
fn list_folders(disk: &FsDisk, folder: &Path) -> Result<Vec<String>> {
    let mut names = list(disk, folder)?;
    names.retain(|name| SUBFOLDERS.contains(&&**name) || tile_of_folder(name).is_some());
    Ok(names)
}

/// Removes a folder with the files in it.
fn remove_folder(disk: &FsDisk, folder: &Path) -> Result<()> {
    for name in list(disk, folder)? {
        let path = folder.join(name);
        disk.remove_file(&path).map_err(|error| Error::io(&path, "remove", error))?;
    }
    disk.remove_folder(folder).map_err(|error| Error::io(folder, "remove", error))
}
