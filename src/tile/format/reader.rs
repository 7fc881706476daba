use super::trailer::Trailer;
use super::{ENTRY_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::space::{MortonCode, VoxelBox, VoxelKey};
use crate::tile::Table;
use std::io::{self, Read};

/// What `iwlo_meta.bin` holds.
#[derive(Debug)]
pub struct DecodedTable {
    /// The exact table.
    pub table: Table,
    /// The trailer; `None` for a file of the seed's own format, which cannot be verified.
    pub trailer: Option<Trailer>,
}

/// Reads an `iwlo_meta.bin` of `file_bytes` bytes that belongs to the tile of `voxels`.
///
/// With a trailer, entries must be in Morton order and the checksum must match. Without one any order is read.
///
/// # Errors
///
/// Anything that is not as the format says, with its offset: wrong magic or version, a count that does not fit the
/// length, keys of another tile, keys that come twice, values that are no evidence, a wrong checksum.
pub fn read_table(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
) -> Result<DecodedTable, DecodeError> {
    let mut crc = crc32fast::Hasher::new();
    let (count, trailer_bytes) = read_header(input, file_bytes, &mut crc)?;
    let mut entries = Entries::new(voxels, trailer_bytes > 0);
    let mut chunk = vec![0; 4096 * ENTRY_BYTES as usize];
    let mut done = 0;
    while done < count {
        let entries_here = (count - done).min(4096);
        let bytes = &mut chunk[..(entries_here * ENTRY_BYTES) as usize];
        input.read_exact(bytes)?;
        crc.update(bytes);
        for (number, entry) in (done..).zip(bytes.chunks_exact(ENTRY_BYTES as usize)) {
            entries.take(entry, HEADER_BYTES + number * ENTRY_BYTES)?;
        }
        done += entries_here;
    }
    let table = entries.into_table()?;
    if trailer_bytes == 0 {
        return Ok(DecodedTable { table, trailer: None });
    }
    let trailer = Trailer::read(input, HEADER_BYTES + count * ENTRY_BYTES, trailer_bytes)?;
    if trailer.table_crc != crc.finalize() {
        return Err(FormatError::at_offset(0, "the entries do not match the checksum in the trailer").into());
    }
    Ok(DecodedTable { table, trailer: Some(trailer) })
}

/// Reads only what stands behind the entries of an `iwlo_meta.bin`; `None` for a file of the seed's own format. The
/// entries are passed over and not looked at.
///
/// # Errors
///
/// A header or a trailer that is not as the format says.
pub fn read_trailer(input: &mut impl Read, file_bytes: u64) -> Result<Option<Trailer>, DecodeError> {
    let (count, trailer_bytes) = read_header(input, file_bytes, &mut crc32fast::Hasher::new())?;
    if trailer_bytes == 0 {
        return Ok(None);
    }
    io::copy(&mut input.take(count * ENTRY_BYTES), &mut io::sink())?;
    Trailer::read(input, HEADER_BYTES + count * ENTRY_BYTES, trailer_bytes).map(Some)
}

/// The count of entries, checked against the length of the file, and the number of bytes that follow them.
fn read_header(
    input: &mut impl Read,
    file_bytes: u64,
    crc: &mut crc32fast::Hasher,
) -> Result<(u64, u64), DecodeError> {
    let wrong = |offset, reason: String| Err(FormatError::at_offset(offset, reason).into());
    if file_bytes < HEADER_BYTES {
        return wrong(0, format!("{file_bytes} bytes are too few for the header of {HEADER_BYTES}"));
    }
    let mut header = [0; HEADER_BYTES as usize];
    input.read_exact(&mut header)?;
    crc.update(&header);
    let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
    if u32_at(0) != MAGIC {
        return wrong(0, format!("the magic number is {:#010x}, not {MAGIC:#010x}", u32_at(0)));
    }
    if u32_at(4) != VERSION {
        return wrong(4, format!("version {} is not known; this program reads version {VERSION}", u32_at(4)));
    }
    let count = u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32;
    let after_header = file_bytes - HEADER_BYTES;
    let Some(after_entries) =
        count.checked_mul(ENTRY_BYTES).and_then(|bytes| after_header.checked_sub(bytes))
    else {
        return wrong(8, format!("a count of {count} entries does not fit into {file_bytes} bytes"));
    };
    Ok((count, after_entries))
}

/// Voxels of a brick.
const BRICK_VOXELS: usize = 512;

/// Decodes entries into a table, brick by brick.
struct Entries<'a> {
    voxels: &'a VoxelBox,
    must_ascend: bool,
    table: Table,
    /// The entries of one brick, with their offsets.
    run: Vec<(MortonCode, Evidence, u64)>,
    /// The same as the table takes them: place and evidence.
    voxels_of_run: Vec<(usize, Evidence)>,
}

