use super::effort::CompactEffort;
use super::numbers::put_number;
use std::io;
use zstd::bulk::Compressor;
use zstd::zstd_safe::compress_bound;

/// Packs columns.
pub(super) struct Packer {
    zstd: Compressor<'static>,
    packed: Vec<u8>,
}

/// A column of fewer bytes is not packed.
const LEAST_BYTES: usize = 24;

impl Packer {
    pub(super) fn new(effort: CompactEffort) -> io::Result<Self> {
        let mut zstd = Compressor::new(effort.level())?;
        zstd.include_checksum(false)?;
        zstd.include_contentsize(false)?;
        zstd.include_dictid(false)?;
        Ok(Self { zstd, packed: Vec::new() })
    }

    /// Appends columns: first of each its length and that of what is written of it, then these. A column that does not
    /// become smaller is written as it is.
    pub(super) fn put_columns<const N: usize>(
        &mut self,
        columns: [&[u8]; N],
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        let mut written = Vec::new();
        for column in columns {
            let packed = self.pack(column)?;
            put_number(column.len() as u64, out);
            put_number(packed.len() as u64, out);
            written.extend_from_slice(packed);
        }
        out.extend_from_slice(&written);
        Ok(())
    }

    fn pack<'a>(&'a mut self, column: &'a [u8]) -> io::Result<&'a [u8]> {
        if column.len() < LEAST_BYTES {
            return Ok(column);
        }
        let bound = compress_bound(column.len());
        if self.packed.len() < bound {
            self.packed.resize(bound, 0);
        }
        let length = self.zstd.compress_to_buffer(column, &mut self.packed[..bound])?;
        Ok(if length < column.len() { &self.packed[..length] } else { column })
    }
}
