//! Section of a tile's file with the layers of its hit voxels, after the table.
//!
//! ```text
//! header   20 bytes   magic "VXTL", version, length and CRC-32 of the rest
//! layers    1 byte    set of the layers, and the largest intensity if there is one
//! columns             codes of bricks, masks of their hit voxels, one column per integer of a voxel, votes
//! ```
//!
//! The bytes depend only on the layers' content, not on the order in which points were added.

use super::CRC_BYTES;
use super::column_reader::{Column, ColumnReader};
use super::column_writer::ColumnWriter;
use super::input::Input;
use super::numbers::{put_number, take_number};
use crate::config::Layers;
use crate::error::{DecodeError, FormatError};
use crate::space::{BRICK_EDGE, BrickCode, BrickMask, MortonCode, VoxelBox, places};
use crate::tile::layers::{COLUMNS, ClassVotes, LayerTable, Row, columns_of};
use std::io::{self, Read};

/// "VXTL", little-endian.
const MAGIC: u32 = 0x4c54_5856;
const VERSION: u32 = 1;
const HEADER_BYTES: usize = 20;

/// Maximum size of a number in a column.
const MAX_NUMBER_BYTES: usize = 10;

/// Returns the section of a table's layers.
pub(super) fn layer_section(table: &LayerTable, writer: &mut ColumnWriter) -> io::Result<Vec<u8>> {
    let mut columns = Encoded::default();
    columns.take(table);
    let mut out = vec![0; HEADER_BYTES];
    let Layers { colour, intensity_max, class, time, shape } = table.layers();
    let set = [colour, intensity_max.is_some(), class, time, shape];
    out.push((0..5).fold(0, |bits, k| bits | u8::from(set[k]) << k));
    intensity_max.iter().for_each(|max| out.extend(max.to_le_bytes()));
    put_number(columns.bricks, &mut out);
    writer.put_columns([&columns.codes, &columns.masks], &mut out)?;
    for column in &columns.integers {
        writer.put_columns([column], &mut out)?;
    }
    writer.put_columns([&columns.others], &mut out)?;
    let payload = &out[HEADER_BYTES..];
    let (length, crc) = (payload.len() as u64, crc32fast::hash(payload));
    out[0..4].copy_from_slice(&MAGIC.to_le_bytes());
    out[4..8].copy_from_slice(&VERSION.to_le_bytes());
    out[8..16].copy_from_slice(&length.to_le_bytes());
    out[16..20].copy_from_slice(&crc.to_le_bytes());
    Ok(out)
}

#[derive(Default)]
struct Encoded {
    bricks: u64,
    codes: Vec<u8>,
    masks: Vec<u8>,
    /// Each integer of the voxels, in Morton order.
    integers: [Vec<u8>; COLUMNS],
    /// Votes for other classes than the main one: steps from voxel to voxel, class and votes.
    others: Vec<u8>,
}

impl Encoded {
    fn take(&mut self, table: &LayerTable) {
        let mut before = 0;
        for (BrickCode(code), mask) in table.masks() {
            self.bricks += 1;
            put_number(code - before, &mut self.codes);
            before = code;
            mask.iter().for_each(|word| self.masks.extend(word.to_le_bytes()));
        }
        let layers = table.layers();
        // Times are relative to that of the voxel before.
        let (mut time_ns, mut number, mut voted) = (0, 0_u64, 0);
        let used = columns_of(&layers);
        table.for_each_row(|row, base_ns, others| {
            let mut row = *row;
            if layers.time {
                let time = row.time(base_ns);
                row.set_time(time_ns, time);
                time_ns = time.map_or(time_ns, |time| time.first_ns);
            }
            for &column in &used {
                let (integer, out) = (row.0[column], &mut self.integers[column]);
                // A column of zeros, such as those of absent layers, takes no bytes.
                if integer > 0 && out.is_empty() {
                    out.resize(number as usize, 0);
                }
                if integer > 0 || !out.is_empty() {
                    put_number(integer, out);
                }
            }
            for &ClassVotes { class, votes } in others {
                put_number(number - voted, &mut self.others);
                self.others.push(class);
                put_number(votes, &mut self.others);
                voted = number;
            }
            number += 1;
        });
    }
}

