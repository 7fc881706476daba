use super::bucket::Bucket;
use super::file_list::FileList;
use super::manifest::Manifest;
use super::object_name::ObjectName;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;
use std::io;
use voxtile::{Error, Result};

/// Maximum number of concurrent removals.
const MAX_IN_FLIGHT: usize = 16;

/// Removes the objects that a manifest does not name, and returns their number. The caller has written the manifest.
///
/// Objects newer than the manifest are kept, because another push may be about to name them. If that push also names
/// older objects that are removed here, it has read an older manifest, so its own manifest is refused.
pub(super) fn prune(bucket: &Bucket, manifest: Manifest) -> Result<u64> {
    let failed = |error: io::Error| Error::io(bucket.path(), "prune", error);
    let named = objects_of(bucket, &manifest).map_err(failed)?;
    let found = bucket.objects_before_manifest().map_err(failed)?;
    // Prune only if the manifest in the bucket is still that of this push.
    let now = bucket.manifest()?.map(|found| found.manifest);
    if now.as_ref() != Some(&manifest) {
        return Err(Error::Changed { path: bucket.path().to_owned() });
    }
    let (mut removed, mut in_flight) = (0, VecDeque::new());
    for name in found.into_iter().filter(|name| !named.contains(name)) {
        in_flight.push_back(bucket.remove(name));
        removed += 1;
        if in_flight.len() >= MAX_IN_FLIGHT
            && let Some(pending) = in_flight.pop_front()
        {
            pending.wait().map_err(failed)?;
        }
    }
    in_flight.into_iter().try_for_each(|pending| pending.wait().map_err(failed))?;
    Ok(removed)
}

/// Returns all objects that a manifest names.
fn objects_of(bucket: &Bucket, manifest: &Manifest) -> io::Result<FxHashSet<ObjectName>> {
    let mut named: FxHashSet<_> = manifest.pages.values().copied().collect();
    let list = FileList::new(bucket.clone(), manifest.clone());
    named.extend(list.own_files().values().flat_map(|file| &file.parts));
    for name in manifest.pages.keys() {
        let page = list.page(name)?;
        named.extend(page.iter().flat_map(|page| page.values()).flat_map(|file| &file.parts));
    }
    Ok(named)
}
