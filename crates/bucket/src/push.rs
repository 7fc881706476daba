use super::bucket::Bucket;
use super::file_list::FileList;
use super::known_parts::KnownParts;
use super::known_states::KnownStates;
use super::manifest::{Files, Manifest, PART_BYTES, StoredFile, page_from_bytes};
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

/// Options of [`push`].
#[derive(Clone, Copy, Debug, Default)]
pub struct PushOptions {
    /// Remove the objects that the new manifest does not name. Readers of an earlier state of the map must open it
    /// again.
    pub prunes: bool,
    /// Replace any earlier state of the same map in the bucket, even a state that the folder does not build on. Changes
    /// that only that state has are lost.
    pub replaces: bool,
    /// Upload everything, including objects that already exist. This repairs lost or damaged objects. A damaged
    /// manifest is replaced, even that of another map.
    pub resends: bool,
}

/// Counts of a push.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Pushed {
    /// Number of the flush that was pushed.
    pub flush_number: u64,
    /// Number of tiles in the map.
    pub tiles: u64,
    /// Number of tiles with uploaded objects.
    pub tiles_sent: u64,
    /// Number of uploaded objects, without the manifest.
    pub objects_sent: u64,
    /// Bytes of the uploaded objects.
    pub bytes_sent: u64,
    /// Bytes of all files in the map.
    pub bytes: u64,
    /// Number of removed objects.
    pub objects_pruned: u64,
}

/// Maximum number of attempts if a writer flushes the map during the push. Uploaded objects are kept.
const MAX_ATTEMPTS: usize = 20;

