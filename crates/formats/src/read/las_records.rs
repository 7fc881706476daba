use super::las_layout::number;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Variable length record of a LAS file.
pub(super) struct Record {
    user: String,
    id: u16,
    data: Vec<u8>,
}

/// User IDs of the coordinate system records and of the compression record.
pub(super) const PROJECTION: &str = "LASF_Projection";
pub(super) const LASZIP: &str = "laszip encoded";
pub(super) const LASZIP_ID: u16 = 22204;
/// Record IDs of the coordinate system: as well-known text, and as GeoTIFF keys with their doubles.
pub(super) const WKT_ID: u16 = 2112;
pub(super) const KEYS_ID: u16 = 34735;
pub(super) const DOUBLES_ID: u16 = 34736;
/// Limits. Larger or further records are not coordinate systems.
const MAX_RECORD_BYTES: u64 = 1 << 20;
const MAX_RECORDS: u64 = 10_000;

/// Location of records in a file.
pub(super) struct Span {
    pub(super) start: u64,
    pub(super) end: u64,
    /// Number of records announced.
    pub(super) count: u64,
    /// Size of the length field of a record.
    pub(super) wide: usize,
}

impl Span {
    /// Reads the records in use. Returns the number of records: fewer than announced if the rest does not fit in the
    /// file, more if a known record follows.
    pub(super) fn read(&self, file: &mut File, records: &mut Vec<Record>) -> io::Result<u64> {
        let head_bytes = 52 + self.wide as u64;
        let (mut at, mut found) = (self.start, 0);
        while found < MAX_RECORDS {
            if at.checked_add(head_bytes).is_none_or(|behind| behind > self.end) {
                return Ok(found);
            }
            let mut head = vec![0; 52 + self.wide];
            file.seek(SeekFrom::Start(at))?;
            if file.read_exact(&mut head).is_err() {
                return Ok(found);
            }
            let user: Vec<u8> = head.iter().skip(2).take(16).copied().take_while(|byte| *byte != 0).collect();
            let (id, bytes) = (number(&head, 18, 2) as u16, number(&head, 20, self.wide));
            let data_at = at + head_bytes;
            let Some(next) = data_at.checked_add(bytes).filter(|next| *next <= self.end) else {
                return Ok(found);
            };
            let user = String::from_utf8_lossy(&user).into_owned();
            let is_wanted = match user.as_str() {
                PROJECTION => matches!(id, WKT_ID | KEYS_ID | DOUBLES_ID),
                LASZIP => id == LASZIP_ID,
                _ => false,
            };
            if found >= self.count && !is_wanted {
                return Ok(found);
            }
            // The first of several equal records takes precedence.
            if is_wanted && bytes <= MAX_RECORD_BYTES && find(records, &user, id).is_none() {
                let mut data = Vec::new();
                (&mut *file).take(bytes).read_to_end(&mut data)?;
                records.push(Record { user, id, data });
            }
            (at, found) = (next, found + 1);
        }
        // Records beyond the limit are not inspected, but counted as announced.
        Ok(self.count.max(found))
    }
}

/// Returns the data of a record.
pub(super) fn find<'r>(records: &'r [Record], user: &str, id: u16) -> Option<&'r [u8]> {
    let record = records.iter().find(|record| record.user == user && record.id == id);
    record.map(|record| record.data.as_slice())
}
