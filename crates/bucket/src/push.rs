use super::bucket::Bucket;
use super::file_list::FileList;
use super::known_states::KnownStates;
use super::manifest::{Files, Manifest, StoredFile, page_from_bytes};
use super::object_name::ObjectName;
use super::prune::prune;
use super::sender::Sender;
use object_store::UpdateVersion;
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;
use voxtile::space::TileIndex;
use voxtile::store::{
    Checksumming, CommittedContent, CommittedFile, FileVersion, MapPath, Snapshot, TileStore, hex,
};
use voxtile::{Error, FormatError, Result};

/// How to [`push`].
#[derive(Clone, Copy, Debug, Default)]
pub struct PushOptions {
    /// Remove the objects that no manifest names any more. Whoever reads an earlier state of the map has to open it
    /// anew.
    pub prunes: bool,
    /// Replace whatever earlier state of the same map is there, also one that the folder does not build on: what that
    /// has and the folder lacks is lost.
    pub replaces: bool,
    /// Send everything, also what is there by its name or by the last manifest: objects there that were lost or damaged
    /// are whole then, and a manifest that cannot be read is replaced, whatever map it was of.
    pub resends: bool,
}

/// What a push did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pushed {
    /// Number of the flush that was pushed.
    pub flush_number: u64,
    /// Tiles of the map.
    pub tiles: u64,
    /// Tiles of which something was sent.
    pub tiles_sent: u64,
    /// Objects that were sent, the manifest left out.
    pub objects_sent: u64,
    /// Their bytes.
    pub bytes_sent: u64,
    /// Bytes of all files of the map.
    pub bytes: u64,
    /// Objects that were removed.
    pub objects_pruned: u64,
}

/// How often a push begins again because a writer flushed the map meanwhile. What was sent stays sent.
const ATTEMPTS: usize = 20;

/// Copies the last flush of a map into a bucket, beside a writer too. Only tiles that changed since the last push are
/// sent, several at a time, and the manifest last: readers of the bucket see one push whole, or the one before.
/// `progress` hears of tiles done and of all tiles.
///
/// # Errors
///
/// [`Error::Mismatch`] if another map is there, a later state of this one, or a state that it does not build on: a copy
/// of the map went another way and was pushed. A map that cannot be read or is damaged; a store that refuses; another
/// push that came first, whose state then stays.
pub fn push(
    map: impl Into<MapPath>,
    bucket: &Bucket,
    options: PushOptions,
    mut progress: impl FnMut(u64, u64),
) -> Result<Pushed> {
    bucket.check_can_write()?;
    let map = map.into();
    let mut push = Push::begin(bucket, &map, options)?;
    let mut manifest = push.send_map(&map, &mut progress);
    for _ in 1..ATTEMPTS {
        if !matches!(manifest, Err(Error::Changed { .. })) {
            break;
        }
        manifest = push.send_map(&map, &mut progress);
    }
    let manifest = manifest.map_err(|error| match error {
        // Another question would wait as long.
        Error::NoAnswer { .. } | Error::Stopped => error,
        error => push.overtaken().unwrap_or(error),
    })?;
    push.check_is_same_or_later(&manifest, map.folder())?;
    push.put(&map, &manifest)?;
    let sent = push.sender.sent();
    let mut pushed = Pushed {
        flush_number: manifest.flush_number,
        tiles: manifest.tiles,
        tiles_sent: sent.tiles.len() as u64,
        objects_sent: sent.objects,
        bytes_sent: sent.bytes,
        bytes: manifest.bytes,
        objects_pruned: 0,
    };
    if options.prunes {
        pushed.objects_pruned = prune(bucket, manifest)?;
    }
    Ok(pushed)
}

/// A push that goes on.
struct Push<'a> {
    bucket: &'a Bucket,
    /// The manifest that was there, and what tells it from its successor.
    before: Option<Manifest>,
    version: Option<UpdateVersion>,
    /// What the folder builds on, if that is known.
    known: Option<KnownStates>,
    replaces: bool,
    /// Its files; none where nothing that is there is believed.
    list: Option<FileList>,
    sender: Sender<'a>,
    /// Files of tiles that an earlier attempt has sent.
    sent: FxHashMap<String, StoredFile>,
}

impl<'a> Push<'a> {
    fn begin(bucket: &'a Bucket, map: &MapPath, options: PushOptions) -> Result<Self> {
        let (disk, folder) = map.clone().into_parts();
        let known = KnownStates::read(&*disk, &folder)?;
        let (before, version) = if options.resends {
            bucket.replaceable_manifest()?.unzip()
        } else {
            bucket.manifest()?.map(|found| (Some(found.manifest), found.version)).unzip()
        };
        let before = before.flatten();
        let believed = before.clone().filter(|_| !options.resends);
        let list = believed.map(|before| FileList::new(bucket.clone(), before));
        let mut sender = Sender::new(bucket, !options.resends);
        sender.note(list.iter().flat_map(|list| list.own_files().values()));
        let sent = FxHashMap::default();
        let replaces = options.replaces;
        Ok(Self { bucket, before, version, known, replaces, list, sender, sent })
    }

