use crate::error::FormatError;
use crate::space::put_number;
use integer_encoding::VarInt;
use std::io;
use zstd::zstd_safe::{CCtx, CParameter, DCtx, compress_bound, get_error_name};

/// Encoding of a plane.
const STORED: u8 = 0;
const COMPRESSED: u8 = 1;
const CONSTANT: u8 = 2;
/// Bytes grouped by the next higher byte of their words.
const GROUPED: u8 = 3;

/// Compression level of zstd. It is fast, and compresses these planes as well as higher levels do.
const LEVEL: i32 = 1;
/// Minimum number of bytes in a group. Smaller groups are merged, because each group has its own entropy table.
const MIN_GROUP: usize = 1024;
/// Approximate size of such a table in bytes.
const TABLE_BYTES: f64 = 80.0;
/// Entropy in bits per byte above which bytes are stored uncompressed.
const NOISE_BITS: f64 = 7.85;
/// Number of consecutive bytes in a part of a sample, and maximum number of parts, evenly distributed over the plane.
const PART: usize = 1024;
const PARTS: usize = 8;

/// Writes words as planes of bytes, the most significant first.
#[derive(Default)]
pub(super) struct PlaneWriter {
    zstd: Option<CCtx<'static>>,
    compressed: Vec<u8>,
    above: Vec<u8>,
    plane: Vec<u8>,
    grouped: Vec<u8>,
    counts: Vec<u32>,
    halves: Vec<u32>,
}

impl PlaneWriter {
    /// Appends single bytes.
    pub(super) fn put_bytes(&mut self, bytes: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
        self.put_plane(bytes, None, out)
    }

    pub(super) fn put(&mut self, words: &[u64], bytes: usize, out: &mut Vec<u8>) -> io::Result<()> {
        let (mut plane, mut above) = (std::mem::take(&mut self.plane), std::mem::take(&mut self.above));
        // Transposing words of half the width takes half the time.
        self.halves.clear();
        if bytes <= 4 {
            self.halves.extend(words.iter().map(|word| *word as u32));
        }
        for byte in (0..bytes).rev() {
            plane.clear();
            match bytes <= 4 {
                true => plane.extend(self.halves.iter().map(|word| (word >> (8 * byte)) as u8)),
                false => plane.extend(words.iter().map(|word| (word >> (8 * byte)) as u8)),
            }
            // The next higher byte is most informative for the second plane: it predicts mantissas from exponents.
            let above_it = (byte + 2 == bytes).then_some(&*above);
            self.put_plane(&plane, above_it, out)?;
            std::mem::swap(&mut plane, &mut above);
        }
        (self.plane, self.above) = (plane, above);
        Ok(())
    }

    fn put_plane(&mut self, plane: &[u8], above: Option<&[u8]>, out: &mut Vec<u8>) -> io::Result<()> {
        let Some(&first) = plane.first() else { return Ok(()) };
        if plane.iter().fold(0, |others, byte| others | (byte ^ first)) == 0 {
            out.extend([CONSTANT, first]);
            return Ok(());
        }
        let bits = sampled_entropy(plane);
        let noise_bits = NOISE_BITS * plane.len() as f64;
        if let Some((above, groups)) = above.map(|above| (above, Groups::of(above)))
            && self.bits_by_group(plane, above, &groups) < bits.min(noise_bits)
        {
            out.push(GROUPED);
            return self.put_groups(plane, above, &groups, out);
        }
        if bits < noise_bits {
            let length = self.compress(plane)?;
            if length < plane.len() {
                out.push(COMPRESSED);
                put_number(length as u64, out);
                out.extend_from_slice(&self.compressed[..length]);
                return Ok(());
            }
        }
        out.push(STORED);
        out.extend_from_slice(plane);
        Ok(())
    }

    /// Entropy in bits of a plane given the higher bytes, plus the size of the groups' tables.
    fn bits_by_group(&mut self, plane: &[u8], above: &[u8], groups: &Groups) -> f64 {
        if groups.groups == 1 {
            return f64::INFINITY;
        }
        self.counts.clear();
        self.counts.resize(groups.groups << 8, 0);
        for (byte, above) in plane.iter().zip(above) {
            self.counts[usize::from(groups.of_byte[usize::from(*above)]) << 8 | usize::from(*byte)] += 1;
        }
        let of_groups = self.counts.chunks_exact(256).map(|counts| entropy(counts, counts.iter().sum()));
        of_groups.sum::<f64>() + 8.0 * TABLE_BYTES * groups.groups as f64
    }

