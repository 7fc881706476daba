//! What a LAZ file says of its chunks, checked before the crate `laz` decodes it: that reserves memory by what the file
//! claims, and a claim of gigabytes ends the program.

use super::guard::guarded;
use super::las_layout::{Layout, number};
use crate::spill::Budget;
use laz::LazVlr;
use laz::laszip::{ChunkTable, ChunkTableEntry};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Most bytes of a point before it is compressed: formats need 67, the rest are extra bytes, each with models of its
/// own in memory.
const MAX_POINT_BYTES: u64 = 1024;
/// Most parts of a point: position, time, colour, wave packet, extra bytes.
const MAX_ITEMS: usize = 5;
/// Points in one stream, without chunks.
const POINT_WISE: u64 = 1;
/// Points in chunks, whose fields are apart: each chunk says how many bytes every field takes.
const LAYERED: u64 = 3;
/// The library has the table twice, and so has this check.
const TABLE_COPIES: u64 = 4;
/// Bytes of the place of the chunk table, in front of the points.
const TABLE_PLACE_BYTES: u64 = 8;

/// Refuses a file whose chunks cannot be where it says, or do not fit in memory. Returns where the chunk table is, if
/// there is one.
pub(super) fn check(path: &Path, file: &File, layout: &Layout, budget: &Budget) -> Result<Option<u64>> {
    let wrong = |at: u64, reason: String| FormatError::at_offset(at, reason).in_input(path);
    let points_at = layout.points_at;
    let Some(description) = layout.laszip() else {
        return Err(wrong(
            100,
            "the points are compressed, but no record says how (`laszip encoded`)".into(),
        ));
    };
    let description =
        guarded(|| LazVlr::from_buffer(description).map(|laz| (number(description, 0, 2), laz)));
    let (compressor, laz) = description.map_err(|reason| wrong(100, reason))?;
    let point_bytes: u64 = laz.items().iter().map(|item| u64::from(item.size())).sum();
    if laz.items().len() > MAX_ITEMS || point_bytes != layout.record_bytes || point_bytes > MAX_POINT_BYTES {
        let reason = format!(
            "points of {} bytes are compressed as {} parts of {point_bytes} bytes: these must be as many, and at most \
             {MAX_POINT_BYTES}",
            layout.record_bytes,
            laz.items().len()
        );
        return Err(wrong(105, reason));
    }
    // The library goes by the version of the parts: those from 3 on are layers, whatever the compressor is said to be.
    if laz.items().iter().any(|item| (item.version() >= 3) != (compressor == LAYERED)) {
        return Err(wrong(100, format!("compressor {compressor} does not fit the parts of its points")));
    }
    // A writer that was killed leaves 0 in the header. How many points there are does not follow from their bytes.
    let check_count = |bytes: u64| {
        if layout.points > 0 || bytes < point_bytes {
            return Ok(());
        }
        let reason = format!(
            "the header announces no points, but {bytes} bytes of compressed ones follow: the file was not finished; \
             repair its header with the program that wrote it, or write the points again"
        );
        Err(wrong(if layout.has_large_count { 247 } else { 107 }, reason))
    };
    if compressor == POINT_WISE {
        return check_count(layout.file_bytes - points_at).map(|()| None);
    }
    let mut input = BufReader::new(file);
    let table_at = table_place(path, &mut input, layout)?;
    let (data_at, chunks) =
        (points_at + TABLE_PLACE_BYTES, number(&bytes_at(path, &mut input, table_at, 8)?, 4, 4));
    check_count(table_at.saturating_sub(data_at))?;
    // Each chunk begins with a point that is not compressed.
    let most_chunks = (table_at - data_at.min(table_at)) / point_bytes.max(1) + 1;
    if chunks > most_chunks {
        let reason = format!("the chunk table promises {chunks} chunks; before it is room for {most_chunks}");
        return Err(wrong(table_at + 4, reason));
    }
    if chunks.saturating_mul(size_of::<ChunkTableEntry>() as u64) > budget.whole_bytes() / TABLE_COPIES {
        let reason = format!(
            "a table of {chunks} chunks exceeds its share of the memory for reading: raise `memory`, or write the file \
             with larger chunks"
        );
        return Err(wrong(table_at + 4, reason));
    }
    input.seek(SeekFrom::Start(points_at)).map_err(|error| Error::io(path, "read", error))?;
    let table =
        guarded(|| ChunkTable::read_from(&mut input, &laz)).map_err(|reason| wrong(table_at, reason))?;
    let (mut at, mut room) = (data_at, 0_u64);
    for (chunk, entry) in table.as_ref().iter().enumerate() {
        let end = at.checked_add(entry.byte_count).filter(|end| *end <= table_at);
        let Some(end) = end else {
            let reason = format!(
                "the chunk table promises {} bytes for chunk {chunk} at byte {at}; the chunks end at byte {table_at}",
                entry.byte_count
            );
            return Err(wrong(table_at, reason));
        };
        // A chunk behind all points may be empty.
        if compressor == LAYERED && entry.byte_count > budget.whole_bytes() {
            let reason = format!(
                "chunk {chunk} has {} bytes, and at most {} of a chunk are held in memory: raise `memory`, or write the \
                 file with smaller chunks",
                entry.byte_count,
                budget.whole_bytes()
            );
            return Err(wrong(at, reason));
        }
        if compressor == LAYERED && room < layout.points && entry.point_count > 0 {
            check_layers(path, &mut input, &laz, at, end)?;
        }
        room = room.saturating_add(entry.point_count);
        at = end;
    }
    if room < layout.points {
        let reason = format!("{} points are announced; the chunk table has room for {room}", layout.points);
        return Err(wrong(if layout.has_large_count { 247 } else { 107 }, reason));
    }
    Ok(Some(table_at))
}