/// Reads a section of `bytes` bytes that belongs to the tile of `tile`. Damaged bytes cannot add voxels outside the
/// tile, or take more memory than its voxels could need.
///
/// # Errors
///
/// Fails if the section violates the format; the error contains the offset.
pub fn read_layer_section(
    input: &mut impl Read,
    bytes: u64,
    tile: &VoxelBox,
) -> Result<LayerTable, DecodeError> {
    let wrong = |offset, reason: &str| Err(FormatError::at_offset(offset, reason).into());
    if bytes < HEADER_BYTES as u64 {
        return wrong(0, "too few bytes for a section of layers");
    }
    let mut header = [0; HEADER_BYTES];
    input.read_exact(&mut header)?;
    let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
    if (u32_at(0), u32_at(4)) != (MAGIC, VERSION) {
        return wrong(0, "not a section of layers of version 1");
    }
    let length = u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32;
    if length != bytes - HEADER_BYTES as u64 {
        return wrong(8, "the section of layers has another length");
    }
    let crc = u32_at(16).to_le_bytes();
    let input = Input::new(input.take(length).chain(&crc[..]), length + CRC_BYTES);
    read_payload(input, tile).map_err(|error| match error.further_by(HEADER_BYTES as u64) {
        DecodeError::Format(FormatError { at, reason, .. }) => {
            FormatError::at_offset(at, format!("the layers are damaged: {reason}")).into()
        }
        error => error,
    })
}

fn read_payload(mut input: Input<impl Read>, tile: &VoxelBox) -> Result<LayerTable, DecodeError> {
    let layers = read_layers(&mut input)?;
    let bricks_along =
        |k: usize| (i64::from(tile.end[k]) - i64::from(tile.min[k])) as usize / BRICK_EDGE as usize + 2;
    let bricks = input.number("number of bricks with layers", (0..3).map(bricks_along).product())?;
    let mut reader = ColumnReader::new()?;
    let (mut codes, mut masks) = (Vec::new(), Vec::new());
    let offset = input.offset;
    let max_bytes = bricks * MAX_NUMBER_BYTES;
    let columns = [
        Column { name: "codes of bricks with layers", max_bytes, bytes: &mut codes },
        Column { name: "masks of hit voxels", max_bytes: bricks * size_of::<BrickMask>(), bytes: &mut masks },
    ];
    reader.take_columns(columns, &mut input)?;
    let at = |offset, reason: &'static str| FormatError::at_offset(offset, reason);
    let bricks = bricks_of(bricks, &codes, &masks)
        .ok_or_else(|| at(offset, "the bricks of layers are not in order"))?;
    let voxels: usize = bricks.iter().flat_map(|(_, mask)| mask).map(|word| word.count_ones() as usize).sum();
    let offset = input.offset;
    let mut integers: [Vec<u8>; COLUMNS] = Default::default();
    for bytes in &mut integers {
        let max_bytes = voxels * MAX_NUMBER_BYTES;
        reader
            .take_columns([Column { name: "size of a column of integers", max_bytes, bytes }], &mut input)?;
    }
    let mut others = Vec::new();
    // A voxel has at most 256 classes: two numbers and a byte each.
    let max_bytes = voxels.saturating_mul(256 * (2 * MAX_NUMBER_BYTES + 1));
    reader.take_columns([Column { name: "votes for classes", max_bytes, bytes: &mut others }], &mut input)?;
    input.end()?;

    let mut table = LayerTable::new(layers);
    let mut rows = Rows::new(&integers);
    let mut votes = Votes::new(&others);
    let (mut time_ns, mut number) = (0, 0_u64);
    for (code, mask) in bricks {
        for place in places(mask) {
            let voxel = code.voxel(place);
            let row = rows.next().ok_or_else(|| at(offset, "the integers of layers end too early"))?;
            let others =
                votes.of(number).ok_or_else(|| at(offset, "the votes for classes are not in order"))?;
            let made = row.checked_layers(time_ns, &layers, others);
            let made = made.filter(|_| is_in(tile, voxel));
            let made = made.ok_or_else(|| at(offset, "the layers of a voxel are impossible"))?;
            time_ns = made.time.map_or(time_ns, |time| time.first_ns);
            table.put(voxel, &made);
            number += 1;
        }
    }
    if !rows.is_at_end() || !votes.is_at_end() {
        return Err(at(offset, "data follow the layers of the last voxel").into());
    }
    Ok(table)
}

