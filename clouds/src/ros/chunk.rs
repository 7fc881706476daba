use std::ops::Range;

/// A part of a file whose messages are read together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChunkPlace {
    /// Bytes of the file before it.
    pub(super) offset: u64,
    /// Its bytes in the file; fewer are there if it is cut off.
    pub(super) bytes: u64,
    /// No message of it is earlier.
    pub(super) start_ns: i64,
    /// The topics that it has messages of; `None` if that is not known.
    pub(super) topics: Option<Vec<usize>>,
    /// Its bytes are records of the file itself, not compressed and without a frame.
    pub(super) is_bare: bool,
}

/// A chunk in memory.
#[derive(Debug, Default)]
pub(super) struct OpenChunk {
    pub(super) bytes: Vec<u8>,
    pub(super) messages: Vec<MessagePlace>,
    /// What is wrong with it; its messages are those before the bad place.
    pub(super) complaint: Option<String>,
}

/// A message in a chunk.
#[derive(Clone, Debug)]
pub(super) struct MessagePlace {
    pub(super) log_ns: i64,
    pub(super) topic: usize,
    pub(super) range: Range<usize>,
}

/// A chunk that takes more bytes is not read.
pub(super) const MOST_CHUNK_BYTES: u64 = 1 << 30;

/// Reads all of a stream, at most so many bytes; what came before an error is kept.
pub(super) fn read_all(input: impl std::io::Read, most_bytes: u64) -> (Vec<u8>, Option<String>) {
    use std::io::Read;
    let mut bytes = Vec::new();
    let result = input.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes);
    let complaint = match result {
        Err(error) => Some(error.to_string()),
        Ok(read) if read as u64 > most_bytes => {
            Some(format!("it holds more than the {most_bytes} bytes that it claims"))
        }
        Ok(_) => None,
    };
    bytes.truncate(usize::try_from(most_bytes).unwrap_or(usize::MAX));
    (bytes, complaint)
}

/// The bytes of a compressed chunk, as far as they can be had, and why not all.
pub(super) fn decompress(compression: &str, bytes: Vec<u8>, claimed: u64) -> (Vec<u8>, Option<String>) {
    let (plain, complaint) = match compression {
        "" | "none" => return (bytes, None),
        "bz2" => read_all(bzip2::read::BzDecoder::new(bytes.as_slice()), claimed),
        "lz4" => read_all(lz4_flex::frame::FrameDecoder::new(bytes.as_slice()), claimed),
        "zstd" => match zstd::stream::read::Decoder::new(bytes.as_slice()) {
            Ok(decoder) => read_all(decoder, claimed),
            Err(error) => (Vec::new(), Some(error.to_string())),
        },
        other => {
            (Vec::new(), Some(format!("compression `{other}` is not known; known: none, bz2, lz4, zstd")))
        }
    };
    let complaint = complaint.or_else(|| {
        let missing = claimed.saturating_sub(plain.len() as u64);
        (missing > 0).then(|| format!("{missing} of {claimed} bytes are missing"))
    });
    (plain, complaint)
}