    /// Sends what the bucket lacks of the map's last flush; the manifest that names all of it.
    fn send_map(&mut self, map: &MapPath, progress: &mut impl FnMut(u64, u64)) -> Result<Manifest> {
        let (disk, folder) = map.clone().into_parts();
        let store = TileStore::open_read_only(disk, &folder)?;
        let commits = store.commits();
        let map_id = store.map_id().map(|id| hex(&id));
        let mut manifest = Manifest::new(map_id, commits.flush_number, commits.scan_number);
        manifest.tiles = store.tiles().count() as u64;
        self.check_is_later(&manifest, &folder)?;
        let snapshots = store.snapshots().read_all()?;
        let pages = pages_of(&store, &snapshots);
        let all = pages.values().map(|tiles| tiles.len() as u64).sum();
        let mut done = 0;
        for (name, tiles) in pages {
            let before = self.page_before(&name)?;
            let mut page = Files::new();
            for tile in &tiles {
                self.send_tile(&store, &snapshots, *tile, &before, &mut page)?;
                done += 1;
                progress(done, all);
            }
            manifest.bytes += page.values().map(|file| file.bytes).sum::<u64>();
            let object = self.send_page(&name, &page)?;
            manifest.pages.insert(name, object);
        }
        self.sender.begin(None);
        let files = store.committed_files(&snapshots).map_err(|error| unless_changed(&store, error))?;
        for file in files {
            let path = file.path.clone();
            let stored = self.send_file(&store, file, None)?;
            manifest.bytes += stored.bytes;
            manifest.files.insert(path, stored);
        }
        self.sender.finish()?;
        Ok(manifest)
    }

    /// Why a push may have failed: another one came first, and removed what this one builds on.
    fn overtaken(&self) -> Option<Error> {
        let now = self.bucket.manifest().ok()?.map(|found| found.version);
        (now != self.version).then(|| self.bucket.overtaken())
    }

    /// Neither another map nor a later state of this one is replaced.
    fn check_is_later(&self, manifest: &Manifest, folder: &Path) -> Result<()> {
        let Some(before) = &self.before else { return Ok(()) };
        let path = self.bucket.path().to_owned();
        if before.map_id != manifest.map_id {
            let [found, wanted] =
                [&before.map_id, &manifest.map_id].map(|id| id.clone().unwrap_or_else(|| "none".to_owned()));
            let wanted = format!("{wanted} of {}", folder.display());
            return Err(Error::Mismatch { path, what: "the id", found, wanted });
        }
        if before.flush_number > manifest.flush_number {
            let found = before.flush_number.to_string();
            let wanted = format!("at most {} as {}", manifest.flush_number, folder.display());
            return Err(Error::Mismatch { path, what: "flush", found, wanted });
        }
        // A push that was interrupted behind its last step finds itself there: that is told when all is known.
        let may_be_same = before.flush_number == manifest.flush_number;
        if self.builds_on(before)? || may_be_same {
            Ok(())
        } else {
            Err(self.went_another_way(before, folder))
        }
    }

    /// Of two states of one flush that differ, one went another way.
    fn check_is_same_or_later(&self, manifest: &Manifest, folder: &Path) -> Result<()> {
        match &self.before {
            Some(before)
                if before != manifest
                    && before.flush_number == manifest.flush_number
                    && !(self.known.is_some() && self.builds_on(before)?)
                    && !self.replaces =>
            {
                Err(self.went_another_way(before, folder))
            }
            _ => Ok(()),
        }
    }

    /// Whether the folder builds on what is there. Where nobody has noted it, as earlier versions did not, it is
    /// believed.
    fn builds_on(&self, before: &Manifest) -> Result<bool> {
        let Some(known) = &self.known else { return Ok(true) };
        Ok(self.replaces || known.name(self.name_of(before)?))
    }

    fn went_another_way(&self, before: &Manifest, folder: &Path) -> Error {
        let wanted = format!(
            "one that {} builds on: a copy of the map went another way and was pushed; pull that into a new folder and \
             `voxtile merge` the two, or push with --replace, and what is there alone is lost",
            folder.display()
        );
        let found = before.flush_number.to_string();
        Error::Mismatch { path: self.bucket.path().to_owned(), what: "flush", found, wanted }
    }

    fn name_of(&self, manifest: &Manifest) -> Result<ObjectName> {
        let failed = |error: serde_json::Error| Error::io(self.bucket.path(), "write", error.into());
        manifest.computed_checksum().map_err(failed)
    }

    /// Puts the manifest, and notes in the folder that this state is there. It is noted as offered before: whoever is
    /// interrupted in between finds on the next push what they know.
    fn put(&mut self, map: &MapPath, manifest: &Manifest) -> Result<()> {
        let name = self.name_of(manifest)?;
        if self.before.as_ref() != Some(manifest) {
            self.note(map, manifest, name, false);
            self.bucket.replace_manifest(manifest, self.version.take())?;
        }
        self.note(map, manifest, name, true);
        Ok(())
    }