fn read_layers(input: &mut Input<impl Read>) -> Result<Layers, DecodeError> {
    let mut set = [0];
    input.read(&mut set)?;
    let has = |k: u8| set[0] >> k & 1 == 1;
    let mut layers =
        Layers { colour: has(0), intensity_max: None, class: has(2), time: has(3), shape: has(4) };
    if has(1) {
        let mut max = [0; 4];
        input.read(&mut max)?;
        layers.intensity_max = Some(f32::from_le_bytes(max));
    }
    if set[0] >> 5 != 0 || layers.validated().is_err() {
        return Err(input.wrong("unknown layers"));
    }
    Ok(layers)
}

fn is_in(tile: &VoxelBox, voxel: MortonCode) -> bool {
    tile.contains(voxel.to_key().to_index_from(tile.min))
}

/// Returns the bricks in ascending order, each with a voxel; `None` if the columns do not contain that.
fn bricks_of(count: usize, mut codes: &[u8], masks: &[u8]) -> Option<Vec<(BrickCode, BrickMask)>> {
    let (words, []) = masks.as_chunks::<8>() else { return None };
    let mut bricks = Vec::with_capacity(count);
    let mut before = None;
    for mask in words.chunks_exact(8) {
        let step = take_from(&mut codes)?;
        let code = before.map_or(Some(step), |before: u64| before.checked_add(step).filter(|_| step > 0))?;
        before = Some(code);
        let mask: BrickMask = std::array::from_fn(|word| u64::from_le_bytes(mask[word]));
        if code >= BrickCode::END || mask == [0; 8] {
            return None;
        }
        bricks.push((BrickCode(code), mask));
    }
    (bricks.len() == count && words.len() == 8 * count && codes.is_empty()).then_some(bricks)
}

fn take_from(bytes: &mut &[u8]) -> Option<u64> {
    take_number(|| {
        let (first, rest) = bytes.split_first()?;
        *bytes = rest;
        Some(*first)
    })
}

/// Rows of the voxels from their columns.
struct Rows<'a>([Option<&'a [u8]>; COLUMNS]);

impl<'a> Rows<'a> {
    fn new(columns: &'a [Vec<u8>; COLUMNS]) -> Self {
        // An empty column contains zeros.
        Self(std::array::from_fn(|k| (!columns[k].is_empty()).then_some(&*columns[k])))
    }

    fn next(&mut self) -> Option<Row> {
        let mut row = Row::default();
        for (integer, column) in row.0.iter_mut().zip(&mut self.0) {
            if let Some(column) = column {
                *integer = take_from(column)?;
            }
        }
        Some(row)
    }

    fn is_at_end(&self) -> bool {
        self.0.iter().flatten().all(|column| column.is_empty())
    }
}

/// Votes for other classes than the main one, in the order of the voxels.
struct Votes<'a> {
    bytes: &'a [u8],
    /// Number of the voxel of the next vote.
    next: Option<u64>,
}

impl<'a> Votes<'a> {
    fn new(mut bytes: &'a [u8]) -> Self {
        let next = take_from(&mut bytes);
        Self { bytes, next }
    }

