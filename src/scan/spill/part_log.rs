use crate::scratch::Scratch;
use std::io;

/// Callback that creates the file to which a [`PartLog`] spills.
pub(crate) type MakeScratch<'a> = dyn Fn() -> io::Result<Box<dyn Scratch>> + Sync + 'a;

/// Append-only log of records. Its tail is in memory. If the log is too large, the rest is in a file. Each record links
/// to the previous record of its list, so a list is identified by its last record.
pub(crate) struct PartLog<'a> {
    tail: Vec<u8>,
    max_tail_bytes: usize,
    /// Position of the first byte of the tail.
    tail_at: u64,
    make_file: &'a MakeScratch<'a>,
    file: Option<Box<dyn Scratch>>,
}

/// Link of the first record of a list.
pub(crate) const NONE: u64 = u64::MAX;

const HEADER_BYTES: usize = 12;

impl<'a> PartLog<'a> {
    pub(crate) fn new(max_tail_bytes: usize, make_file: &'a MakeScratch<'a>) -> Self {
        Self { tail: Vec::new(), max_tail_bytes, tail_at: 0, make_file, file: None }
    }

    /// Appends a record to the list that ends with `before`, and returns its position.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be created or written.
    pub(crate) fn append(&mut self, before: u64, record: &[u8]) -> io::Result<u64> {
        let length = u32::try_from(record.len())
            .map_err(|_| io::Error::other("more than 4 GiB of updates for one tile"))?;
        if !self.tail.is_empty() && self.tail.len() + HEADER_BYTES + record.len() > self.max_tail_bytes {
            self.write_tail()?;
        }
        let at = self.tail_at + self.tail.len() as u64;
        self.tail.extend(before.to_le_bytes());
        self.tail.extend(length.to_le_bytes());
        self.tail.extend(record);
        Ok(at)
    }

    fn write_tail(&mut self) -> io::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert((self.make_file)()?),
        };
        file.append(&self.tail)?;
        self.tail_at += self.tail.len() as u64;
        self.tail.clear();
        Ok(())
    }

    /// Returns the position of the previous record of the list.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be read.
    pub(crate) fn before(&mut self, at: u64) -> io::Result<u64> {
        Ok(self.header(at)?.0)
    }

    /// Returns the record at a position.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be read.
    pub(crate) fn record(&mut self, at: u64) -> io::Result<&[u8]> {
        let (_, length) = self.header(at)?;
        self.bytes(at + HEADER_BYTES as u64, length)
    }

    fn header(&mut self, at: u64) -> io::Result<(u64, usize)> {
        let header = self.bytes(at, HEADER_BYTES)?.first_chunk().ok_or(io::ErrorKind::UnexpectedEof)?;
        Ok(parsed(header))
    }

    fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        match (&mut self.file, at.checked_sub(self.tail_at)) {
            (Some(file), None) => file.bytes(at, count),
            (_, at) => self.tail.bytes(at.unwrap_or_default(), count),
        }
    }
}

fn parsed(header: &[u8; HEADER_BYTES]) -> (u64, usize) {
    let before = u64::from_le_bytes(std::array::from_fn(|k| header[k]));
    (before, u32::from_le_bytes(std::array::from_fn(|k| header[8 + k])) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lists_are_read_in_order_from_memory_and_file(
            records in prop::collection::vec((0..4_usize, prop::collection::vec(any::<u8>(), 0..40)), 0..60),
            max_tail_bytes in 0..300_usize,
        ) {
            let make = || Ok(Box::new(Vec::new()) as Box<dyn Scratch>);
            let mut log = PartLog::new(max_tail_bytes, &make);
            let mut last = [NONE; 4];
            for (list, record) in &records {
                last[*list] = log.append(last[*list], record).unwrap();
            }
            for (list, mut at) in last.into_iter().enumerate() {
                let mut back = Vec::new();
                while at != NONE {
                    back.push(log.record(at).unwrap().to_vec());
                    at = log.before(at).unwrap();
                }
                back.reverse();
                let of_list = records.iter().filter(|(of, _)| *of == list).map(|(_, record)| record.clone());
                prop_assert_eq!(back, of_list.collect::<Vec<_>>());
            }
        }
    }
}
