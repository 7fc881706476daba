use super::las_layout::{LASZIP, LASZIP_ID, Layout, number};
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

/// A LAS file as the library is to see it: without the records before its points, which the library would hold in
/// memory, however long they are.
pub(super) struct Trimmed {
    start: Cursor<Vec<u8>>,
    file: File,
    left_out: i64,
}

/// The start of a [`Trimmed`] file: the header, the record of the compression and the place of the chunk table.
#[derive(Clone, Debug)]
pub(super) struct Start {
    bytes: Vec<u8>,
    /// A place behind the start is so many bytes later in the file.
    left_out: i64,
}

/// Bytes of a record before its data.
const RECORD_HEAD_BYTES: usize = 54;
/// The description of the compression is shorter.
const MAX_LASZIP_BYTES: usize = 1 << 10;
/// Bytes of a header by the minor version of LAS.
const HEADER_BYTES: [usize; 5] = [227, 227, 227, 235, 375];

impl Start {
    /// Makes the start of a file. `table_at` is where its chunk table is, if it has one.
    pub(super) fn of(layout: &Layout, table_at: Option<u64>) -> Self {
        let minor = number(&layout.header, 25, 1) as usize;
        let own_bytes = HEADER_BYTES.get(minor).or(HEADER_BYTES.last()).copied().unwrap_or(0);
        let mut bytes = layout.header.clone();
        bytes.truncate(own_bytes.max(number(&layout.header, 94, 2) as usize));
        let header_bytes = bytes.len();
        if let Some(data) = layout.laszip().filter(|_| layout.is_compressed) {
            let data = data.get(..data.len().min(MAX_LASZIP_BYTES)).unwrap_or_default();
            bytes.resize(header_bytes + RECORD_HEAD_BYTES, 0);
            put(&mut bytes, header_bytes + 2, LASZIP.as_bytes());
            put(&mut bytes, header_bytes + 18, &LASZIP_ID.to_le_bytes());
            put(&mut bytes, header_bytes + 20, &(data.len() as u16).to_le_bytes());
            bytes.extend(data);
        }
        let points_at = bytes.len();
        put(&mut bytes, 94, &(header_bytes as u16).to_le_bytes());
        put(&mut bytes, 96, &(points_at as u32).to_le_bytes());
        put(&mut bytes, 100, &u32::from(points_at > header_bytes).to_le_bytes());
        if minor >= 4 {
            // The records behind the points, of which the library reads the first whole.
            put(&mut bytes, 235, &[0; 12]);
        }
        // Both are below 2^33.
        let left_out = layout.points_at as i64 - points_at as i64;
        if let Some(table_at) = table_at {
            bytes.extend((table_at as i64).saturating_sub(left_out).to_le_bytes());
        }
        Self { bytes, left_out }
    }
}

fn put(bytes: &mut [u8], at: usize, new: &[u8]) {
    bytes.iter_mut().skip(at).zip(new).for_each(|(byte, new)| *byte = *new);
}

impl Trimmed {
    pub(super) fn new(start: &Start, file: File) -> Self {
        Self { start: Cursor::new(start.bytes.clone()), file, left_out: start.left_out }
    }

    fn start_bytes(&self) -> u64 {
        self.start.get_ref().len() as u64
    }

    /// Goes to a place behind the start.
    fn seek_file(&mut self, at: u64) -> io::Result<()> {
        let place = at.checked_add_signed(self.left_out).ok_or(io::ErrorKind::InvalidInput)?;
        self.file.seek(SeekFrom::Start(place)).map(drop)
    }

    /// Where a place of the file is.
    fn of_file(&self, at: u64) -> u64 {
        at.saturating_add_signed(self.left_out.saturating_neg())
    }
}

impl Read for Trimmed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.start.read(buffer)?;
        if read == 0 {
            return self.file.read(buffer);
        }
        if self.start.position() == self.start_bytes() {
            self.seek_file(self.start_bytes())?;
        }
        Ok(read)
    }
}

impl Seek for Trimmed {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::End(_) => {
                let at = self.file.seek(to)?;
                self.of_file(at)
            }
            SeekFrom::Current(by) => {
                let here = match self.start.position() < self.start_bytes() {
                    true => self.start.position(),
                    false => {
                        let at = self.file.stream_position()?;
                        self.of_file(at)
                    }
                };
                here.checked_add_signed(by).ok_or(io::ErrorKind::InvalidInput)?
            }
        };
        self.start.set_position(at.min(self.start_bytes()));
        self.seek_file(at.max(self.start_bytes()))?;
        Ok(at)
    }
}