    /// Takes the votes of a voxel; `None` if they are not valid.
    fn of(&mut self, number: u64) -> Option<Vec<ClassVotes>> {
        let mut votes: Vec<ClassVotes> = Vec::new();
        while self.next == Some(number) {
            let (&class, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            let vote = ClassVotes { class, votes: take_from(&mut self.bytes)? };
            if vote.votes == 0 || votes.last().is_some_and(|last| last.class >= class) {
                return None;
            }
            votes.push(vote);
            self.next = match self.bytes {
                [] => None,
                _ => Some(number.checked_add(take_from(&mut self.bytes)?)?),
            };
        }
        Some(votes)
    }

    fn is_at_end(&self) -> bool {
        self.next.is_none() && self.bytes.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{LayerHit, LayerHits};
    use crate::tile::format::CompactEffort;
    use proptest::prelude::*;

    const TILE: VoxelBox = VoxelBox { min: [-16, 0, 100], end: [16, 32, 132] };

    fn all() -> Layers {
        Layers { colour: true, intensity_max: Some(255.0), class: true, time: true, shape: true }
    }

    fn any_hits() -> impl Strategy<Value = Vec<(LayerHit, Option<i64>)>> {
        let class = prop::option::of(prop::sample::select(vec![0, 2, 2, 2, 255]));
        let offset = prop::array::uniform3(-512..512_i16);
        let hit = (
            0..3000_u32,
            offset,
            any::<Option<u16>>(),
            any::<Option<[u8; 3]>>(),
            class,
            any::<Option<i64>>(),
        );
        let hit = hit.prop_map(|(place, offset, intensity, colour, class, stamp_ns)| {
            let voxel = LayerHit::packed_voxel([place % 32, place / 32 % 9, place / 288].map(|k| k as i32));
            (LayerHit { voxel, offset, intensity, colour, class }, stamp_ns)
        });
        prop::collection::vec(hit, 1..60)
    }

    fn table(hits: impl Iterator<Item = (LayerHit, Option<i64>)>) -> LayerTable {
        let mut table = LayerTable::new(all());
        for (hit, stamp_ns) in hits {
            let mut of_scan = LayerHits::new(all(), stamp_ns);
            of_scan.push(hit);
            table.add(TILE.min, &of_scan);
        }
        table
    }

    fn section(table: &LayerTable) -> Vec<u8> {
        layer_section(table, &mut ColumnWriter::new(CompactEffort::Fast).unwrap()).unwrap()
    }

    fn read(bytes: &[u8]) -> Result<LayerTable, DecodeError> {
        read_layer_section(&mut { bytes }, bytes.len() as u64, &TILE)
    }

    proptest! {
        #[test]
        fn layers_round_trip_and_equal_layers_have_equal_bytes(hits in any_hits()) {
            let (ahead, back) = (table(hits.iter().copied()), table(hits.iter().rev().copied()));
            let bytes = section(&ahead);
            prop_assert!(ahead.is_same(&back) && bytes == section(&back));
            let read = read(&bytes).unwrap();
            prop_assert!(read.is_same(&ahead));
            prop_assert_eq!(section(&read), bytes);
        }

        #[test]
        fn damaged_sections_are_errors_or_layers(hits in any_hits(), at in any::<prop::sample::Index>(), bit in 0..8) {
            let mut bytes = section(&table(hits.into_iter()));
            let at = at.index(bytes.len());
            bytes[at] ^= 1_u8 << bit;
            prop_assert!(read(&bytes).is_err());
            prop_assert!(read(&bytes[..at]).is_err());
            // With a checksum that matches, what is read can be written.
            let crc = crc32fast::hash(&bytes[HEADER_BYTES..]);
            bytes[16..20].copy_from_slice(&crc.to_le_bytes());
            if let Ok(table) = read(&bytes) {
                prop_assert!(read(&section(&table)).unwrap().is_same(&table));
            }
        }
    }
}
