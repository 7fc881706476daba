use crate::spill::{Bytes, Complaint, FilePart, Record, SpillFile, StreamSize};
use std::cmp::Ordering;
use std::io::Read;
use std::sync::Arc;
use voxtile::{Error, Result};

/// Location of a chunk: a part of a file whose messages are read together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChunkPlace {
    /// Offset in the file.
    pub(super) offset: u64,
    /// Size in the file. A truncated file has fewer bytes.
    pub(super) bytes: u64,
    /// Lower bound for the times of its messages.
    pub(super) start_ns: i64,
    /// Topics with messages in the chunk; `None` if unknown. Chunks share these lists.
    pub(super) topics: Option<Arc<[usize]>>,
    /// Whether the bytes are plain records of the file, without a chunk header and compression.
    pub(super) is_bare: bool,
}

/// A chunk with its messages located.
#[derive(Debug, Default)]
pub(super) struct OpenChunk {
    pub(super) bytes: Bytes,
    /// Damage found. Messages before it are valid. If the chunk is broken, no message is used, because any byte may be
    /// wrong.
    pub(super) complaint: Option<Complaint>,
}

impl OpenChunk {
    /// Returns whether any byte may be wrong.
    pub(super) fn is_broken(&self) -> bool {
        self.complaint.as_ref().is_some_and(|complaint| complaint.is_broken)
    }

    /// Records that no record starts at the expected place, unless damage was recorded before.
    pub(super) fn note(complaint: &mut Option<Complaint>, reason: String) {
        complaint.get_or_insert(Complaint { reason, is_broken: false });
    }
}

/// Location of a message in a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MessagePlace {
    pub(super) log_ns: i64,
    pub(super) start: u64,
    pub(super) len: u64,
    pub(super) topic: usize,
}

impl Record for MessagePlace {
    const BYTES: usize = 32;

    fn encode(&self, bytes: &mut [u8]) {
        let numbers = [self.log_ns.cast_unsigned(), self.start, self.len, self.topic as u64];
        for (to, from) in bytes.iter_mut().zip(numbers.into_iter().flat_map(u64::to_le_bytes)) {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (numbers, _) = bytes.as_chunks::<8>();
        let number = |k: usize| numbers.get(k).copied().map_or(0, u64::from_le_bytes);
        let topic = usize::try_from(number(3)).unwrap_or(usize::MAX);
        Self { log_ns: number(0).cast_signed(), start: number(1), len: number(2), topic }
    }

    fn order(&self, other: &Self) -> Ordering {
        (self.log_ns, self.start).cmp(&(other.log_ns, other.start))
    }
}

/// Limit for a chunk, even in a temporary file.
pub(super) const MAX_CHUNK_BYTES: u64 = 1 << 30;

/// Advice for a zstd window that is too large.
const WINDOW_HINT: &str =
    "raise `memory`, or compress it with a smaller window (zstd without --long and --ultra)";

/// Decompresses a stream as far as possible, and returns the reason if it is incomplete. `see` receives the bytes in
/// order.
pub(super) fn decompress(
    compression: &str,
    input: impl Read,
    size: StreamSize,
    spill: &mut SpillFile,
    memory_bytes: usize,
    see: &mut dyn FnMut(&[u8]),
) -> Result<(Bytes, Option<Complaint>)> {
    let bare = |reason: String| Complaint { reason, is_broken: false };
    let (plain, complaint) = match compression {
        "bz2" => spill.take(bzip2::read::BzDecoder::new(input), size, memory_bytes, see)?,
        "lz4" => spill.take(lz4_flex::frame::FrameDecoder::new(input), size, memory_bytes, see)?,
        "zstd" => match unpacker(input, spill) {
            Ok(decoder) => {
                let (plain, complaint) = spill.take(decoder, size, memory_bytes, see)?;
                // The library reports a too large window with this text.
                let hinted = complaint.map(|complaint| match complaint.reason.contains("too much memory") {
                    true => Complaint { reason: format!("{}: {WINDOW_HINT}", complaint.reason), ..complaint },
                    false => complaint,
                });
                (plain, hinted)
            }
            Err(error) => (Bytes::default(), Some(bare(error.to_string()))),
        },
        other => {
            let reason = format!("compression `{other}` is not supported; supported: none, bz2, lz4, zstd");
            (Bytes::default(), Some(bare(reason)))
        }
    };
    let complaint = complaint.or_else(|| match size {
        StreamSize::Claimed(claimed) => {
            let missing = claimed.saturating_sub(plain.len());
            (missing > 0).then(|| bare(format!("{missing} of {claimed} bytes are missing")))
        }
        StreamSize::AtMost(_) => None,
    });
    Ok((plain, complaint))
}

/// Returns the bytes of an uncompressed chunk: in memory, or as a part of the file if large.
pub(super) fn plain(
    part: FilePart,
    memory_bytes: usize,
    input: &mut dyn Read,
    see: &mut dyn FnMut(&[u8]),
) -> Result<(Bytes, Option<Complaint>)> {
    let fail = |error| Error::io(part.path(), "read", error);
    if part.len() <= memory_bytes as u64 {
        let mut taken = Vec::with_capacity(usize::try_from(part.len()).unwrap_or(0));
        input.read_to_end(&mut taken).map_err(fail)?;
        see(&taken);
        return Ok((Bytes::Memory(taken), None));
    }
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = input.read(&mut buffer).map_err(fail)?;
        if count == 0 {
            return Ok((Bytes::File(part), None));
        }
        see(buffer.get(..count).unwrap_or_default());
    }
}

/// Creates a zstd decoder. Its memory, as stated by the frame, is limited.
pub(super) fn unpacker<'i, R: Read + 'i>(input: R, spill: &SpillFile) -> std::io::Result<Box<dyn Read + 'i>> {
    let mut decoder = zstd::stream::read::Decoder::new(input)?;
    decoder.window_log_max(spill.budget().window_log())?;
    Ok(Box::new(decoder))
}
