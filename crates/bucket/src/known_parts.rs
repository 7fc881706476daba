use super::manifest::{Files, PART_BYTES};
use super::object_name::ObjectName;
use std::path::Path;
use voxtile::store::{CommittedFile, Disk, KEPT_SCANS, Layout};

/// Parts of kept scans that a bucket has, so that a push need not read the whole archive.
///
/// A folder uses the name of a catalog once, and needs the segments of a catalog as long as the catalog. So if it still
/// needs all catalogs of an earlier state, the segments of that state have only grown since.
#[derive(Debug, Default)]
pub(super) struct KnownParts {
    before: Files,
}

impl KnownParts {
    /// Takes the files of the state in the bucket, which the folder builds on, and its files now.
    pub(super) fn new(before: &Files, now: &[CommittedFile]) -> Self {
        let of_scans = before.iter().filter(|(path, _)| name_of(path).is_some());
        let before: Files = of_scans.map(|(path, file)| (path.clone(), file.clone())).collect();
        let is_catalog = |path: &str| name_of(path).is_some_and(|name| Layout::segment_of(name).is_none());
        let mut catalogs = before.keys().filter(|path| is_catalog(path));
        match catalogs.all(|path| now.iter().any(|file| file.path == *path)) {
            true => Self { before },
            false => Self::default(),
        }
    }

    /// Returns the leading parts of a file that the bucket has. Compares the last part only: a writer may have replaced
    /// bytes that no flush names at the end.
    pub(super) fn of(&self, disk: &dyn Disk, path: &str, place: &Path) -> Vec<ObjectName> {
        let Some(file) = self.before.get(path) else { return Vec::new() };
        let Some((last, leading)) = file.parts.split_last() else { return Vec::new() };
        let bytes = file.bytes_of_part(leading.len()) as usize;
        if leading.is_empty() {
            return Vec::new();
        }
        match disk.read_at(place, leading.len() as u64 * PART_BYTES, bytes) {
            Ok(content) if ObjectName::of(&content) == *last => leading.to_vec(),
            _ => Vec::new(),
        }
    }
}

/// Returns the name of a file of kept scans.
fn name_of(path: &str) -> Option<&str> {
    path.strip_prefix(KEPT_SCANS)?.strip_prefix('/')
}