/// Uploads the last flush of a map to a bucket, even while a writer is active. Only tiles that changed since the last
/// push are uploaded, several at a time. The manifest is written last, so that readers of the bucket see complete
/// pushes. `progress` receives the tiles done and the number of all tiles.
///
/// # Errors
///
/// [`Error::Mismatch`] if the bucket has another map, a later state of this map, or a state that the folder does not
/// build on: another copy of the map was changed and pushed. A map that cannot be read or is damaged; a store that
/// refuses the request; another push that came first, whose state is kept.
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
    for _ in 1..MAX_ATTEMPTS {
        if !matches!(manifest, Err(Error::Changed { .. })) {
            break;
        }
        manifest = push.send_map(&map, &mut progress);
    }
    let manifest = manifest.map_err(|error| match error {
        // Do not check for another push: this request would also wait until its timeout.
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

/// A push in progress.
struct Push<'a> {
    bucket: &'a Bucket,
    /// The manifest found in the bucket, and its version.
    before: Option<Manifest>,
    version: Option<UpdateVersion>,
    /// States that the folder builds on; `None` if unknown.
    known: Option<KnownStates>,
    replaces: bool,
    /// Files of that manifest; `None` if everything is uploaded again.
    list: Option<FileList>,
    known_parts: KnownParts,
    sender: Sender<'a>,
    /// Tile files uploaded by an earlier attempt.
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
        let trusted = before.clone().filter(|_| !options.resends);
        let list = trusted.map(|before| FileList::new(bucket.clone(), before));
        let mut sender = Sender::new(bucket, !options.resends);
        sender.add_existing(list.iter().flat_map(|list| list.own_files().values()));
        let sent = FxHashMap::default();
        let replaces = options.replaces;
        let known_parts = KnownParts::default();
        Ok(Self { bucket, before, version, known, replaces, list, known_parts, sender, sent })
    }

    /// Uploads the missing objects of the map's last flush. Returns the manifest of this flush.
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
        self.sender.set_tile(None);
        let files = store.committed_files(&snapshots).map_err(|error| kept_scans_error(&store, error))?;
        self.known_parts = self.known_parts_of(&files)?;
        for file in files {
            let path = file.path.clone();
            let stored = self.send_file(&store, file, None)?;
            manifest.bytes += stored.bytes;
            manifest.files.insert(path, stored);
        }
        self.sender.finish()?;
        Ok(manifest)
    }

    /// Returns an error if another push came first, which may have removed objects that this push builds on.
    fn overtaken(&self) -> Option<Error> {
        let now = self.bucket.manifest().ok()?.map(|found| found.version);
        (now != self.version).then(|| self.bucket.overtaken())
    }

    /// Checks that the bucket has no other map, no later state of this map, and no diverged state.
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
            let wanted =
                format!("at most {} (the last flush of {})", manifest.flush_number, folder.display());
            return Err(Error::Mismatch { path, what: "flush", found, wanted });
        }
        // An interrupted push may have written this same manifest: `check_is_same_or_later` compares it once all files
        // are known.
        let may_be_same = before.flush_number == manifest.flush_number;
        if self.builds_on(before)? || may_be_same { Ok(()) } else { Err(self.diverged_error(before, folder)) }
    }

    /// Refuses two different states of the same flush: one of the copies has diverged.
    fn check_is_same_or_later(&self, manifest: &Manifest, folder: &Path) -> Result<()> {
        match &self.before {
            Some(before)
                if before != manifest
                    && before.flush_number == manifest.flush_number
                    && !(self.known.is_some() && self.builds_on(before)?)
                    && !self.replaces =>
            {
                Err(self.diverged_error(before, folder))
            }
            _ => Ok(()),
        }
    }

    /// Returns whether the folder builds on the state in the bucket. Without a file of known states, as in earlier
    /// versions, this is assumed.
    fn builds_on(&self, before: &Manifest) -> Result<bool> {
        let Some(known) = &self.known else { return Ok(true) };
        Ok(self.replaces || known.contains(self.name_of(before)?))
    }

    /// Returns the parts of kept scans that the bucket has. Without a record that the folder builds on the state in the
    /// bucket, all files are read.
    fn known_parts_of(&self, files: &[CommittedFile]) -> Result<KnownParts> {
        let (Some(list), Some(before), Some(known)) = (&self.list, &self.before, &self.known) else {
            return Ok(KnownParts::default());
        };
        match known.contains(self.name_of(before)?) {
            true => Ok(KnownParts::new(list.own_files(), files)),
            false => Ok(KnownParts::default()),
        }
    }

    fn diverged_error(&self, before: &Manifest, folder: &Path) -> Error {
        let wanted = format!(
            "one that {} builds on: another copy of the map was changed and pushed. Pull that state into a \
             new folder and `voxtile merge` both, or discard it with --replace",
            folder.display()
        );
        let found = before.flush_number.to_string();
        Error::Mismatch { path: self.bucket.path().to_owned(), what: "flush", found, wanted }
    }

    fn name_of(&self, manifest: &Manifest) -> Result<ObjectName> {
        let failed = |error: serde_json::Error| Error::io(self.bucket.path(), "write", error.into());
        manifest.computed_checksum().map_err(failed)
    }

    /// Writes the manifest, and records in the folder that the bucket has this state. Before the upload, the state is
    /// also recorded, as not yet in the bucket: after an interruption, the next push recognizes it.
    fn put(&mut self, map: &MapPath, manifest: &Manifest) -> Result<()> {
        let name = self.name_of(manifest)?;
        if self.before.as_ref() != Some(manifest) {
            self.record(map, manifest, name, false);
            self.bucket.replace_manifest(manifest, self.version.take())?;
        }
        self.record(map, manifest, name, true);
        Ok(())
    }

    /// Records a state in the folder. A failure is only logged, so that a read-only folder can be pushed.
    fn record(&mut self, map: &MapPath, manifest: &Manifest, name: ObjectName, was_in_bucket: bool) {
        let (disk, folder) = map.clone().into_parts();
        let mut known = self.known.clone().unwrap_or_default();
        known.add(manifest, name, was_in_bucket);
        match known.write(&*disk, &folder) {
            Ok(()) => self.known = Some(known),
            Err(error) => log::warn!("{error:#}; the push is not recorded in the folder"),
        }
    }

    /// Returns the files that a page in the bucket lists.
    fn page_before(&mut self, name: &str) -> Result<Files> {
        let Some(list) = &self.list else { return Ok(Files::new()) };
        let page = list.page(name).map_err(|error| Error::io(self.bucket.path(), "read", error))?;
        self.sender.add_existing(page.iter().flat_map(|page| page.values()));
        Ok(page.map_or_else(Files::new, |page| (*page).clone()))
    }

    /// Uploads the changed files of a tile, and adds all its files to the page.
    fn send_tile(
        &mut self,
        store: &TileStore,
        snapshots: &[Snapshot],
        tile: TileIndex,
        before: &Files,
        page: &mut Files,
    ) -> Result<()> {
        self.sender.set_tile(Some(tile));
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

    /// Uploads a page.
    fn send_page(&mut self, name: &str, page: &Files) -> Result<ObjectName> {
        let failed = |error| Error::io(self.bucket.path(), "write", error);
        let content = serde_json::to_vec(page).map_err(|error| failed(error.into()))?;
        // Do not upload a page that readers would refuse.
        page_from_bytes(name, &content).map_err(|reason| failed(io::Error::other(reason)))?;
        let object = ObjectName::of(&content);
        if self.list.as_ref().is_some_and(|list| list.has_page(name, object)) {
            return Ok(object);
        }
        self.sender.set_tile(None);
        self.sender.send(content.into())
    }

    /// Uploads the missing parts of a file.
    fn send_file(
        &mut self,
        store: &TileStore,
        file: CommittedFile,
        tile: Option<TileIndex>,
    ) -> Result<StoredFile> {
        let CommittedFile { path, content } = file;
        let (places, version) = match content {
            CommittedContent::Bytes(bytes) => {
                return self.sender.send_file(&store.folder().join(path), Vec::new(), &mut &bytes[..]);
            }
            CommittedContent::Stored { places, version } => (places, version),
        };
        for place in places {
            let leading = self.known_parts.of(&**store.disk(), &path, &place);
            let input = match store.disk().open_at(&place, leading.len() as u64 * PART_BYTES) {
                Ok(input) => input,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(Error::io(&place, "open", error)),
            };
            let mut input = Checksumming::new(input);
            let mut stored = self.sender.send_file(&place, leading, &mut input)?;
            let Some(FileVersion { checksum, scan_number }) = version else { return Ok(stored) };
            if input.finish().0 == checksum {
                (stored.crc32, stored.scan_number) = (Some(checksum.crc), Some(scan_number));
                self.sent.insert(path, stored.clone());
                return Ok(stored);
            }
        }
        Err(missing_file_error(store, &path, tile))
    }
}

