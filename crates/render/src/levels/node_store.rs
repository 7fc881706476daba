//! Coarse nodes that were made once.
//!
//! ```text
//! header  "VXLEVELS", version
//! record  level, index, version, box of its voxels, number of voxels, length, checksum of all of it; the node's bytes
//! ```
//!
//! A node is known by its key and its version, which is a hash of all tiles below it: what is here is never wrong, only
//! of no use any more. So a store can be kept for the next time, be shared by the states of a map, and be cut anywhere.

use super::node_key::{MAX_LEVEL, NodeKey};
use parking_lot::Mutex;
use rustc_hash::FxHashMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use voxtile::{Error, Result};

const HEADER: [u8; 16] = *b"VXLEVELS\x01\0\0\0\0\0\0\0";
const RECORD_BYTES: usize = 48;
/// More bytes than a node can have.
const MAX_BYTES: u32 = 1 << 27;

/// Nodes of any state of a map, in a file that may be kept for later or go with the program.
pub struct NodeStore {
    spool: Mutex<Spool>,
    nodes: Mutex<Nodes>,
    /// How errors name the file.
    path: PathBuf,
}

/// By key and version.
type Nodes = FxHashMap<(NodeKey, u64), Stored>;

struct Spool {
    file: Box<dyn Reopenable>,
    end: u64,
    limit: Option<Limit>,
}

/// A file that may be kept for the next time.
trait Reopenable: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> Reopenable for T {}

/// How long the file may be, and what empties it.
struct Limit {
    most_bytes: u64,
    empty: Box<dyn FnMut() -> io::Result<()> + Send>,
}

/// Where a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stored {
    offset: u64,
    bytes: u32,
    /// Of its voxels; the lowest and the highest place.
    pub(super) bounds: [[u8; 3]; 2],
    pub(super) voxels: u32,
}

impl NodeStore {
    /// A store in a file that is open for reading and writing: empty, or with what an earlier one left there. What
    /// cannot be read of it is overwritten. `path` is how errors name the file, which must be nobody else's meanwhile.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or written.
    pub fn open(
        mut file: impl Read + Write + Seek + Send + 'static,
        path: impl Into<PathBuf>,
    ) -> Result<Self> {
        let path = path.into();
        let (nodes, end) = read_all(&mut file).map_err(|error| Error::io(&path, "read", error))?;
        let spool = Mutex::new(Spool { file: Box::new(file), end, limit: None });
        Ok(Self { spool, nodes: Mutex::new(nodes), path })
    }

    /// The same with a file that has at most so many bytes: before it gets longer, `empty` empties it and it is begun
    /// anew. Most of it is of states that nobody looks at any more, and all of it can be made again.
    pub fn with_limit(self, most_bytes: u64, empty: impl FnMut() -> io::Result<()> + Send + 'static) -> Self {
        self.spool.lock().limit = Some(Limit { most_bytes, empty: Box::new(empty) });
        self
    }

    /// Bytes of the file.
    pub fn bytes(&self) -> u64 {
        self.spool.lock().end
    }

    pub(super) fn find(&self, key: NodeKey, version: u64) -> Option<Stored> {
        self.nodes.lock().get(&(key, version)).copied()
    }

    /// The bytes of a node; `None` if it is not here or no longer what it was.
    pub(super) fn get(&self, key: NodeKey, version: u64) -> Result<Option<Vec<u8>>> {
        // Nobody begins the file anew between the look for the node and the look at it.
        let mut spool = self.spool.lock();
        let Some(stored) = self.find(key, version) else { return Ok(None) };
        let mut record = vec![0; RECORD_BYTES + stored.bytes as usize];
        let start = stored.offset - RECORD_BYTES as u64;
        let read = spool.file.seek(SeekFrom::Start(start)).and_then(|_| spool.file.read_exact(&mut record));
        drop(spool);
        read.map_err(|error| Error::io(&self.path, "read", error))?;
        let is_right = parse(&record).is_some_and(|(found, _)| found == (key, version)) && is_whole(&record);
        if !is_right {
            self.nodes.lock().remove(&(key, version));
            return Ok(None);
        }
        Ok(Some(record.split_off(RECORD_BYTES)))
    }

