use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// Size of an E57 page. Its last four bytes are a checksum.
pub(super) const PAGE_BYTES: u64 = 1024;
const CONTENT_BYTES: u64 = PAGE_BYTES - 4;

/// Reader of a file without the checksums of its pages.
pub(super) struct Pages<'f> {
    file: BufReader<&'f mut File>,
    /// Physical position in the file.
    at: u64,
}

impl<'f> Pages<'f> {
    /// Starts at a physical position of the file.
    pub(super) fn new(file: &'f mut File, at: u64) -> io::Result<Self> {
        file.seek(SeekFrom::Start(at))?;
        Ok(Self { file: BufReader::with_capacity(1 << 14, file), at })
    }

    /// Returns the logical position, without checksums.
    pub(super) fn position(&self) -> u64 {
        self.at / PAGE_BYTES * CONTENT_BYTES + (self.at % PAGE_BYTES).min(CONTENT_BYTES)
    }

    pub(super) fn skip(&mut self, bytes: u64) -> io::Result<()> {
        let to = self.position().saturating_add(bytes);
        let to = (to / CONTENT_BYTES).saturating_mul(PAGE_BYTES).saturating_add(to % CONTENT_BYTES);
        let by = i64::try_from(to.saturating_sub(self.at)).map_err(|_| io::ErrorKind::UnexpectedEof)?;
        self.file.seek_relative(by)?;
        self.at = to;
        Ok(())
    }
}

impl Read for Pages<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at % PAGE_BYTES >= CONTENT_BYTES {
            self.skip(0)?;
        }
        let left = CONTENT_BYTES - self.at % PAGE_BYTES;
        let count = (&mut self.file).take(left).read(buffer)?;
        self.at += count as u64;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_checksums_are_skipped() {
        let mut file = tempfile::tempfile().unwrap();
        let content: Vec<u8> = (0..5 * CONTENT_BYTES).map(|k| (k * 7 / 3) as u8).collect();
        for page in content.chunks(CONTENT_BYTES as usize) {
            io::Write::write_all(&mut file, &[page, &[255; 4]].concat()).unwrap();
        }
        for at in [0, 5, 1019, 1020, 1023, 2000] {
            let mut found = Vec::new();
            let mut pages = Pages::new(&mut file, at).unwrap();
            let start = pages.position() as usize;
            pages.read_to_end(&mut found).unwrap();
            assert!(found == content[start..], "{at}");
            for skipped in [0, 1, 500, 1020, 3000] {
                let mut pages = Pages::new(&mut file, at).unwrap();
                pages.skip(skipped).unwrap();
                let mut found = [0; 9];
                pages.read_exact(&mut found).unwrap();
                let start = start + skipped as usize;
                assert_eq!(found, content[start..start + 9], "{at} {skipped}");
            }
        }
    }
}