/// Returns the error for a file that is missing or does not match the log: a flush in the meantime, or damage.
fn missing_file_error(store: &TileStore, path: &str, tile: Option<TileIndex>) -> Error {
    let folder = store.folder();
    let now = TileStore::open_read_only(store.disk().clone(), folder);
    if now.is_ok_and(|now| now.commits().flush_number == store.commits().flush_number) {
        let reason = "the file is missing, or is not the version that commits.log names";
        return FormatError::at_offset(0, reason).in_map(&folder.join(path), tile);
    }
    Error::Changed { path: folder.to_owned() }
}

/// Returns the error for kept scans that cannot be uploaded: a flush in the meantime, or damage.
fn kept_scans_error(store: &TileStore, error: Error) -> Error {
    let Error::Damaged { path, tile, mut cause } = error else { return error };
    let now = TileStore::open_read_only(store.disk().clone(), store.folder());
    if now.is_ok_and(|now| now.commits().flush_number != store.commits().flush_number) {
        return Error::Changed { path: store.folder().to_owned() };
    }
    cause.reason.push_str("; nothing was pushed: repair the map and push again");
    Error::Damaged { path, tile, cause }
}

/// Groups the tiles of the map and of its snapshots by page.
fn pages_of(store: &TileStore, snapshots: &[Snapshot]) -> BTreeMap<String, BTreeSet<TileIndex>> {
    let mut pages: BTreeMap<String, BTreeSet<TileIndex>> = BTreeMap::new();
    let of_snapshots = snapshots.iter().flat_map(|snapshot| snapshot.commits.tiles.tiles());
    for tile in store.tiles().iter().chain(of_snapshots) {
        pages.entry(Manifest::page_of(tile)).or_default().insert(tile);
    }
    pages
}
