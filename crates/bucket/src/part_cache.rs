use super::bucket::Bucket;
use super::manifest::PART_BYTES;
use super::object_name::ObjectName;
use super::pending::Pending;
use bytes::Bytes;
use lru::LruCache;
use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Parts of files that were requested ahead, or that another reader may need again. The least recently used are dropped
/// beyond a limit in bytes.
#[derive(Debug)]
pub(super) struct PartCache {
    bucket: Bucket,
    parts: Mutex<Parts>,
}

#[derive(Debug)]
struct Parts {
    parts: LruCache<ObjectName, (u64, Part)>,
    /// Total size of the parts, in bytes.
    bytes: u64,
    max_bytes: u64,
}

#[derive(Debug)]
enum Part {
    Requested(Pending<Bytes>),
    Fetched(Bytes),
    /// The object is missing or damaged.
    Failed(io::ErrorKind, String, Instant),
}

/// Time after which a missing or damaged object is requested again. A segment has hundreds of scans, and each of them
/// would be a download.
const RETRY_AFTER: Duration = Duration::from_secs(30);

impl PartCache {
    pub(super) fn new(bucket: Bucket, max_bytes: u64) -> Self {
        let parts = Parts { parts: LruCache::unbounded(), bytes: 0, max_bytes };
        Self { bucket, parts: Mutex::new(parts) }
    }

    /// Starts to fetch a part of this size, unless the cache has it.
    pub(super) fn request(&self, name: ObjectName, bytes: u64) {
        self.parts().request(name, bytes, || self.bucket.fetch(name, PART_BYTES));
    }

    /// Returns a part, and with `keeps` retains it for other readers.
    pub(super) fn get(&self, name: ObjectName, keeps: bool) -> io::Result<Bytes> {
        let found = self.parts().take(name, keeps);
        let fetched = match found {
            Some(Part::Fetched(content)) => return Ok(content),
            Some(Part::Failed(kind, reason, at)) if keeps && at.elapsed() < RETRY_AFTER => {
                return Err(io::Error::new(kind, reason));
            }
            Some(Part::Requested(pending)) => pending.wait(),
            _ => self.bucket.fetch(name, PART_BYTES).wait(),
        };
        match &fetched {
            Ok(content) if keeps => {
                let bytes = content.len() as u64;
                self.parts().put(name, bytes, Part::Fetched(content.clone()));
            }
            Err(error)
                if keeps && matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::InvalidData) =>
            {
                let reason = error.to_string();
                let bytes = reason.len() as u64;
                self.parts().put(name, bytes, Part::Failed(error.kind(), reason, Instant::now()));
            }
            _ => {}
        }
        fetched
    }

    fn parts(&self) -> MutexGuard<'_, Parts> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Parts {
    fn request(&mut self, name: ObjectName, bytes: u64, fetch: impl FnOnce() -> Pending<Bytes>) {
        if !self.parts.contains(&name) {
            self.put(name, bytes, Part::Requested(fetch()));
        }
    }

    fn put(&mut self, name: ObjectName, bytes: u64, part: Part) {
        self.remove(name);
        while self.bytes + bytes > self.max_bytes
            && let Some((_, (dropped, _))) = self.parts.pop_lru()
        {
            self.bytes -= dropped;
        }
        self.parts.put(name, (bytes, part));
        self.bytes += bytes;
    }

    /// Returns a part. With `keeps`, it remains in the cache, unless it is still requested.
    fn take(&mut self, name: ObjectName, keeps: bool) -> Option<Part> {
        match self.parts.get(&name) {
            Some((_, Part::Fetched(content))) if keeps => Some(Part::Fetched(content.clone())),
            Some((_, Part::Failed(kind, reason, at))) if keeps => {
                Some(Part::Failed(*kind, reason.clone(), *at))
            }
            _ => self.remove(name),
        }
    }

    fn remove(&mut self, name: ObjectName) -> Option<Part> {
        let (bytes, part) = self.parts.pop(&name)?;
        self.bytes -= bytes;
        Some(part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use object_store::memory::InMemory;
    use std::sync::Arc;

    /// Returns the number of parts and their size in bytes.
    fn size_of(cache: &PartCache) -> (usize, u64) {
        let parts = cache.parts();
        (parts.parts.len(), parts.bytes)
    }

    fn cache(max_bytes: u64) -> PartCache {
        let bucket = Bucket::on(Arc::new(InMemory::new()), "map", "s3://test/map").unwrap();
        PartCache::new(bucket, max_bytes)
    }

    #[test]
    fn a_part_that_two_threads_request_is_counted_once() {
        let cache = cache(100);
        let [a, b] = ["a", "b"].map(|text| ObjectName::of(text.as_bytes()));
        for name in [a, b, a] {
            cache.request(name, 10);
        }
        assert_eq!(size_of(&cache), (2, 20));
        for name in [a, b] {
            assert!(matches!(cache.parts().take(name, false), Some(Part::Requested(_))));
        }
        assert_eq!(size_of(&cache), (0, 0));
    }

    #[test]
    fn a_missing_part_is_not_requested_for_each_reader() {
        let store = Arc::new(InMemory::new());
        let bucket = Bucket::on(store, "map", "s3://test/map").unwrap();
        let cache = PartCache::new(bucket.clone(), 100);
        let name = ObjectName::of(b"content");
        let missing = |cache: &PartCache| cache.get(name, true).unwrap_err();
        assert_eq!(missing(&cache).kind(), io::ErrorKind::NotFound);
        bucket.put(name, Bytes::from_static(b"content"), false).wait().unwrap();
        let again = missing(&cache);
        assert!(
            again.kind() == io::ErrorKind::NotFound && again.to_string().contains(&name.key()),
            "{again}"
        );
        assert_eq!(cache.get(name, false).unwrap(), "content");
        assert_eq!(PartCache::new(bucket, 100).get(name, true).unwrap(), "content");
    }

    #[test]
    fn the_least_recently_used_parts_are_dropped() {
        let cache = cache(100);
        let names: Vec<_> = (0..4_u8).map(|number| ObjectName::of(&[number])).collect();
        let fetched = || Part::Fetched(Bytes::from_static(b"x"));
        for name in &names[..2] {
            cache.parts().put(*name, 45, fetched());
        }
        assert_eq!(cache.get(names[0], true).unwrap(), "x");
        cache.parts().put(names[2], 45, fetched());
        assert!(cache.parts().take(names[1], true).is_none(), "the older part");
        assert!(cache.parts().take(names[0], true).is_some());
        // A part that exceeds the limit alone is kept until the next one.
        cache.parts().put(names[3], 200, fetched());
        assert_eq!(size_of(&cache), (1, 200));
        cache.parts().put(names[0], 45, fetched());
        assert_eq!(size_of(&cache), (1, 45));
    }
}