    pub(super) fn put(
        &self,
        key: NodeKey,
        version: u64,
        bytes: &[u8],
        bounds: [[u8; 3]; 2],
        voxels: u32,
    ) -> Result<Stored> {
        let mut record = Vec::with_capacity(RECORD_BYTES + bytes.len());
        record.extend(u32::from(key.level).to_le_bytes());
        record.extend(key.index.map(i32::to_le_bytes).as_flattened());
        record.extend(version.to_le_bytes());
        record.extend(bounds.as_flattened());
        record.extend([0; 2]);
        record.extend(voxels.to_le_bytes());
        record.extend((bytes.len() as u32).to_le_bytes());
        record.extend([0; 8]);
        record.extend(bytes);
        let crc = checksum(&record);
        record[44..48].copy_from_slice(&crc.to_le_bytes());
        let mut spool = self.spool.lock();
        self.make_room(&mut spool, record.len() as u64)?;
        let start = spool.end;
        let written = (|| {
            spool.file.seek(SeekFrom::Start(start))?;
            if start == 0 {
                spool.file.write_all(&HEADER)?;
            }
            spool.file.write_all(&record)
        })();
        written.map_err(|error| Error::io(&self.path, "write", error))?;
        let start = if start == 0 { HEADER.len() as u64 } else { start };
        spool.end = start + record.len() as u64;
        let offset = start + RECORD_BYTES as u64;
        let stored = Stored { offset, bytes: bytes.len() as u32, bounds, voxels };
        self.nodes.lock().insert((key, version), stored);
        drop(spool);
        Ok(stored)
    }

    /// Begins the file anew if it would get too long.
    fn make_room(&self, spool: &mut Spool, bytes: u64) -> Result<()> {
        let end = spool.end.max(HEADER.len() as u64);
        let Some(limit) = spool.limit.as_mut().filter(|limit| end + bytes > limit.most_bytes) else {
            return Ok(());
        };
        self.nodes.lock().clear();
        (limit.empty)().map_err(|error| Error::io(&self.path, "empty", error))?;
        spool.end = 0;
        Ok(())
    }
}

/// Finds the nodes of a file, up to the first that is not whole, and where it ends.
fn read_all(file: &mut (impl Read + Seek)) -> io::Result<(Nodes, u64)> {
    let mut nodes = Nodes::default();
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(0))?;
    let mut file = io::BufReader::new(file);
    let mut header = [0; HEADER.len()];
    if length < HEADER.len() as u64 || file.read_exact(&mut header).is_err() || header != HEADER {
        return Ok((nodes, 0));
    }
    let mut end = HEADER.len() as u64;
    let mut record = [0; RECORD_BYTES];
    while end + RECORD_BYTES as u64 <= length {
        file.read_exact(&mut record)?;
        let Some((node, stored)) = parse(&record) else { break };
        let offset = end + RECORD_BYTES as u64;
        if offset + u64::from(stored.bytes) > length {
            break;
        }
        // The checksum is looked at when the node is read.
        nodes.insert(node, Stored { offset, ..stored });
        end = offset + u64::from(stored.bytes);
        file.seek_relative(i64::from(stored.bytes))?;
    }
    Ok((nodes, end))
}

fn checksum(record: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&record[..44]);
    hasher.update(&record[RECORD_BYTES..]);
    hasher.finalize()
}

fn is_whole(record: &[u8]) -> bool {
    record[44..48] == checksum(record).to_le_bytes()
}

/// The head of a record; the offset is not in it.
fn parse(record: &[u8]) -> Option<((NodeKey, u64), Stored)> {
    let word = |at: usize| Some(u32::from_le_bytes(record.get(at..at + 4)?.try_into().ok()?));
    let level = u8::try_from(word(0)?).ok().filter(|&level| level <= MAX_LEVEL)?;
    let key = NodeKey { level, index: [word(4)? as i32, word(8)? as i32, word(12)? as i32] };
    let version = u64::from(word(16)?) | u64::from(word(20)?) << 32;
    let bounds = [record.get(24..27)?.try_into().ok()?, record.get(27..30)?.try_into().ok()?];
    let (voxels, bytes) = (word(32)?, word(36)?);
    (bytes <= MAX_BYTES).then_some(((key, version), Stored { offset: 0, bytes, bounds, voxels }))
}

impl std::fmt::Debug for NodeStore {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NodeStore")
            .field("path", &self.path)
            .field("bytes", &self.bytes())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: u64 = 4096;

    fn key_of(number: i32) -> NodeKey {
        NodeKey { level: 1, index: [number, 0, -number] }
    }

    #[test]
    fn a_file_that_would_get_too_long_is_begun_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nodes");
        let open = || {
            let options =
                std::fs::OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let file = options.unwrap();
            let same = file.try_clone().unwrap();
            NodeStore::open(file, &path).unwrap().with_limit(MOST, move || same.set_len(0))
        };
        let store = open();
        for number in 0..100 {
            let bytes = vec![number as u8; 100 + number as usize];
            store.put(key_of(number), 7, &bytes, [[0; 3]; 2], 1).unwrap();
            // What was put last is there, whatever went.
            assert_eq!(store.get(key_of(number), 7).unwrap(), Some(bytes));
            assert!(store.bytes() <= MOST && std::fs::metadata(&path).unwrap().len() <= MOST, "{number}");
        }
        assert_eq!(store.get(key_of(0), 7).unwrap(), None);
        let there =
            |store: &NodeStore| (0..100).filter(|&k| store.get(key_of(k), 7).unwrap().is_some()).count();
        let kept = there(&store);
        assert!(kept > 1 && store.nodes.lock().len() == kept);
        drop(store);
        assert_eq!(there(&open()), kept);
    }
}
