use super::file_bytes::Pieces;

/// Type of a bag record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RecordKind {
    Message,
    BagHeader,
    IndexData,
    Chunk,
    ChunkInfo,
    Connection,
}

/// Header of a bag record: fields with names and values.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    pub(super) op: Option<RecordKind>,
    fields: Vec<(String, Vec<u8>)>,
    pub(super) header_bytes: u64,
    /// Record data, if it was read.
    pub(super) data: Vec<u8>,
}

impl Record {
    /// Parses a sequence of length-prefixed `name=value` fields.
    pub(super) fn of(header: &[u8]) -> Option<Self> {
        let mut pieces = Pieces::new(header);
        let mut record = Self { header_bytes: header.len() as u64, ..Self::default() };
        while !pieces.is_empty() {
            let field = pieces.sized()?;
            let equals = field.iter().position(|&byte| byte == b'=')?;
            let (name, value) = field.split_at_checked(equals)?;
            let value = value.strip_prefix(b"=")?;
            record.fields.push((String::from_utf8_lossy(name).into_owned(), value.to_vec()));
        }
        record.op = match record.value("op")? {
            [2] => Some(RecordKind::Message),
            [3] => Some(RecordKind::BagHeader),
            [4] => Some(RecordKind::IndexData),
            [5] => Some(RecordKind::Chunk),
            [6] => Some(RecordKind::ChunkInfo),
            [7] => Some(RecordKind::Connection),
            _ => None,
        };
        Some(record)
    }

    /// Returns a text field from the data of a connection, which has no `op` field. `None` if any field is damaged.
    pub(super) fn text_of(data: &[u8], name: &str) -> Option<String> {
        let (mut pieces, mut found) = (Pieces::new(data), None);
        while !pieces.is_empty() {
            let field = pieces.sized()?;
            let equals = field.iter().position(|&byte| byte == b'=')?;
            let (known, value) = field.split_at_checked(equals)?;
            if known == name.as_bytes() && found.is_none() {
                found = value.strip_prefix(b"=");
            }
        }
        found.map(|value| String::from_utf8_lossy(value).into_owned())
    }

    fn value(&self, name: &str) -> Option<&[u8]> {
        self.fields.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_slice())
    }

    pub(super) fn text(&self, name: &str) -> Option<String> {
        self.value(name).map(|value| String::from_utf8_lossy(value).into_owned())
    }

    pub(super) fn u32(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(*self.value(name)?.first_chunk()?))
    }

    pub(super) fn u64(&self, name: &str) -> Option<u64> {
        Some(u64::from_le_bytes(*self.value(name)?.first_chunk()?))
    }

    /// Returns a time field in nanoseconds.
    pub(super) fn time_ns(&self, name: &str) -> Option<i64> {
        let mut pieces = Pieces::new(self.value(name)?);
        let (seconds, ns) = (pieces.u32()?, pieces.u32()?);
        // At most 2^32 * 10^9 + 2^32, far below 2^63.
        Some(i64::from(seconds) * 1_000_000_000 + i64::from(ns))
    }
}