/// Where the chunk table is: said in front of the points, or in the last bytes of the file if the writer could not go
/// back.
fn table_place(path: &Path, input: &mut BufReader<&File>, layout: &Layout) -> Result<u64> {
    let mut said_at = layout.points_at;
    let mut table_at = number(&bytes_at(path, input, said_at, TABLE_PLACE_BYTES)?, 0, 8);
    let is_before = |place: u64| place as i64 <= layout.points_at as i64;
    if is_before(table_at) {
        said_at = layout.file_bytes.saturating_sub(TABLE_PLACE_BYTES);
        table_at = number(&bytes_at(path, input, said_at, TABLE_PLACE_BYTES)?, 0, 8);
    }
    if is_before(table_at) || table_at > layout.file_bytes.saturating_sub(8) {
        let reason = format!(
            "the chunk table is said to be at byte {table_at} of a file of {} bytes: it is cut off or damaged",
            layout.file_bytes
        );
        return Err(FormatError::at_offset(said_at, reason).in_input(path));
    }
    Ok(table_at)
}

/// Checks the lengths of the fields of a chunk: they stand behind its first point and its number of points.
fn check_layers(path: &Path, input: &mut BufReader<&File>, laz: &LazVlr, at: u64, end: u64) -> Result<()> {
    let layers = laz.items().iter().map(|item| match u16::from(item.item_type()) {
        // Point, colour, colour with near infrared, wave packet, extra bytes.
        10 => 9,
        12 => 2,
        14 => u64::from(item.size()),
        _ => 1,
    });
    let lengths_bytes = 4 * layers.sum::<u64>();
    let lengths_at = at + laz.items_size() + 4;
    let lengths = bytes_at(path, input, lengths_at, lengths_bytes)?;
    let claimed: u64 = lengths.chunks_exact(4).map(|length| number(length, 0, 4)).sum();
    let there = end.saturating_sub(lengths_at + lengths_bytes);
    // The library takes what stands behind the fields as the next chunk.
    if claimed != there {
        let reason = format!("the fields of a chunk claim {claimed} bytes; it has {there}");
        return Err(FormatError::at_offset(lengths_at, reason).in_input(path));
    }
    Ok(())
}

/// A few bytes of a file; they are missing if it was cut off.
fn bytes_at(path: &Path, input: &mut BufReader<&File>, at: u64, count: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = input.seek(SeekFrom::Start(at)).and_then(|_| input.take(count).read_to_end(&mut bytes));
    read.map_err(|error| Error::io(path, "read", error))?;
    if (bytes.len() as u64) < count {
        return Err(FormatError::at_offset(at, "the file ends within its compressed points").in_input(path));
    }
    Ok(bytes)
}