    fn put_groups(
        &mut self,
        plane: &[u8],
        above: &[u8],
        groups: &Groups,
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        let mut grouped = std::mem::take(&mut self.grouped);
        grouped.clear();
        grouped.resize(plane.len(), 0);
        let mut next = groups.starts;
        for (byte, above) in plane.iter().zip(above) {
            let at = &mut next[usize::from(groups.of_byte[usize::from(*above)])];
            grouped[*at] = *byte;
            *at += 1;
        }
        let mut start = 0;
        for end in groups.ends() {
            let group = &grouped[start..end];
            start = end;
            let length = if group.is_empty() { 0 } else { self.compress(group)? };
            if length < group.len() {
                put_number(length as u64, out);
                out.extend_from_slice(&self.compressed[..length]);
            } else {
                put_number(group.len() as u64, out);
                out.extend_from_slice(group);
            }
        }
        self.grouped = grouped;
        Ok(())
    }

    /// Compresses bytes into the output buffer; returns their compressed size.
    pub(super) fn compress(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let zstd = match &mut self.zstd {
            Some(zstd) => zstd,
            none => none.insert(compressor()?),
        };
        let bound = compress_bound(bytes.len());
        if self.compressed.len() < bound {
            self.compressed.resize(bound, 0);
        }
        zstd.compress2(&mut self.compressed[..bound], bytes).map_err(refused)
    }
}

/// Assignment of bytes to groups: one for each frequent higher byte, and a last one for the others.
struct Groups {
    of_byte: [u16; 256],
    starts: [usize; 257],
    groups: usize,
    bytes: usize,
}

impl Groups {
    fn of(above: &[u8]) -> Self {
        let counts = histogram(above);
        let is_own = |byte: usize| counts[byte] as usize >= MIN_GROUP;
        let groups = (0..256).filter(|&byte| is_own(byte)).count() + 1;
        let (mut of_byte, mut starts, mut next, mut start) = ([groups as u16 - 1; 256], [0; 257], 0, 0);
        for byte in (0..256).filter(|&byte| is_own(byte)) {
            of_byte[byte] = next;
            starts[usize::from(next)] = start;
            next += 1;
            start += counts[byte] as usize;
        }
        starts[groups - 1] = start;
        Self { of_byte, starts, groups, bytes: above.len() }
    }

    fn ends(&self) -> impl Iterator<Item = usize> {
        (1..=self.groups).map(|group| if group < self.groups { self.starts[group] } else { self.bytes })
    }
}

fn histogram(plane: &[u8]) -> [u32; 256] {
    // Separate counters avoid dependencies between adjacent equal bytes.
    let mut counts = [[0_u32; 256]; 4];
    let (chunks, rest) = plane.as_chunks::<4>();
    for chunk in chunks {
        for (counts, byte) in counts.iter_mut().zip(chunk) {
            counts[usize::from(*byte)] += 1;
        }
    }
    rest.iter().for_each(|byte| counts[0][usize::from(*byte)] += 1);
    std::array::from_fn(|byte| counts.iter().map(|counts| counts[byte]).sum())
}

/// Estimates the total entropy in bits from a sample.
fn sampled_entropy(plane: &[u8]) -> f64 {
    let chunks = plane.len().div_ceil(PART);
    let mut counts = [0; 256];
    let mut all = 0;
    for part in plane.chunks(PART).step_by(chunks.div_ceil(PARTS).max(1)) {
        counts.iter_mut().zip(histogram(part)).for_each(|(all, of_part)| *all += of_part);
        all += part.len();
    }
    entropy(&counts, all as u32) * plane.len() as f64 / all as f64
}

/// Total entropy in bits.
fn entropy(counts: &[u32], all: u32) -> f64 {
    let all = f64::from(all);
    let bits =
        |&count: &u32| if count == 0 { 0.0 } else { f64::from(count) * (all / f64::from(count)).log2() };
    counts.iter().map(bits).sum()
}

#[derive(Default)]
pub(super) struct PlaneReader {
    zstd: Option<DCtx<'static>>,
    above: Vec<u8>,
    plane: Vec<u8>,
    grouped: Vec<u8>,
}

impl PlaneReader {
    /// Reads words of `bytes` bytes; replaces the content of the list, but keeps its length.
    pub(super) fn take(
        &mut self,
        words: &mut [u64],
        bytes: usize,
        input: &mut BlockInput<'_>,
    ) -> Result<(), FormatError> {
        words.fill(0);
        for byte in (0..bytes).rev() {
            self.plane.clear();
            self.plane.resize(words.len(), 0);
            if byte + 2 != bytes {
                self.above.clear();
            }
            self.take_plane(input)?;
            words.iter_mut().zip(&self.plane).for_each(|(word, byte)| *word = *word << 8 | u64::from(*byte));
            std::mem::swap(&mut self.plane, &mut self.above);
        }
        Ok(())
    }

