use crate::mapping::{forget_pages, map};
use crate::window::Window;
use memmap2::Mmap;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// A file without a name: it goes when it is dropped, or with the process. It is written at its end only.
#[derive(Debug)]
pub struct ScratchFile {
    file: File,
    len: u64,
    /// What [`Self::bytes`] looks at.
    mapped: Option<Mapped>,
}

#[derive(Debug)]
struct Mapped {
    mapping: Mmap,
    /// Where in the file it begins.
    at: u64,
    /// Bytes of pages that may have been looked at since they were given back.
    seen: usize,
}

/// Pages that records were read from count as memory of the process. So many bytes of them are kept.
const MAX_SEEN_BYTES: usize = 4 << 20;
/// A look at one byte may bring so many bytes along.
const PAGES_AROUND_BYTES: usize = 64 << 10;
/// Bytes that are mapped at a time for records at any place: all of the file, where addresses suffice.
const MAPPED_BYTES: u64 = if cfg!(target_pointer_width = "64") { 1 << 46 } else { 1 << 26 };
/// Windows begin at multiples of this, so that a record which crosses the end of one lies within the next.
const STEP_BYTES: u64 = MAPPED_BYTES / 2;

impl ScratchFile {
    /// An empty file on the file system of a folder.
    ///
    /// # Errors
    ///
    /// A file system that refuses.
    pub fn in_folder(folder: &Path) -> io::Result<Self> {
        Ok(Self { file: tempfile::tempfile_in(folder)?, len: 0, mapped: None })
    }

    /// Bytes of the file.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether nothing was appended.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Appends bytes. After an error the file is as long as before, and what is appended next overwrites the rest.
    ///
    /// # Errors
    ///
    /// A file system that refuses.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Err(error) = self.file.write_all(bytes) {
            io::Seek::seek(&mut self.file, io::SeekFrom::Start(self.len))?;
            return Err(error);
        }
        self.len += bytes.len() as u64;
        Ok(())
    }

    /// Bytes at any place. Only a few MiB of the file count as memory of the process, however much is read.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::UnexpectedEof`] behind the end; a system that does not map the file.
    pub fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        self.check(at, count)?;
        let end = at + count as u64;
        let is_mapped = self
            .mapped
            .as_ref()
            .is_some_and(|mapped| mapped.at <= at && end <= mapped.at + mapped.mapping.len() as u64);
        if !is_mapped {
            self.mapped = None;
            let begin = at / STEP_BYTES * STEP_BYTES;
            let bytes = (self.len - begin).min(MAPPED_BYTES).max(end - begin);
            let bytes = usize::try_from(bytes).map_err(io::Error::other)?;
            if bytes == 0 {
                return Ok(&[]);
            }
            self.mapped = Some(Mapped { mapping: map(&self.file, begin, bytes)?, at: begin, seen: 0 });
        }
        let Some(mapped) = &mut self.mapped else { return Ok(&[]) };
        if mapped.seen > MAX_SEEN_BYTES {
            forget_pages(&mapped.mapping);
            mapped.seen = 0;
        }
        mapped.seen = mapped.seen.saturating_add(count).saturating_add(PAGES_AROUND_BYTES);
        // It fits: the part is within the mapping.
        let first = (at - mapped.at) as usize;
        Ok(&mapped.mapping[first..first + count])
    }

    /// A part of the file, for reading it in order. All of it that was looked at counts as memory until it is dropped.
    ///
    /// # Errors
    ///
    /// As for [`Self::bytes`].
    pub fn window(&self, at: u64, count: usize) -> io::Result<Window> {
        self.check(at, count)?;
        let mapping = (count > 0).then(|| map(&self.file, at, count)).transpose()?;
        Ok(Window { mapping })
    }

    fn check(&self, at: u64, count: usize) -> io::Result<()> {
        match at.checked_add(count as u64).is_some_and(|end| end <= self.len) {
            true => Ok(()),
            false => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }
}

impl Write for ScratchFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.append(bytes).map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_appended_comes_back_at_any_place(
            parts in prop::collection::vec((0..9000_usize, any::<u8>()), 1..20),
            looks in prop::collection::vec((any::<u16>(), any::<u16>()), 1..30),
        ) {
            let mut file = ScratchFile::in_folder(&std::env::temp_dir()).unwrap();
            let mut all = Vec::new();
            for (length, first) in parts {
                let part: Vec<u8> = (0..length).map(|k| (k as u8).wrapping_add(first)).collect();
                file.append(&part).unwrap();
                all.extend(part);
                prop_assert_eq!(file.len(), all.len() as u64);
                for &(a, b) in &looks {
                    let (a, b) = (usize::from(a) % (all.len() + 1), usize::from(b) % (all.len() + 1));
                    let (at, count) = (a.min(b), a.abs_diff(b));
                    prop_assert_eq!(file.bytes(at as u64, count).unwrap(), &all[at..at + count]);
                    prop_assert_eq!(&*file.window(at as u64, count).unwrap(), &all[at..at + count]);
                }
                prop_assert!(file.bytes(file.len(), 1).is_err() && file.window(u64::MAX, 2).is_err());
            }
        }
    }

    #[test]
    fn a_window_outlives_its_file() {
        let mut file = ScratchFile::in_folder(&std::env::temp_dir()).unwrap();
        file.append(&[7; 10_000]).unwrap();
        let window = file.window(5000, 5000).unwrap();
        drop(file);
        assert_eq!(&*window, &[7; 5000]);
    }

    /// Of a file of 64 MiB, records at many places were looked at; the process has kept a few MiB.
    #[cfg(target_os = "linux")]
    #[test]
    fn reading_takes_little_memory() {
        let mut file = ScratchFile::in_folder(&std::env::temp_dir()).unwrap();
        for part in 0..64_u8 {
            file.append(&vec![part; 1 << 20]).unwrap();
        }
        for step in 0..20_000_u64 {
            let at = step * 7919 * 4096 % ((64 << 20) - 100);
            assert_eq!(file.bytes(at, 100).unwrap()[0], (at >> 20) as u8);
        }
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let line = status.lines().find(|line| line.starts_with("RssFile:")).unwrap();
        let kib: u64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(kib < 24 << 10, "{kib} KiB of files");
    }
}
