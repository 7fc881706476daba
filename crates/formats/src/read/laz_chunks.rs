//! Checks the chunks of a LAZ file before the crate `laz` decodes it. That crate allocates memory as the file claims,
//! so a claim of gigabytes would abort the program.

use super::guard::guarded;
use super::las_count::{cut_off, stopped};
use super::las_layout::{Layout, number};
use super::laz_head::{LayeredHead, bytes_at};
use crate::spill::Budget;
use laz::laszip::{ChunkTable, ChunkTableEntry};
use laz::{LazItem, LazVlr};
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Limit for the size of an uncompressed point. Point formats need up to 67 bytes; the rest are extra bytes, each with
/// its own models in memory.
const MAX_POINT_BYTES: u64 = 1024;
/// Maximum number of parts of a point: position, time, colour, wave packet, extra bytes.
const MAX_ITEMS: usize = 5;
/// Compressor type: one stream of points without chunks and chunk table. Written by LASzip up to version 1.2.
const POINT_WISE: u64 = 1;
/// Compressor type: chunks with separate layers of fields. Each chunk states the size of every layer.
const LAYERED: u64 = 3;
/// Copies of the table in memory: the table while it is read, and the point counts kept from it.
const TABLE_COPIES: u64 = 2;
/// Size of the offset of the chunk table, which precedes the points.
const TABLE_PLACE_BYTES: u64 = 8;

/// Compressed points of a file.
#[derive(Clone)]
pub(super) struct Chunks {
    pub(super) items: Vec<LazItem>,
    /// Whether fields are in separate layers instead of point by point.
    pub(super) is_layered: bool,
    pub(super) data_at: u64,
    pub(super) points: ChunkPoints,
    /// Whether there is a chunk table. Without one, only the announced number of points shows where the points end.
    pub(super) has_table: bool,
}

/// Number of points per chunk.
#[derive(Clone)]
pub(super) enum ChunkPoints {
    /// A single chunk has all points.
    All,
    /// All chunks but the last have this many points.
    Each(u64),
    /// Each chunk has its own number of points.
    Own(Vec<u64>),
}

impl Chunks {
    /// Checks that the chunks are within the file and fit in memory, and sets the number of points to read.
    pub(super) fn read(path: &Path, file: &File, layout: &mut Layout, budget: &Budget) -> Result<Self> {
        let wrong = |at: u64, reason: String| FormatError::at_offset(at, reason).in_input(path);
        let Some(description) = layout.laszip() else {
            return Err(wrong(
                100,
                "the points are compressed, but the record `laszip encoded` is missing".into(),
            ));
        };
        let compressor = number(description, 0, 2);
        let laz = guarded(|| LazVlr::from_buffer(description)).map_err(|reason| wrong(100, reason))?;
        let point_bytes: u64 = laz.items().iter().map(|item| u64::from(item.size())).sum();
        if laz.items().len() > MAX_ITEMS
            || point_bytes != layout.record_bytes
            || point_bytes > MAX_POINT_BYTES
        {
            let reason = format!(
                "points of {} bytes are compressed as {} parts of {point_bytes} bytes: the sizes must be equal and at \
                 most {MAX_POINT_BYTES}",
                layout.record_bytes,
                laz.items().len()
            );
            return Err(wrong(105, reason));
        }
        // The decoder uses the version of the parts: versions 3 and above are layered, whatever the compressor type.
        if !(POINT_WISE..=LAYERED).contains(&compressor)
            || laz.items().iter().any(|item| (item.version() >= 3) != (compressor == LAYERED))
        {
            return Err(wrong(
                100,
                format!("compressor type {compressor} contradicts the versions of the point parts"),
            ));
        }
        let mut reader = ChunkReader { path, input: BufReader::new(file), laz, compressor, budget };
        if compressor == POINT_WISE {
            let there = layout.file_bytes - layout.points_at;
            layout.points = layout.counts.choose(0, u64::MAX);
            reader.check_number(layout, there)?;
            layout.remarks.extend(layout.counts.remark(layout.points));
            return Ok(reader.chunks(layout.points_at, ChunkPoints::All, false));
        }
        match reader.table(layout)? {
            Some((table_at, table)) => reader.with_table(layout, table_at, &table),
            None => reader.without_table(layout),
        }
    }
}