    /// Reads single bytes; replaces the content of the list, but keeps its length.
    pub(super) fn take_bytes(
        &mut self,
        bytes: &mut Vec<u8>,
        input: &mut BlockInput<'_>,
    ) -> Result<(), FormatError> {
        std::mem::swap(&mut self.plane, bytes);
        self.above.clear();
        let taken = self.take_plane(input);
        std::mem::swap(&mut self.plane, bytes);
        taken
    }

    fn take_plane(&mut self, input: &mut BlockInput<'_>) -> Result<(), FormatError> {
        if self.plane.is_empty() {
            return Ok(());
        }
        match input.byte()? {
            STORED => {
                let bytes = input.bytes(self.plane.len())?;
                self.plane.copy_from_slice(bytes);
            }
            CONSTANT => self.plane.fill(input.byte()?),
            COMPRESSED => {
                let length = input.number()?;
                decompress(&mut self.zstd, input.bytes(length)?, &mut self.plane, input)?;
            }
            GROUPED if self.above.len() == self.plane.len() => self.take_groups(input)?,
            _ => return Err(input.wrong("a data block of unknown encoding")),
        }
        Ok(())
    }

    fn take_groups(&mut self, input: &mut BlockInput<'_>) -> Result<(), FormatError> {
        let groups = Groups::of(&self.above);
        self.grouped.clear();
        self.grouped.resize(self.plane.len(), 0);
        let mut start = 0;
        for end in groups.ends() {
            let group = &mut self.grouped[start..end];
            start = end;
            let length = input.number()?;
            let bytes = input.bytes(length)?;
            if length == group.len() {
                group.copy_from_slice(bytes);
            } else {
                decompress(&mut self.zstd, bytes, group, input)?;
            }
        }
        let mut next = groups.starts;
        for (byte, above) in self.plane.iter_mut().zip(&self.above) {
            let at = &mut next[usize::from(groups.of_byte[usize::from(*above)])];
            *byte = self.grouped[*at];
            *at += 1;
        }
        Ok(())
    }
}

fn decompress(
    zstd: &mut Option<DCtx<'static>>,
    bytes: &[u8],
    plane: &mut [u8],
    input: &BlockInput<'_>,
) -> Result<(), FormatError> {
    let zstd = match zstd {
        Some(zstd) => zstd,
        none => {
            none.insert(DCtx::try_create().ok_or_else(|| input.wrong("not enough memory for decompression"))?)
        }
    };
    match zstd.decompress(plane, bytes) {
        Ok(length) if length == plane.len() => Ok(()),
        _ => Err(input.wrong("a plane that cannot be decompressed")),
    }
}

/// Creates a compressor that omits headers and checksums.
fn compressor() -> io::Result<CCtx<'static>> {
    // Returns an error if memory is exhausted, where `zstd::bulk` would panic.
    let mut zstd = CCtx::try_create().ok_or(io::ErrorKind::OutOfMemory)?;
    for parameter in [
        CParameter::CompressionLevel(LEVEL),
        CParameter::ChecksumFlag(false),
        CParameter::ContentSizeFlag(false),
        CParameter::DictIdFlag(false),
    ] {
        zstd.set_parameter(parameter).map_err(refused)?;
    }
    Ok(zstd)
}

/// Converts an error of zstd, which most likely means that memory is exhausted.
fn refused(code: usize) -> io::Error {
    io::Error::other(get_error_name(code))
}

/// Input with the unread part of a block.
pub(super) struct BlockInput<'a> {
    block: &'a [u8],
    at: usize,
}

impl<'a> BlockInput<'a> {
    pub(super) fn new(block: &'a [u8]) -> Self {
        Self { block, at: 0 }
    }

    pub(super) fn wrong(&self, reason: &str) -> FormatError {
        FormatError::at_offset(self.at as u64, reason)
    }

    pub(super) fn bytes(&mut self, length: usize) -> Result<&'a [u8], FormatError> {
        let end = self.at.checked_add(length);
        let bytes = end.and_then(|end| self.block.get(self.at..end));
        let bytes = bytes.ok_or_else(|| self.wrong("a block of points ends early"))?;
        self.at += length;
        Ok(bytes)
    }

    pub(super) fn byte(&mut self) -> Result<u8, FormatError> {
        Ok(self.bytes(1)?.first().copied().unwrap_or_default())
    }

    pub(super) fn number(&mut self) -> Result<usize, FormatError> {
        let rest = self.block.get(self.at..).unwrap_or_default();
        let (number, length) = u64::decode_var(rest).ok_or_else(|| self.wrong("no number"))?;
        let number = usize::try_from(number).map_err(|_| self.wrong("a number that is too large"))?;
        self.at += length;
        Ok(number)
    }

    pub(super) fn double(&mut self) -> Result<f64, FormatError> {
        let bytes = self.bytes(8)?.try_into().unwrap_or_default();
        Ok(f64::from_le_bytes(bytes))
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at == self.block.len()
    }
}
