use super::out_file::OutFile;
use super::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Sizes and offsets from this value on require the 64-bit format (ZIP64).
const ZIP64_FROM: u64 = u32::MAX as u64;

/// Writer of a ZIP archive without compression. The size and checksum of each entry are known in advance.
pub(super) struct ZipStore {
    out: OutFile,
    entries: Vec<Entry>,
    zip64_from: u64,
}

struct Entry {
    name: &'static str,
    crc32: u32,
    bytes: u64,
    offset: u64,
}

impl ZipStore {
    pub(super) fn create(path: &Path) -> Result<Self> {
        Ok(Self { out: OutFile::create(path)?, entries: Vec::new(), zip64_from: ZIP64_FROM })
    }

    /// Sets a smaller limit for the 64-bit format, for tests.
    #[cfg(test)]
    pub(super) fn with_zip64_from(mut self, bytes: u64) -> Self {
        self.zip64_from = bytes;
        self
    }

    /// Appends an entry of known size and checksum.
    pub(super) fn entry(
        &mut self,
        name: &'static str,
        crc32: u32,
        bytes: u64,
        parts: &mut [&mut dyn Read],
    ) -> Result<()> {
        let entry = Entry { name, crc32, bytes, offset: self.out.len() };
        let is_large = bytes >= self.zip64_from;
        let mut head = Vec::new();
        head.extend(0x0403_4b50_u32.to_le_bytes());
        entry.push_common(&mut head, is_large, is_large, if is_large { 20 } else { 0 });
        head.extend(name.as_bytes());
        if is_large {
            head.extend([1, 0, 16, 0]);
            head.extend(bytes.to_le_bytes());
            head.extend(bytes.to_le_bytes());
        }
        self.out.write(&head)?;
        let mut copied = 0;
        for part in parts {
            copied += self.out.append(*part)?;
        }
        if copied != bytes {
            let reason = format!("{name} has {copied} bytes, but {bytes} were announced");
            return Err(Error::argument(self.out.path().display().to_string(), reason));
        }
        self.entries.push(entry);
        Ok(())
    }

    /// Writes the central directory.
    pub(super) fn finish(mut self) -> Result<()> {
        let start = self.out.len();
        let mut list = Vec::new();
        for entry in &self.entries {
            entry.push_listed(&mut list, self.zip64_from);
        }
        let (count, bytes) = (self.entries.len() as u64, list.len() as u64);
        let end = start + bytes;
        if start >= self.zip64_from || bytes >= self.zip64_from {
            // End record and locator of the 64-bit format; version 4.5 is required to read it.
            list.extend(0x0606_4b50_u32.to_le_bytes());
            list.extend(44_u64.to_le_bytes());
            list.extend([45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            for number in [count, count, bytes, start] {
                list.extend(number.to_le_bytes());
            }
            list.extend(0x0706_4b50_u32.to_le_bytes());
            list.extend(0_u32.to_le_bytes());
            list.extend(end.to_le_bytes());
            list.extend(1_u32.to_le_bytes());
        }
        let short = |number: u64| u32::try_from(number).unwrap_or(u32::MAX).to_le_bytes();
        list.extend(0x0605_4b50_u32.to_le_bytes());
        list.extend([0; 4]);
        list.extend((count as u16).to_le_bytes());
        list.extend((count as u16).to_le_bytes());
        list.extend(short(bytes));
        list.extend(if start >= self.zip64_from { u32::MAX.to_le_bytes() } else { short(start) });
        list.extend([0; 2]);
        self.out.write(&list)?;
        self.out.finish()
    }
}

impl Entry {
    /// Writes the fields common to local headers and the central directory: from the required version to the length of
    /// the extra field.
    fn push_common(&self, head: &mut Vec<u8>, is_new: bool, is_large: bool, extra_bytes: u16) {
        let version: u16 = if is_new { 45 } else { 20 };
        let size = if is_large { u32::MAX } else { self.bytes as u32 };
        head.extend(version.to_le_bytes());
        // No flags, no compression, and the earliest DOS time stamp, so that equal voxels give equal files.
        head.extend([0, 0, 0, 0, 0, 0, 0x21, 0]);
        head.extend(self.crc32.to_le_bytes());
        head.extend(size.to_le_bytes());
        head.extend(size.to_le_bytes());
        head.extend((self.name.len() as u16).to_le_bytes());
        head.extend(extra_bytes.to_le_bytes());
    }

    fn push_listed(&self, list: &mut Vec<u8>, zip64_from: u64) {
        let (is_large, is_far) = (self.bytes >= zip64_from, self.offset >= zip64_from);
        let mut extra = Vec::new();
        if is_large {
            extra.extend(self.bytes.to_le_bytes());
            extra.extend(self.bytes.to_le_bytes());
        }
        if is_far {
            extra.extend(self.offset.to_le_bytes());
        }
        let extra_bytes = if extra.is_empty() { 0 } else { 4 + extra.len() as u16 };
        list.extend(0x0201_4b50_u32.to_le_bytes());
        list.extend([if extra_bytes > 0 { 45 } else { 20 }, 0]);
        self.push_common(list, extra_bytes > 0, is_large, extra_bytes);
        list.extend([0; 10]);
        list.extend(if is_far { u32::MAX } else { self.offset as u32 }.to_le_bytes());
        list.extend(self.name.as_bytes());
        if extra_bytes > 0 {
            list.extend([1, 0]);
            list.extend((extra.len() as u16).to_le_bytes());
            list.extend(extra);
        }
    }
}