impl<'a> Entries<'a> {
    fn new(voxels: &'a VoxelBox, must_ascend: bool) -> Self {
        let (run, voxels_of_run) = (Vec::with_capacity(512), Vec::with_capacity(512));
        Self { voxels, must_ascend, table: Table::default(), run, voxels_of_run }
    }

    fn take(&mut self, entry: &[u8], offset: u64) -> Result<(), FormatError> {
        let key =
            VoxelKey(std::array::from_fn(|axis| u16::from_le_bytes([entry[2 * axis], entry[2 * axis + 1]])));
        let log_odds = f64::from_le_bytes(std::array::from_fn(|k| entry[6 + k]));
        let observation_count = i32::from_le_bytes(std::array::from_fn(|k| entry[14 + k]));
        let wrong = |at, reason| Err(FormatError::at_offset(offset + at, reason));
        if !self.voxels.contains(key.to_index_from(self.voxels.min)) {
            return wrong(0, format!("key {:?} belongs to another tile", key.0));
        }
        if !log_odds.is_finite() {
            return wrong(6, format!("log-odds {log_odds} are not finite"));
        }
        if observation_count < 0 {
            return wrong(14, format!("observation count {observation_count} is negative"));
        }
        let code = key.morton();
        if let Some(&(previous, ..)) = self.run.last() {
            if self.must_ascend && previous >= code {
                return wrong(0, format!("key {:?} is not in Morton order", key.0));
            }
            if previous.brick() != code.brick() {
                self.end_run()?;
            }
        }
        if self.run.len() >= BRICK_VOXELS {
            return wrong(0, format!("key {:?} or another of its 8 x 8 x 8 voxels comes twice", key.0));
        }
        self.run.push((code, Evidence { log_odds, observation_count }, offset));
        Ok(())
    }

    /// Moves the run into the table, all voxels of the brick at once.
    fn end_run(&mut self) -> Result<(), FormatError> {
        let Some(&(first, ..)) = self.run.first() else { return Ok(()) };
        self.run.sort_unstable_by_key(|&(code, _, offset)| (code, offset));
        let in_run = self.run.windows(2).find(|pair| pair[0].0 == pair[1].0).map(|pair| pair[1].2);
        let in_table = || {
            let known = |&&(code, ..): &&(MortonCode, Evidence, u64)| self.table.get(code).is_some();
            let may_be = self.table.has_brick(first.brick());
            may_be.then(|| self.run.iter().find(known)).flatten().map(|&(.., offset)| offset)
        };
        if let Some(offset) = in_run.or_else(in_table) {
            return Err(FormatError::at_offset(offset, "the key comes twice"));
        }
        self.voxels_of_run.clear();
        self.voxels_of_run
            .extend(self.run.iter().map(|&(code, evidence, _)| (code.place_in_brick(), evidence)));
        self.table.insert(first.brick(), &self.voxels_of_run);
        self.run.clear();
        Ok(())
    }

    fn into_table(mut self) -> Result<Table, FormatError> {
        self.end_run()?;
        Ok(self.table)
    }
}