    /// A folder that may only be read is pushed all the same.
    fn note(&mut self, map: &MapPath, manifest: &Manifest, name: ObjectName, was_there: bool) {
        let (disk, folder) = map.clone().into_parts();
        let mut known = self.known.clone().unwrap_or_default();
        known.note(manifest, name, was_there);
        match known.write(&*disk, &folder) {
            Ok(()) => self.known = Some(known),
            Err(error) => log::warn!("{error:#}; the folder does not know that it was pushed"),
        }
    }

    /// The files that a page lists by now.
    fn page_before(&mut self, name: &str) -> Result<Files> {
        let Some(list) = &self.list else { return Ok(Files::new()) };
        let page = list.page(name).map_err(|error| Error::io(self.bucket.path(), "read", error))?;
        self.sender.note(page.iter().flat_map(|page| page.values()));
        Ok(page.map_or_else(Files::new, |page| (*page).clone()))
    }

    /// Sends what is new of a tile, and adds its files to the page.
    fn send_tile(
        &mut self,
        store: &TileStore,
        snapshots: &[Snapshot],
        tile: TileIndex,
        before: &Files,
        page: &mut Files,
    ) -> Result<()> {
        self.sender.begin(Some(tile));
        for file in store.committed_files_of(tile, snapshots)? {
            let path = file.path.clone();
            let known = match &file.content {
                CommittedContent::Stored { version: Some(version), .. } => {
                    let known = [before.get(&path), self.sent.get(&path)].into_iter().flatten();
                    known.into_iter().find(|known| known.is_version(*version)).cloned()
                }
                _ => None,
            };
            let stored = match known {
                Some(known) => known,
                None => self.send_file(store, file, Some(tile))?,
            };
            page.insert(path, stored);
        }
        Ok(())
    }

    /// Sends a page.
    fn send_page(&mut self, name: &str, page: &Files) -> Result<ObjectName> {
        let failed = |error| Error::io(self.bucket.path(), "write", error);
        let content = serde_json::to_vec(page).map_err(|error| failed(error.into()))?;
        // What no reader would take is not sent.
        page_from_bytes(name, &content).map_err(|reason| failed(io::Error::other(reason)))?;
        let object = ObjectName::of(&content);
        if self.list.as_ref().is_some_and(|list| list.has_page(name, object)) {
            return Ok(object);
        }
        self.sender.begin(None);
        self.sender.send(content.into())
    }

    /// Sends the parts of a file that the bucket lacks.
    fn send_file(
        &mut self,
        store: &TileStore,
        file: CommittedFile,
        tile: Option<TileIndex>,
    ) -> Result<StoredFile> {
        let CommittedFile { path, content } = file;
        let (places, version) = match content {
            CommittedContent::Bytes(bytes) => {
                return self.sender.send_file(&store.folder().join(path), &mut &bytes[..]);
            }
            CommittedContent::Stored { places, version } => (places, version),
        };
        for place in places {
            let input = match store.disk().open(&place) {
                Ok(input) => input,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(Error::io(&place, "open", error)),
            };
            let mut input = Checksumming::new(input);
            let mut stored = self.sender.send_file(&place, &mut input)?;
            let Some(FileVersion { checksum, scan_number }) = version else { return Ok(stored) };
            if input.finish().0 == checksum {
                (stored.crc32, stored.scan_number) = (Some(checksum.crc), Some(scan_number));
                self.sent.insert(path, stored.clone());
                return Ok(stored);
            }
        }
        Err(not_found(store, &path, tile))
    }
}

/// Why a file that the log names is not there, or is another one: a flush came in between, or it is damaged.
fn not_found(store: &TileStore, path: &str, tile: Option<TileIndex>) -> Error {
    let folder = store.folder();
    let now = TileStore::open_read_only(store.disk().clone(), folder);
    if now.is_ok_and(|now| now.commits().flush_number == store.commits().flush_number) {
        let reason = "the file is missing or not the one that commits.log names; `voxtile verify` says more";
        return FormatError::at_offset(0, reason).in_map(&folder.join(path), tile);
    }
    Error::Changed { path: folder.to_owned() }
}

/// Why files of kept scans cannot be sent: a flush came in between, or they are damaged.
fn unless_changed(store: &TileStore, error: Error) -> Error {
    let Error::Damaged { path, tile, mut cause } = error else { return error };
    let now = TileStore::open_read_only(store.disk().clone(), store.folder());
    if now.is_ok_and(|now| now.commits().flush_number != store.commits().flush_number) {
        return Error::Changed { path: store.folder().to_owned() };
    }
    cause.reason.push_str("; nothing was pushed: repair the map, and push again");
    Error::Damaged { path, tile, cause }
}

/// The tiles that the map or a snapshot of it sees, by the pages that list their files.
fn pages_of(store: &TileStore, snapshots: &[Snapshot]) -> BTreeMap<String, BTreeSet<TileIndex>> {
    let mut pages: BTreeMap<String, BTreeSet<TileIndex>> = BTreeMap::new();
    let of_snapshots = snapshots.iter().flat_map(|snapshot| snapshot.commits.tiles.tiles());
    for tile in store.tiles().iter().chain(of_snapshots) {
        pages.entry(Manifest::page_of(tile)).or_default().insert(tile);
    }
    pages
}
