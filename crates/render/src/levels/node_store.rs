//! File of coarse nodes.
//!
//! ```text
//! header  "VXLEVELS", version
//! record  level, index, version, bounds of its voxels, number of voxels, length, checksum of all; the node's bytes
//! ```
//!
//! A node is identified by its key and its version, a hash of all tiles below it. So a stored node can be obsolete but
//! never wrong: a file can be reused later, shared by states of a map, and truncated anywhere.

use super::node_key::{MAX_LEVEL, NodeKey};
use parking_lot::Mutex;
use rustc_hash::FxHashMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use voxtile::{Error, Result};

const HEADER: [u8; 16] = *b"VXLEVELS\x01\0\0\0\0\0\0\0";
const RECORD_BYTES: usize = 48;
/// Upper bound on the size of a node in bytes.
const MAX_BYTES: u32 = 1 << 27;

/// Nodes of all states of a map, in a permanent or temporary file.
pub struct NodeStore {
    spool: Mutex<Spool>,
    nodes: Mutex<Nodes>,
    /// Name of the file in errors.
    path: PathBuf,
}

/// Nodes by key and version.
type Nodes = FxHashMap<(NodeKey, u64), Stored>;

struct Spool {
    file: Box<dyn NodeFile>,
    end: u64,
    limit: Option<Limit>,
}

/// Any file or buffer in which nodes can be stored.
trait NodeFile: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> NodeFile for T {}

/// Maximum length of the file, and a function that empties it.
struct Limit {
    most_bytes: u64,
    empty: Box<dyn FnMut() -> io::Result<()> + Send>,
}

/// Location of a node in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stored {
    offset: u64,
    bytes: u32,
    /// Lowest and highest position of its voxels.
    pub(super) bounds: [[u8; 3]; 2],
    pub(super) voxels: u32,
}

impl NodeStore {
    /// Opens a store in a file that is open for reading and writing, empty or with nodes of an earlier store.
    /// Unreadable records are overwritten. `path` names the file in errors. No other process may use the file.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be read or written.
    pub fn open(
        mut file: impl Read + Write + Seek + Send + 'static,
        path: impl Into<PathBuf>,
    ) -> Result<Self> {
        let path = path.into();
        let (nodes, end) = read_all(&mut file).map_err(|error| Error::io(&path, "read", error))?;
        let spool = Mutex::new(Spool { file: Box::new(file), end, limit: None });
        Ok(Self { spool, nodes: Mutex::new(nodes), path })
    }

    /// Limits the size of the file: before it exceeds `most_bytes`, `empty` truncates it and the store starts again.
    /// Most nodes in it are obsolete by then, and all can be rebuilt.
    pub fn with_limit(self, most_bytes: u64, empty: impl FnMut() -> io::Result<()> + Send + 'static) -> Self {
        self.spool.lock().limit = Some(Limit { most_bytes, empty: Box::new(empty) });
        self
    }

    /// Returns the size of the file in bytes.
    pub fn bytes(&self) -> u64 {
        self.spool.lock().end
    }

    pub(super) fn find(&self, key: NodeKey, version: u64) -> Option<Stored> {
        self.nodes.lock().get(&(key, version)).copied()
    }

    /// Returns the bytes of a node; `None` if it is missing or damaged.
    pub(super) fn get(&self, key: NodeKey, version: u64) -> Result<Option<Vec<u8>>> {
        // Hold the lock for lookup and read, so that the file is not restarted in between.
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
        self.restart_if_full(&mut spool, record.len() as u64)?;
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

    /// Restarts the file if it would get too long.
    fn restart_if_full(&self, spool: &mut Spool, bytes: u64) -> Result<()> {
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

/// Reads the index of a file. Returns the nodes before the first incomplete record, and the end of the last complete
/// one.
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
        // The checksum is verified when the node is read.
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

/// Parses the header of a record; the caller adds the offset.
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
    fn a_file_is_restarted_before_it_exceeds_its_limit() {
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
            // The latest node is present even if the file was restarted.
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