/// State of the check of a file's chunks.
struct ChunkReader<'f> {
    path: &'f Path,
    input: BufReader<&'f File>,
    laz: LazVlr,
    compressor: u64,
    budget: &'f Budget,
}

impl ChunkReader<'_> {
    fn wrong(&self, at: u64, reason: String) -> Error {
        FormatError::at_offset(at, reason).in_input(self.path)
    }

    fn point_bytes(&self) -> u64 {
        self.laz.items().iter().map(|item| u64::from(item.size())).sum()
    }

    fn is_layered(&self) -> bool {
        self.compressor == LAYERED
    }

    fn chunks(&self, data_at: u64, points: ChunkPoints, has_table: bool) -> Chunks {
        let (items, is_layered) = (self.laz.items().clone(), self.is_layered());
        Chunks { items, is_layered, data_at, points, has_table }
    }

    /// Rejects a header with 0 points, left by a killed writer: compressed bytes do not reveal the number of points.
    fn check_number(&self, layout: &Layout, bytes: u64) -> Result<()> {
        if layout.points > 0 || bytes < self.point_bytes() {
            return Ok(());
        }
        let reason = format!(
            "the header announces no points, but {bytes} bytes of compressed points follow: the writer was \
             interrupted; repair the header with the program that wrote it, or write the file again"
        );
        Err(self.wrong(layout.counts.place(), reason))
    }

    /// Reads the chunk table and its offset. `None` if the file ends before or within it.
    fn table(&mut self, layout: &Layout) -> Result<Option<(u64, ChunkTable)>> {
        let Some(table_at) = self.table_place(layout)? else { return Ok(None) };
        let data_at = layout.points_at + TABLE_PLACE_BYTES;
        let chunks = number(&bytes_at(self.path, &mut self.input, table_at, 8)?, 4, 4);
        // Each chunk begins with an uncompressed point, which limits the number of chunks.
        let max_chunks = (table_at - data_at.min(table_at)) / self.point_bytes().max(1) + 1;
        if chunks > max_chunks {
            let reason =
                format!("the chunk table lists {chunks} chunks, but there is only space for {max_chunks}");
            return Err(self.wrong(table_at + 4, reason));
        }
        if chunks.saturating_mul(size_of::<ChunkTableEntry>() as u64)
            > self.budget.whole_bytes() / TABLE_COPIES
        {
            let reason = format!(
                "a table of {chunks} chunks exceeds the memory for reading: raise `memory`, or write the file with \
                 larger chunks"
            );
            return Err(self.wrong(table_at + 4, reason));
        }
        // The library reads the table's offset and the table again.
        self.input
            .seek(SeekFrom::Start(layout.points_at))
            .map_err(|error| Error::io(self.path, "read", error))?;
        let (input, laz) = (&mut self.input, &self.laz);
        Ok(guarded(|| ChunkTable::read_from(input, laz)).ok().map(|table| (table_at, table)))
    }

    /// Returns the offset of the chunk table. It precedes the points, or is in the last bytes of the file if the writer
    /// could not seek back.
    fn table_place(&mut self, layout: &Layout) -> Result<Option<u64>> {
        let last_at = layout.file_bytes.saturating_sub(TABLE_PLACE_BYTES);
        let is_place = |place: u64| place as i64 > layout.points_at as i64 && place <= last_at;
        for said_at in [layout.points_at, last_at] {
            if said_at > last_at {
                continue;
            }
            let place = number(&bytes_at(self.path, &mut self.input, said_at, TABLE_PLACE_BYTES)?, 0, 8);
            if is_place(place) {
                return Ok(Some(place));
            }
            // The library looks at the end only if the writer left the offset unset.
            if place as i64 > layout.points_at as i64 {
                break;
            }
        }
        Ok(None)
    }

    /// Checks each chunk against the table, and the number of points against both.
    fn with_table(&mut self, layout: &mut Layout, table_at: u64, table: &ChunkTable) -> Result<Chunks> {
        let data_at = layout.points_at + TABLE_PLACE_BYTES;
        let most = layout.counts.legacy.max(layout.counts.large.unwrap_or(0));
        let is_variable = self.laz.uses_variable_size_chunks();
        let (mut at, mut room) = (data_at, 0_u64);
        // Number of points by the chunks' own counts.
        let (mut own, mut own_points) = (self.is_layered().then_some(0_u64), Vec::new());
        for (chunk, entry) in table.as_ref().iter().enumerate() {
            let end = at.checked_add(entry.byte_count).filter(|end| *end <= table_at);
            let Some(end) = end else {
                let reason = format!(
                    "the chunk table lists {} bytes for chunk {chunk} at byte {at}, but the chunks end at byte \
                     {table_at}",
                    entry.byte_count
                );
                return Err(self.wrong(table_at, reason));
            };
            self.check_chunk_bytes(chunk, at, entry.byte_count)?;
            // A chunk after all points may be empty.
            if entry.point_count == 0 && entry.byte_count > 0 && (room < most || most == 0) {
                let reason = format!("chunk {chunk} has {} bytes and no points", entry.byte_count);
                return Err(self.wrong(at, reason));
            }
            if self.is_layered() && entry.byte_count > 0 && (room < most || most == 0 || is_variable) {
                let head = LayeredHead::read(self.path, &mut self.input, &self.laz, at);
                match head.and_then(|head| head.check(self.path, end).map(|()| head.points)) {
                    Ok(points) if is_variable => {
                        own = own.map(|own| own.saturating_add(points));
                        own_points.push(points);
                    }
                    Ok(points) => {
                        own =
                            own.filter(|_| points <= entry.point_count).map(|own| own.saturating_add(points));
                    }
                    Err(error) if room < most => return Err(error),
                    // Writers end a file without points with an empty chunk.
                    Err(_) => own = None,
                }
            } else {
                own = own.filter(|_| entry.byte_count == 0);
            }
            room = room.saturating_add(entry.point_count);
            at = end;
        }
        // If table and chunks differ, use the one that matches the announced number.
        let is_number = |points: u64| layout.counts.choose(points, points) == points;
        let differs = is_variable && own.is_some_and(|own| own != room);
        let is_own = differs && own.is_some_and(is_number);
        if differs && !is_own && !is_number(room) {
            let own = own.unwrap_or(0);
            let reason = format!("the chunk table lists {room} points, but the chunks contain {own}");
            return Err(self.wrong(table_at, reason));
        }
        let there = if is_variable && !is_own { Some(room) } else { own };
        match there {
            // A smaller number than announced is accepted only if the chunks extend up to their table.
            Some(there) if at == table_at || layout.counts.choose(there, there) <= there => {
                take_all(layout, there);
            }
            Some(there) => {
                let announced = layout.counts.choose(there, there);
                let reason = format!("{announced} points are announced, but the chunk table lists {there}");
                return Err(self.wrong(table_at, reason));
            }
            None => {
                let chunk_size = u64::from(self.laz.chunk_size());
                let least = (room + 1).saturating_sub(chunk_size).min(room);
                let announced = layout.counts.choose(least, room);
                layout.points = announced;
                self.check_number(layout, table_at.saturating_sub(data_at))?;
                if room < announced {
                    let reason =
                        format!("{announced} points are announced, but the chunk table lists {room}");
                    return Err(self.wrong(layout.counts.place(), reason));
                }
                layout.remarks.extend(layout.counts.remark(announced));
                if announced < least {
                    layout.remarks.push(format!(
                        "the header announces {announced} points, which are read; the chunks contain {least} or more"
                    ));
                }
            }
        }
        let points = if is_own {
            ChunkPoints::Own(own_points)
        } else if is_variable {
            ChunkPoints::Own(
                table.as_ref().iter().map(|entry| entry.point_count).filter(|n| *n > 0).collect(),
            )
        } else {
            ChunkPoints::Each(u64::from(self.laz.chunk_size()))
        };
        Ok(self.chunks(data_at, points, true))
    }

    /// Follows the chunks one by one until one is incomplete.
    fn without_table(&mut self, layout: &mut Layout) -> Result<Chunks> {
        let data_at = layout.points_at + TABLE_PLACE_BYTES;
        let is_variable = self.laz.uses_variable_size_chunks();
        let announced = layout.counts.choose(0, u64::MAX);
        let there = layout.file_bytes.saturating_sub(data_at);
        if !self.is_layered() {
            if is_variable {
                let reason = "the chunk table with the number of points per chunk is truncated or damaged";
                return Err(self.wrong(layout.points_at, reason.into()));
            }
            layout.points = announced;
            self.check_number(layout, there)?;
            layout.remarks.extend(layout.counts.remark(announced));
            let points = ChunkPoints::Each(u64::from(self.laz.chunk_size()));
            return Ok(self.chunks(data_at, points, false));
        }
        let (mut at, mut whole, mut own) = (data_at, 0_u64, Vec::new());
        let most_own = self.budget.whole_bytes() / TABLE_COPIES / 8;
        while announced == 0 || whole < announced {
            let Ok(head) = LayeredHead::read(self.path, &mut self.input, &self.laz, at) else { break };
            let most = if is_variable { u64::MAX } else { u64::from(self.laz.chunk_size()) };
            let Some(end) = head.end().filter(|end| *end <= layout.file_bytes) else { break };
            if head.points == 0 || head.points > most {
                break;
            }
            self.check_chunk_bytes(own.len(), at, end - at)?;
            whole = whole.saturating_add(head.points);
            if is_variable && own.len() as u64 >= most_own {
                let reason = "its chunks exceed the memory for reading: raise `memory`";
                return Err(self.wrong(at, reason.into()));
            }
            if is_variable {
                own.push(head.points);
            }
            at = end;
        }
        if whole == 0 && announced > 0 {
            let reason = format!("the file ends within the first chunk of its {announced} points");
            return Err(self.wrong(data_at, reason));
        }
        layout.points = if announced == 0 { whole } else { announced.min(whole) };
        self.check_number(layout, there)?;
        layout.remarks.extend(match announced {
            0 if whole == 0 => None,
            0 => Some(stopped(whole)),
            _ if whole < announced => Some(cut_off(whole, announced)),
            _ => Some(format!(
                "the chunk table is truncated or damaged: {announced} points are read without it"
            )),
        });
        let points = match is_variable {
            true => ChunkPoints::Own(own),
            false => ChunkPoints::Each(u64::from(self.laz.chunk_size())),
        };
        Ok(self.chunks(data_at, points, false))
    }

    /// Checks the size of a layered chunk, which is held in memory.
    fn check_chunk_bytes(&self, chunk: usize, at: u64, bytes: u64) -> Result<()> {
        let most = self.budget.whole_bytes();
        if !self.is_layered() || bytes <= most {
            return Ok(());
        }
        let reason = format!(
            "chunk {chunk} has {bytes} bytes, but at most {most} fit in memory: raise `memory`, or write the file with \
             smaller chunks"
        );
        Err(self.wrong(at, reason))
    }
}

/// Sets the number of points of a file from the counts in its chunks.
fn take_all(layout: &mut Layout, there: u64) {
    let announced = layout.counts.choose(there, there);
    layout.points = there;
    layout.remarks.extend(match announced {
        _ if announced == there => layout.counts.remark(there),
        0 => Some(stopped(there)),
        _ => Some(format!("the header announces {announced} points; {there} exist and are read")),
    });
}
