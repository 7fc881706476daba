use super::file_part::FilePart;
use voxtile::Result;

/// Bytes in memory or in a file.
#[derive(Clone, Debug)]
pub(crate) enum Bytes {
    Memory(Vec<u8>),
    File(FilePart),
}

/// Number of bytes to read from a file at once.
const WINDOW_BYTES: u64 = 1 << 16;

/// Cached range of a file.
#[derive(Debug, Default)]
pub(crate) struct Window {
    start: u64,
    bytes: Vec<u8>,
}

impl Default for Bytes {
    fn default() -> Self {
        Self::Memory(Vec::new())
    }
}

impl Bytes {
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File(part) => part.len(),
        }
    }

    /// Returns the memory in use, in bytes.
    pub(crate) fn in_memory(&self) -> usize {
        match self {
            Self::Memory(bytes) => bytes.capacity(),
            Self::File(_) => 0,
        }
    }

    /// Returns the bytes at an offset, or `None` if there are too few.
    pub(crate) fn piece<'a>(
        &'a self,
        at: u64,
        count: usize,
        window: &'a mut Window,
    ) -> Result<Option<&'a [u8]>> {
        let part = match self {
            Self::Memory(bytes) => {
                let start = usize::try_from(at).ok();
                return Ok(start.and_then(|start| bytes.get(start..start.checked_add(count)?)));
            }
            Self::File(part) => part,
        };
        if at.checked_add(count as u64).is_none_or(|end| end > part.len()) {
            return Ok(None);
        }
        let ahead = at.checked_sub(window.start).and_then(|ahead| usize::try_from(ahead).ok());
        let is_there = ahead.is_some_and(|ahead| ahead + count <= window.bytes.len());
        if !is_there {
            let bytes = (count as u64).max(WINDOW_BYTES).min(part.len() - at);
            // At most a window or the requested size.
            window.bytes.resize(bytes as usize, 0);
            window.start = at;
            part.read_at(at, &mut window.bytes)?;
        }
        let start = (at - window.start) as usize;
        Ok(window.bytes.get(start..start + count))
    }
}
