use super::header::Header;
use super::input::Input;
use crate::error::{DecodeError, FormatError};
use crate::space::BrickCode;
use std::io::Read;

pub(super) const ENTRY_BYTES: usize = 16;

#[derive(Clone, Copy, Debug)]
pub(super) struct GroupEntry {
    /// Code of the first brick.
    pub(super) first: BrickCode,
    pub(super) bytes: u32,
    pub(super) crc: u32,
}

/// Properties that a group must have according to the index.
#[derive(Clone, Copy, Debug)]
pub(super) struct AnnouncedGroup {
    pub(super) first: BrickCode,
    /// Exclusive upper bound of its brick codes.
    pub(super) end: BrickCode,
    pub(super) bytes: u64,
    pub(super) crc: u32,
}

/// Index of the groups of a table, in order.
#[derive(Debug, Default)]
pub(super) struct GroupIndex {
    pub(super) groups: Vec<GroupEntry>,
}

impl GroupIndex {
    /// Reads the index after a header. Checks that first bricks ascend, and that the lengths of all parts add up.
    pub(super) fn read(header: &Header, input: &mut Input<impl Read>) -> Result<Self, DecodeError> {
        let offset = input.offset;
        let too_many =
            || input.wrong(format!("{} groups do not fit into {} bytes", header.groups, input.left()));
        let bytes = header.groups.checked_mul(ENTRY_BYTES).filter(|&bytes| bytes as u64 <= input.left());
        let mut index = vec![0; bytes.ok_or_else(too_many)?];
        input.read(&mut index)?;
        let groups = index.as_chunks::<ENTRY_BYTES>().0.iter().map(GroupEntry::of).collect();
        let index = Self { groups };
        let wrong = |reason| Err(FormatError::at_offset(offset, reason).into());
        if !index.groups.is_sorted_by(|a, b| a.first < b.first)
            || index.groups.last().is_some_and(|last| last.first.0 >= BrickCode::END)
        {
            return wrong("the first bricks of the groups do not ascend".to_owned());
        }
        let wanted = header.codebook_bytes as u64 + index.bytes_before(index.groups.len());
        if wanted != input.left() {
            return wrong(format!("the parts should have {wanted} bytes, but {} bytes follow", input.left()));
        }
        Ok(index)
    }

    pub(super) fn to_bytes(&self) -> impl Iterator<Item = u8> {
        self.groups.iter().flat_map(|group| group.to_bytes())
    }

    /// Size of the first `number` groups in bytes.
    pub(super) fn bytes_before(&self, number: usize) -> u64 {
        self.groups.iter().take(number).map(|group| u64::from(group.bytes)).sum()
    }

    /// Expected properties of a group.
    pub(super) fn announced(&self, number: usize) -> AnnouncedGroup {
        let GroupEntry { first, bytes, crc } = self.groups[number];
        let end = self.groups.get(number + 1).map_or(BrickCode(BrickCode::END), |next| next.first);
        AnnouncedGroup { first, end, bytes: bytes.into(), crc }
    }

    /// Expected properties of all groups, in order.
    pub(super) fn all_announced(&self) -> impl Iterator<Item = AnnouncedGroup> {
        (0..self.groups.len()).map(|number| self.announced(number))
    }

    /// Returns the number of the group that can contain a brick, if there is one.
    pub(super) fn group_of(&self, brick: BrickCode) -> Option<usize> {
        self.groups.partition_point(|group| group.first <= brick).checked_sub(1)
    }

    /// Checksum of the whole table, computed from that of header and index.
    pub(super) fn crc_of_all(&self, head_crc: u32, header: &Header) -> u32 {
        let codebook = (header.codebook_crc, header.codebook_bytes as u64);
        let parts = self.groups.iter().map(|group| (group.crc, group.bytes.into()));
        std::iter::once(codebook)
            .chain(parts)
            .fold(head_crc, |crc, (part, bytes)| joined_crc(crc, part, bytes))
    }
}

impl GroupEntry {
    fn of(bytes: &[u8; ENTRY_BYTES]) -> Self {
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        let first = BrickCode(u64::from_le_bytes(std::array::from_fn(|k| bytes[k])));
        Self { first, bytes: u32_at(8), crc: u32_at(12) }
    }

    fn to_bytes(self) -> [u8; ENTRY_BYTES] {
        let mut bytes = [0; ENTRY_BYTES];
        bytes[..8].copy_from_slice(&self.first.0.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.bytes.to_le_bytes());
        bytes[12..].copy_from_slice(&self.crc.to_le_bytes());
        bytes
    }
}

/// Combines the CRC-32 of some bytes with that of the bytes that follow them.
pub(in crate::tile::format) fn joined_crc(crc: u32, following: u32, following_bytes: u64) -> u32 {
    let mut all = crc32fast::Hasher::new_with_initial(crc);
    all.combine(&crc32fast::Hasher::new_with_initial_len(following, following_bytes));
    all.finalize()
}
